"""The soft program over listed transitions: against every order, against the table of all sets, and in part against the whole."""

import numpy as np
import pytest

from app.learning.soft_graph import cheapest_in, covariance_of, drawn_from, expected_sums_of, part_graph, to_go_of, whole_graph
from app.learning.soft_program import expected_sums, soft_to_go
from app.sequencing.problem import problem_for
from tests.sequencing.graphs import every_order, grid_graph

SIX = problem_for(grid_graph(2, 3, 4), ())
UNIT = np.full(len(SIX.columns), 0.8)
W = np.random.default_rng(0).normal(size=len(SIX.columns)) * 2


def test_against_all_720_orders():
    """Sum, mean and covariance by hand; draws come in these proportions, with their own sums."""
    orders, sums = every_order(SIX)
    values = sums * UNIT
    weight = np.exp(-values @ W)
    p = weight / weight.sum()
    graph = whole_graph(SIX, UNIT)
    to_go, chosen = to_go_of(graph, W)
    assert to_go == pytest.approx(-np.log(weight.sum()), abs=1e-5)
    assert np.allclose(expected_sums_of(graph, chosen), p @ values, atol=1e-5)
    off = values - p @ values
    assert np.allclose(covariance_of(graph, chosen), (off * p[:, None]).T @ off, atol=1e-5)
    rows, drawn = drawn_from(graph, chosen, np.random.default_rng(1).random((4000, 6)))
    assert np.allclose(drawn[7], SIX.feature_sum([int(a) for a in rows[7]]) * UNIT, atol=1e-5)
    top = int(np.argmax(p))
    share = np.mean([tuple(row) == tuple(orders[top]) for row in rows.tolist()])
    assert abs(share - p[top]) < 4 * np.sqrt(p[top] * (1 - p[top]) / 4000)


def test_cheapest_of_all_720_orders():
    orders, sums = every_order(SIX)
    costs = sums * UNIT @ W
    order, cost, ties = cheapest_in(whole_graph(SIX, UNIT), W)
    assert order == tuple(orders[int(np.argmin(costs))])
    assert cost == pytest.approx(costs.min(), abs=1e-5)
    assert ties == (costs < costs.min() + 1e-5).sum()


def test_a_part_wide_enough_is_the_whole():
    part, whole = part_graph(SIX, UNIT, W, ((0, 1, 2, 3, 4, 5),), 20), whole_graph(SIX, UNIT)
    assert len(part.sets) == len(whole.sets) == 64
    assert to_go_of(part, W)[0] == pytest.approx(to_go_of(whole, W)[0])
    assert not part.whole


def test_a_part_holds_its_orders_and_nearly_all_of_the_probability():
    """12 regions: 4096 sets, of which a tenth hold 95 % of all orders' probability; never more than all; exact by the other program."""
    problem = problem_for(grid_graph(3, 4, 2), ())
    unit = np.full(len(problem.columns), 1.0)
    w = np.random.default_rng(1).exponential(size=len(unit)) * 3
    order = tuple(int(a) for a in np.random.default_rng(2).permutation(12))
    exact, chosen = soft_to_go(np.ascontiguousarray(problem.tensor() * unit), w, 12)
    part = part_graph(problem, unit, w, (order,), 40)
    found, own = to_go_of(part, w)
    assert len(part.sets) < 700
    assert exact[0] <= found < exact[0] + 0.3
    kept = set(part.sets.tolist())
    assert all(sum(1 << a for a in order[:k]) in kept for k in range(13))
    whole = expected_sums(np.ascontiguousarray(problem.tensor() * unit), chosen, 12)
    assert np.abs(expected_sums_of(part, own) - whole).max() < 0.1 * np.abs(whole).max()


def test_forty_regions_in_part():
    problem = problem_for(grid_graph(5, 8, 2), ())
    unit, order = np.ones(len(problem.columns)), tuple(range(40))
    part = part_graph(problem, unit, np.ones(len(unit)), (order,), 30)
    to_go, chosen = to_go_of(part, np.ones(len(unit)))
    rows, sums = drawn_from(part, chosen, np.random.default_rng(1).random((3, 40)))
    assert np.isfinite(to_go)
    assert (np.sort(rows, axis=1) == np.arange(40)).all()
    assert sums[0] == pytest.approx(problem.feature_sum([int(a) for a in rows[0]]), rel=1e-5)
