"""Cost classes and Omega against every order."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.geometry.tool import GraphSource
from app.sequencing.classes import best_classes, class_size, equivalent_sequences, optimal_sequences
from app.sequencing.omega import equal_sums, equal_sums_searched
from app.sequencing.problem import SequencingProblem, problem_for
from app.sequencing.shortest import shortest_sequence
from tests.sequencing.graphs import every_order, grid_graph

shapes = st.sampled_from([(1, 1), (1, 3), (2, 2), (1, 5), (2, 3)])
sources = st.sampled_from(["mesh", "real", "synthetic"])
seeds = st.one_of(st.none(), st.integers(0, 10_000))


def classes_of(cost: np.ndarray, gap: float = 1e-7) -> list[tuple[float, int]]:
    """Distinct costs and how often each occurs."""
    cost = np.sort(cost)
    starts = np.flatnonzero(np.concatenate([[True], np.diff(cost) > gap]))
    return [(float(cost[i]), int(n)) for i, n in zip(starts, np.diff([*starts, len(cost)]), strict=True)]


@given(shapes, seeds, sources, st.integers(0, 1000), st.sampled_from([1, 4, 5000]))
@settings(max_examples=30, deadline=None)
def test_classes_are_complete_and_counted(shape: tuple[int, int], seed: int | None, source: GraphSource, draw: int, k: int):
    problem = problem_for(grid_graph(*shape, seed, source))
    w = np.random.default_rng(draw).integers(-3, 4, len(problem.columns)).astype(float)
    _, sums = every_order(problem)
    cost = sums @ w
    scale = max(1.0, abs(cost.min()))
    truth = classes_of(cost, 1e-7 * scale)[:k]
    found = best_classes(problem, w, k)
    assert [c.count for c in found] == [count for _, count in truth]
    assert [c.cost for c in found] == pytest.approx([value for value, _ in truth], abs=1e-8 * scale)
    for c in found:
        assert problem.cost(w, c.sequence) == c.cost


def test_classes_of_seven_regions_with_symmetry():
    problem, w = problem_for(grid_graph(1, 7, None)), np.ones(13)
    _, sums = every_order(problem)
    assert [c.count for c in best_classes(problem, w, 40)] == [count for _, count in classes_of(sums @ w)[:40]]


def test_zero_weights_make_one_class_of_all_orders():
    problem = problem_for(grid_graph(3, 4, 1))
    assert [c.count for c in best_classes(problem, np.zeros(13), 5)] == [math.factorial(12)]
    assert class_size(problem, np.zeros(13)) == math.factorial(12)


def same_sum(problem: SequencingProblem, sequence: tuple[int, ...]) -> list[tuple[int, ...]]:
    orders, sums = every_order(problem)
    return [o for o, s in zip(orders, sums, strict=True) if np.abs(s - problem.feature_sum(sequence)).max() < 1e-9]


@given(shapes, seeds, sources, st.integers(0, 1000))
@settings(max_examples=30, deadline=None)
def test_omega_equals_brute_force(shape: tuple[int, int], seed: int | None, source: GraphSource, draw: int):
    problem = problem_for(grid_graph(*shape, seed, source))
    sequence = tuple(np.random.default_rng(draw).permutation(problem.n).tolist())
    found = equivalent_sequences(problem, sequence)
    assert found.complete
    assert found.sequences[0] == sequence
    assert sorted(found.sequences) == same_sum(problem, sequence)


def test_symmetric_tools_have_more_than_one_member():
    problem = problem_for(grid_graph(2, 3, None))
    best = shortest_sequence(problem, np.ones(13)).sequence
    mirrored = tuple((2 - a % 3) + 3 * (a // 3) for a in best)
    assert mirrored in equivalent_sequences(problem, best).sequences


def test_nearly_equal_sums_are_not_equal():
    """One region is higher by 1e-6: what was mirror-symmetric is so no more, save for orders that don't notice."""
    graph = grid_graph(2, 3, None)
    problem = problem_for(replace(graph, height=graph.height + 1e-6 * (np.arange(6) == 0)))
    best = shortest_sequence(problem, np.ones(13)).sequence
    members = equivalent_sequences(problem, best).sequences
    assert sorted(members) == same_sum(problem, best)
    assert len(members) < len(equivalent_sequences(problem_for(graph), best).sequences)


def test_cap_is_told_and_keeps_the_given_sequence():
    problem = problem_for(grid_graph(2, 3, None))
    sequence = next(s for s in every_order(problem)[0][::-1] if len(same_sum(problem, s)) > 2)
    found = equivalent_sequences(problem, sequence, cap=2)
    assert not found.complete
    assert len(found.sequences) == 2
    assert found.sequences[0] == sequence
    exact = equivalent_sequences(problem, sequence, cap=len(same_sum(problem, sequence)))
    assert exact.complete


@pytest.mark.parametrize("seed", [None, 3])
def test_search_without_a_table_agrees_with_the_table(seed: int | None):
    problem = problem_for(grid_graph(2, 4, seed))
    sequence = shortest_sequence(problem, np.ones(13)).sequence
    assert equal_sums_searched(problem, sequence, 100) == equal_sums(problem, sequence, 100)


def test_optimal_sequences_are_all_and_only_the_cheapest():
    problem, w = problem_for(grid_graph(2, 3, None)), np.ones(13)
    orders, sums = every_order(problem)
    tied = [o for o, s in zip(orders, sums @ w, strict=True) if s < (sums @ w).min() + 1e-9]
    found = optimal_sequences(problem, w)
    assert found.complete
    assert list(found.sequences) == tied
    assert class_size(problem, w) == len(tied)
    capped = optimal_sequences(problem, w, cap=1)
    assert not capped.complete
    assert capped.sequences == tuple(tied[:1])


def test_scaling_weights_scales_costs_and_keeps_classes():
    problem, w = problem_for(grid_graph(2, 3, None)), np.ones(13)
    small, large = best_classes(problem, w * 1e-6, 8), best_classes(problem, w * 1e6, 8)
    assert [c.count for c in small] == [c.count for c in large]
    assert [c.cost * 1e12 for c in small] == pytest.approx([c.cost for c in large])


def test_large_tools_report_what_was_looked_at():
    problem, w = problem_for(grid_graph(3, 7, 1)), np.random.default_rng(1).normal(size=13)
    classes = best_classes(problem, w, 5)
    assert [c.cost for c in classes] == sorted(c.cost for c in classes)
    assert classes[0].cost <= shortest_sequence(problem, w).cost
    assert not equivalent_sequences(problem, classes[0].sequence).complete
