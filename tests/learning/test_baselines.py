"""Baselines on tools small enough to look at every order."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from app.errors import InvalidInput
from app.learning.baselines.copying import copy_nearest, draw_weights, middle_first, rows_of
from app.learning.baselines.likelihood import by_maximum_entropy, posterior_chain
from app.learning.baselines.margin_planning import margin_weights, plan_by_margin
from app.learning.maximum_entropy import lessons_of
from app.learning.performance_state import LearningDemonstration
from app.sequencing.problem import problem_for
from app.sequencing.shortest import shortest_sequence
from tests.sequencing.graphs import grid_graph

TRUTH = np.array([0.4, 0.4, 0.3, 0.3, 1.5, 0.6, 0.9, 1.2, 0.5, 2.0, 0.7])


def shown(seed: int) -> LearningDemonstration:
    problem = problem_for(grid_graph(2, 3, seed), ())
    return LearningDemonstration(problem, shortest_sequence(problem, TRUTH).sequence)


def test_margin_planning_is_the_minimum_over_all_orders():
    """The objective at the answer, from all 720 orders, is not beaten nearby; w >= 0."""
    demos = [shown(s) for s in (1, 2)]
    lessons, scale, live = lessons_of(demos)
    orders = list(itertools.permutations(range(6)))
    sums = [np.array([d.problem.feature_sum(s) for s in orders]) / scale * np.array(live) for d in demos]
    paths = [{(frozenset(s[:k]), s[k]) for k in range(6)} for s in (d.sequence for d in demos)]
    losses = [np.array([sum((frozenset(s[:k]), s[k]) not in path for k in range(6)) / 6 for s in orders]) for path in paths]

    def objective(w: np.ndarray) -> float:
        slack = [np.max(t.total @ w - x @ w + loss) for t, x, loss in zip(lessons, sums, losses, strict=True)]
        return 0.005 * float(w @ w) + float(np.mean(slack))

    w = margin_weights(lessons, [d.sequence for d in demos], penalty=0.01)
    assert (w >= 0).all()
    level, generator = objective(w), np.random.default_rng(0)
    assert level < objective(np.zeros_like(w)) - 0.1
    for size in (1e-3, 1e-2, 1e-1):
        for _ in range(40):
            assert objective(np.maximum(w + size * generator.normal(size=len(w)) * np.array(live), 0)) > level - 1e-6


@pytest.mark.parametrize("learner", [plan_by_margin, by_maximum_entropy])
def test_learners_do_better_than_chance(learner):
    """True cost above the optimum on three unseen tools, against the mean of random weights."""
    demos, generator = [shown(s) for s in range(1, 7)], np.random.default_rng(0)
    learned = learner(demos, generator)
    drawn = [draw_weights(demos, generator) for _ in range(20)]

    def regret(order) -> float:
        unseen = [shown(s).problem for s in (11, 12, 13)]
        return float(np.mean([p.cost(TRUTH, order(p)) - shortest_sequence(p, TRUTH).cost for p in unseen]))

    assert regret(learned.order) < 0.5 * np.mean([regret(d.order) for d in drawn])


def test_chain_has_the_posterior_mean_of_a_one_feature_posterior():
    """One tool, one feature: the chain's mean against numerical integration."""
    (lesson,), _, _ = lessons_of([shown(1)])
    one = replace(lesson, values=np.ascontiguousarray(lesson.values[..., 9:10]), total=lesson.total[9:10])
    grid = np.linspace(0, 8, 400)
    from app.learning.baselines.likelihood import _level

    level = np.array([_level([one], np.array([x])) for x in grid])
    p = np.exp(level - level.max())
    chain = posterior_chain([one], np.random.default_rng(1), steps=4000)
    assert chain.mean() == pytest.approx(float(p @ grid / p.sum()), rel=0.12)


def test_rows_and_copied_pattern():
    """A 2 x 3 grid; the nearest tool's order is copied place by place, and without one the middle of each row comes first."""
    graph = grid_graph(2, 3, 1, "real")
    rows = rows_of(replace(graph, low=graph.low[:, ::-1], high=graph.high[:, ::-1]))
    assert rows == [[0, 1, 2], [3, 4, 5]]
    assert middle_first([0, 1, 2, 3, 4]) == [2, 1, 3, 0, 4]
    known = shown(1)
    learned = copy_nearest([known, shown(2)], np.random.default_rng(0))
    assert learned.order(known.problem) == known.sequence
    other = problem_for(grid_graph(3, 2, 3), ())
    assert len(set(learned.order(other))) == 6


def test_margin_planning_refuses_tools_beyond_the_table():
    with pytest.raises(InvalidInput, match="at most 14 regions"):
        plan_by_margin([LearningDemonstration(problem_for(grid_graph(3, 5, 1), ()), tuple(range(15)))], np.random.default_rng(0))
