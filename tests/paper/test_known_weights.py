"""Recovery of known weights on the authors' synthetic tools: an expert we made works on their parts."""

import numpy as np
import pytest

from app.geometry.region_table import read_region_table
from app.learning.expert import ScriptedExpert
from app.learning.performance import LearningDemonstration, PerformanceParameters, start_performance
from app.learning.scripted import answer_similarity
from app.sequencing.problem import problem_for
from app.sequencing.shortest import shortest_sequence
from tests.conftest import shared

TRAINED, UNSEEN = (1, 2, 3, 6, 8, 9), (4, 5, 7, 10)
TRUTHS = {
    "all alike": np.ones(10),
    "near first": np.array([0.5, 0.5, 0.2, 0.2, 2.0, 0.3, 0.3, 0.5, 0.2, 0.4]),
    "height first": np.array([0.3, 0.3, 0.3, 0.3, 0.05, 0.5, 0.5, 0.5, 0.1, 3.0]),
}


@pytest.fixture(scope="module")
def problems():
    names = {i: f"Mold_{i}_Data.csv" for i in (*TRAINED, *UNSEEN)}
    texts = {i: shared("datasets", "authors", "synthetic", name).read_text() for i, name in names.items()}
    return {i: problem_for(read_region_table(text, "synthetic", names[i]).tool.graph, ()) for i, text in texts.items()}


@pytest.mark.parametrize("name", TRUTHS)
def test_known_expert_is_explained_and_predicted(problems, name):
    """All six demonstrations become the cheapest (1e-7); on unseen tools the order costs the expert at most 5 % more than its own."""
    truth = TRUTHS[name]
    expert = ScriptedExpert(truth, None)
    demos = [LearningDemonstration(problems[i], expert.sequence(problems[i])) for i in TRAINED]
    parameters = PerformanceParameters()
    result, _ = answer_similarity(demos, expert, parameters, start_performance(demos, parameters, 0), 100)
    assert result.outcome == "converged"
    for d in demos:
        assert d.problem.cost(result.weights, d.sequence) <= shortest_sequence(d.problem, result.weights).cost * (1 + 1e-7)
    for i in UNSEEN:
        chosen, best = shortest_sequence(problems[i], result.weights).sequence, expert.sequence(problems[i])
        assert problems[i].cost(truth, chosen) <= 1.05 * problems[i].cost(truth, best)


def test_weights_of_another_expert_do_not_pass(problems):
    """The same check fails for an expert who wants the opposite, so it is not passed by everything."""
    truth = TRUTHS["height first"]
    expert = ScriptedExpert(truth, None)
    away = np.array([1.0, 1.0, 1.0, 1.0, 5.0, 0.1, 0.1, 0.1, 1.0, 0.01])
    excess = [problems[i].cost(away, expert.sequence(problems[i])) / shortest_sequence(problems[i], away).cost for i in TRAINED]
    assert max(excess) > 1.05
