"""Cost classes and Omega against every order."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.geometry.tool import GraphSource
from app.sequencing.classes import best_classes, class_size, equivalent_sequences, omega_size, optimal_sequences
from app.sequencing.constraints import Constraints, check_order, resolve
from app.sequencing.features import FEATURE_SETS
from app.sequencing.last import regripping
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
    assert (found.count, found.counted) == (len(found.sequences), True)


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


@pytest.mark.parametrize("seed", [None, 3])
def test_omega_of_eight_regions_equals_brute_force(seed: int | None):
    problem = problem_for(grid_graph(2, 4, seed))
    sequence = shortest_sequence(problem, np.ones(13)).sequence
    assert sorted(equivalent_sequences(problem, sequence).sequences) == same_sum(problem, sequence)


def all_alike(regions: int) -> SequencingProblem:
    """One column that only looks at the first region, so that orders with the same start have the same sum."""
    layout = FEATURE_SETS["layout"]
    return SequencingProblem(grid_graph(1, regions, 1), replace(layout, columns=layout.columns[8:9], factors={}), ())


def test_above_the_cap_omega_is_counted_and_the_sample_has_every_start_and_end():
    problem, order = all_alike(7), tuple(range(7))
    start = problem.tensor()[0, :, 0]
    expected = math.factorial(6) * int((np.abs(start - start[0]) < 1e-9).sum())
    found = equivalent_sequences(problem, order, cap=60)
    assert (found.count, found.counted, found.complete) == (expected, True, False)
    assert len(set(found.sequences)) == 60
    assert found.sequences[0] == order
    assert {(s[0], s[-1]) for s in found.sequences} == {(a, b) for a in range(7) for b in range(7) if a != b and start[a] == start[0]}
    assert found.every_end
    assert not equivalent_sequences(problem, order, cap=3).every_end
    assert omega_size(problem, order) == (expected, True)


def test_what_was_dropped_is_told_and_the_given_sequence_kept(monkeypatch: pytest.MonkeyPatch):
    problem, order = all_alike(7), (0, 4, 2, 6, 1, 3, 5)
    monkeypatch.setattr("app.sequencing.omega.WIDEST", 5)
    found = equivalent_sequences(problem, order)
    assert not found.counted
    assert not found.complete
    assert 1 < found.count < math.factorial(6)
    assert found.sequences[0] == order


@given(st.integers(0, 10_000), st.booleans())
@settings(max_examples=8, deadline=None)
def test_omega_with_wishes_and_grips_equals_brute_force(seed: int, grips: bool):
    base, rng = grid_graph(2, 3, None), np.random.default_rng(seed)
    last = (regripping(rng.integers(0, 2, 6)),) if grips else ()
    problem = SequencingProblem(base, FEATURE_SETS["clean"], (), last)
    order = tuple(int(a) for a in rng.permutation(6))
    pair = tuple(int(a) for a in rng.choice(6, 2, replace=False))
    wish = Constraints(before=((order[0], order[3]),), never_next=(pair,) if pair not in itertools.pairwise(order) else (), done=order[:1])
    total = problem.feature_sum(order)
    same = [o for o in itertools.permutations(range(6)) if np.allclose(problem.feature_sum(o), total, rtol=0, atol=1e-9)]
    allowed = [o for o in same if o[0] == order[0] and not check_order(o, resolve(wish, 6))]
    assert sorted(equivalent_sequences(problem, order, constraints=wish).sequences) == sorted(allowed)


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
    problem, w = problem_for(grid_graph(3, 8, 1)), np.random.default_rng(1).normal(size=13)
    classes = best_classes(problem, w, 5)
    assert [c.cost for c in classes] == sorted(c.cost for c in classes)
    assert classes[0].cost <= shortest_sequence(problem, w).cost
    assert not equivalent_sequences(problem, classes[0].sequence).complete
