"""The exact search against every order, and the search for large tools against the exact one."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.geometry.tool import GraphSource
from app.sequencing import answer, block, gaps, kernels, nearly, warming
from app.sequencing.classes import equivalent_sequences
from app.sequencing.comparison import kendall_tau
from app.sequencing.large import best_found
from app.sequencing.problem import problem_for
from app.sequencing.shortest import TIE_CAP, Ends, cost_to_go, shortest_sequence
from tests.sequencing.graphs import every_order, grid_graph

shapes = st.sampled_from([(1, 1), (1, 3), (2, 2), (1, 5), (2, 3), (1, 7)])
sources = st.sampled_from(["mesh", "real", "synthetic"])


@given(shapes, st.integers(0, 10_000), sources, st.booleans())
@settings(max_examples=30, deadline=None)
def test_cheapest_of_every_order(shape: tuple[int, int], seed: int, source: GraphSource, signed: bool):
    problem = problem_for(grid_graph(*shape, seed, source))
    w = np.random.default_rng(seed).normal(size=len(problem.columns))
    w = w if signed else np.abs(w)
    orders, sums = every_order(problem)
    cost = sums @ w
    found = shortest_sequence(problem, w)
    assert found.proved
    assert found.cost == pytest.approx(cost.min(), rel=1e-9, abs=1e-9)
    assert found.cost == problem.cost(w, found.sequence)
    assert found.sequence in orders
    assert cost_to_go(problem, w)[0] == pytest.approx(cost.min(), rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("shape", [(2, 3), (1, 6), (1, 7)])
def test_ties_of_a_symmetric_tool_are_counted_and_the_lowest_ids_win(shape: tuple[int, int]):
    problem, w = problem_for(grid_graph(*shape, None)), np.ones(13)
    orders, sums = every_order(problem)
    cost = sums @ w
    tied = [o for o, c in zip(orders, cost, strict=True) if c < cost.min() + 1e-9]
    found = shortest_sequence(problem, w)
    assert found.ties == len(tied) > 1
    assert found.sequence == min(tied)


def test_tie_break_looks_at_the_whole_class():
    problem, w = problem_for(grid_graph(2, 3, None)), np.ones(13)
    orders, sums = every_order(problem)
    tied = [o for o, c in zip(orders, sums @ w, strict=True) if c < (sums @ w).min() + 1e-9]
    worst = max(tied)
    assert shortest_sequence(problem, w, lambda s: float(s != worst)).sequence == worst
    assert shortest_sequence(problem, w, lambda s: 0.0).sequence == min(tied)


def test_tie_break_on_the_ends_is_exact_in_a_huge_class():
    """With all weights zero every one of 9! orders ties; the penalty wants to start at 7 and end at 2."""
    problem = problem_for(grid_graph(3, 3, 1))
    found = shortest_sequence(problem, np.zeros(13), Ends(1.0 - np.eye(9)[7], 1.0 - np.eye(9)[2]))
    assert found.ties == 362_880 > TIE_CAP
    assert found.sequence == (7, 0, 1, 3, 4, 5, 6, 8, 2)
    called = shortest_sequence(problem, np.zeros(13), lambda s: float(s[0] != 7))
    assert "among 2,000 of 362,880 equal sequences" in called.method


def test_twenty_regions_are_proved_and_better_than_any_descent():
    problem, w = problem_for(grid_graph(4, 5, 3)), np.random.default_rng(0).normal(size=13)
    exact = shortest_sequence(problem, w)
    assert exact.proved
    assert "1,048,576" in exact.method
    assert exact.cost <= problem.cost(w, best_found(problem, w)) + 1e-9


def test_large_tools_are_not_called_proved():
    problem, rng = problem_for(grid_graph(4, 7, 3)), np.random.default_rng(0)
    w = rng.normal(size=13)
    found = shortest_sequence(problem, w)
    assert not found.proved
    assert "Not proved optimal: 28 regions are more than the 26" in found.method
    assert found.cost == pytest.approx(problem.cost(w, found.sequence))
    assert found.cost < min(problem.cost(w, rng.permutation(28)) for _ in range(200))
    assert found == shortest_sequence(problem, w)


def test_kendall_tau():
    assert kendall_tau((0, 1, 2, 3), (0, 1, 2, 3)) == 1
    assert kendall_tau((0, 1, 2, 3), (3, 2, 1, 0)) == -1
    assert kendall_tau((2, 0, 1), (0, 2, 1)) == pytest.approx(1 / 3)
    assert kendall_tau((0,), (0,)) == 1


def test_warm_up_compiles_what_a_search_uses():
    used: tuple[Any, ...] = (
        answer.answer, answer.weighed, answer.laid_out, block.fill, nearly.ways_to_end, nearly.lowest_to_end, gaps.box_table,
        kernels.sums_along,
    )  # fmt: skip
    warming.warm_up()
    before = {k: len(k.signatures) for k in used}
    assert all(before.values())
    problem = problem_for(grid_graph(2, 4, 1))
    problem.tensor()
    best = shortest_sequence(problem, np.ones(13), Ends(np.zeros(8), np.zeros(8)))
    equivalent_sequences(problem, best.sequence)
    assert {k: len(k.signatures) for k in before} == before
