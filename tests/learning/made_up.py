"""Small tools with a scripted expert of known weights."""

import numpy as np

from app.learning.expert import ScriptedExpert
from app.learning.performance import LearningDemonstration
from app.sequencing.features import DEFAULT_INTERACTIONS
from app.sequencing.problem import SequencingProblem, problem_for
from tests.sequencing.graphs import grid_graph

TRUE_WEIGHTS = np.array([0.4, 0.4, 0.3, 0.3, 1.5, 0.6, 0.9, 1.2, 0.5, 2.0, 0.7, 0.3, 0.4])


def problems(count: int, rows: int = 2, columns: int = 3) -> list[SequencingProblem]:
    return [problem_for(grid_graph(rows, columns, seed), DEFAULT_INTERACTIONS) for seed in range(1, count + 1)]


def demonstrations(expert: ScriptedExpert, tools: list[SequencingProblem]) -> list[LearningDemonstration]:
    return [LearningDemonstration(p, expert.sequence(p)) for p in tools]
