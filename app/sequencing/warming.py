"""Kernels compiled or loaded before somebody waits for them."""

import numpy as np

from app.geometry.tool import RegionGraph
from app.sequencing.bounds import lower_bound
from app.sequencing.classes import best_classes, equivalent_sequences
from app.sequencing.constraints import Constraints, resolve
from app.sequencing.exact import costs_to_go, form_for, model_for, parallel_is_safe
from app.sequencing.large import Effort, best_found
from app.sequencing.problem import problem_for
from app.sequencing.shortest import Ends, cost_to_go, shortest_sequence

REGIONS = 8  # enough for every kernel


def warm_up() -> None:
    """Call every kernel once on a small made-up tool."""
    n, line = REGIONS, np.arange(REGIONS, dtype=np.float64)
    touching = np.abs(line[:, None] - line) == 1
    box = np.stack([line, np.zeros(n)], axis=1)
    graph = RegionGraph(
        "mesh", touching / 4, touching / 8, touching * 0.1, touching, ~touching, np.zeros(n, np.int64), line / n, line / n,
        np.full(n, 1 / n), box, box + 1,
    )  # fmt: skip
    problem = problem_for(graph)
    problem.tensor()  # as the learner has it
    w = np.ones(len(problem.columns))
    best = shortest_sequence(problem, w, Ends(line, line))
    shortest_sequence(problem, w, constraints=Constraints(never_next=((0, 1),)))
    best_classes(problem, w, 3)
    equivalent_sequences(problem, best.sequence)
    cost_to_go(problem, w)
    best_found(problem, w, effort=Effort(moves=2, beams=(1,), sweeps=False))
    lower_bound(problem, w, best.cost, resolve(Constraints(never_next=((0, 1),)), n), steps=2)
    if parallel_is_safe():
        model = model_for(problem, resolve(None, n))
        costs_to_go(model, form_for(model, w), threads=True)
