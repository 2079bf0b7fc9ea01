"""Table, block kernel and every order agree, with made-up features and constraints too."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.errors import ContradictoryConstraints
from app.geometry.tool import GraphSource, RegionGraph
from app.sequencing import kernels
from app.sequencing.classes import best_classes, diverse, optimal_sequences
from app.sequencing.comparison import kendall_tau
from app.sequencing.constraints import Constraints, check_order, resolve
from app.sequencing.exact import costs_to_go, form_for, model_for
from app.sequencing.features import FEATURE_SETS, Feature, Interaction
from app.sequencing.gaps import box_gaps, box_table
from app.sequencing.last import regripping, reorientation, travel
from app.sequencing.problem import SequencingProblem, all_sets, problem_for
from app.sequencing.shortest import Ends, best_completion, shortest_sequence
from app.sequencing.structure import Gap
from tests.sequencing.graphs import every_order, grid_graph

seeds = st.integers(0, 10_000)
sources = st.sampled_from(["mesh", "real", "synthetic"])
SETS = {"mesh": "clean", "real": "authors-real", "synthetic": "authors-synthetic"}
PAIRS = (Interaction("curvature", "orientation"), Interaction("gaps_left", "jump"), Interaction("height", "borders_finished"))


def own_feature(graph: RegionGraph, done: np.ndarray) -> np.ndarray:
    """Something no declaration says: whether the number of finished regions is even, times the height."""
    return (done.sum(axis=1) % 2)[:, None] * graph.height[None, :]


def made_up(shape: tuple[int, int], seed: int, source: GraphSource, kind: int) -> SequencingProblem:
    """One of the shipped sets, with other interactions, with a plug-in, the layout set, or with one interaction."""
    graph = grid_graph(*shape, seed, source)
    base = FEATURE_SETS[SETS[source]]
    column, place = Feature("even", "Even", "phi_own"), {"even": (len(base.columns),)}
    extended = replace(
        base, name=f"{base.name}+even", columns=(*base.columns, column), factors=base.factors | place, plugins=(own_feature,)
    )
    return (
        problem_for(graph),
        SequencingProblem(graph, base, PAIRS),
        SequencingProblem(graph, extended, (*PAIRS, Interaction("even", "curvature"))),
        SequencingProblem(graph, FEATURE_SETS["layout"], ()),
        SequencingProblem(graph, base, PAIRS[:1]),
    )[kind]


@given(st.sampled_from([(2, 4), (1, 7)]), seeds, sources, st.integers(0, 4))
@settings(max_examples=20, deadline=None)
def test_block_kernel_equals_the_table(shape: tuple[int, int], seed: int, source: GraphSource, kind: int):
    problem = made_up(shape, seed, source, kind)
    w = np.random.default_rng(seed).normal(size=len(problem.columns))
    table = kernels.lowest_to_go(problem.cost_table(w), problem.n)
    model = model_for(problem, resolve(None, problem.n))
    v = costs_to_go(model, form_for(model, w), threads=False)
    scale = np.abs(table).max()
    assert np.abs(v - table)[1:].max() < 1e-5 * max(scale, 1.0)
    assert shortest_sequence(problem, w).cost == pytest.approx(table[0], rel=1e-9, abs=1e-9 * scale)


def test_two_threads_give_the_same():
    problem = problem_for(grid_graph(4, 4, 1))
    model, w = model_for(problem, resolve(None, 16)), np.random.default_rng(1).normal(size=13)
    one, two = (costs_to_go(model, form_for(model, w), threads=t) for t in (False, True))
    assert np.array_equal(one[1:], two[1:])


@given(seeds, st.booleans())
@settings(max_examples=20, deadline=None)
def test_table_of_boxes_equals_the_sets_one_by_one(seed: int, plain: bool):
    rng = np.random.default_rng(seed)
    low = rng.integers(0, 4, (8, 2)).astype(float)
    high = low + rng.integers(0, 3, (8, 2))
    area, always = rng.random(8), np.array([0, 0, 0, 0, 0, 0, 1, 0], np.bool_)
    free = np.array([0, 2, 3, 5, 7])
    out = np.empty(32, np.float32)
    box_table(low, high, area, plain, always, free, out)
    sets = np.repeat(always[None, :], 32, axis=0)
    sets[:, free] = all_sets(5)
    assert np.abs(out - box_gaps(sets, low, high, area, plain)).max() < 1e-6


wishes = st.fixed_dictionaries(
    {
        "before": st.lists(st.tuples(st.integers(0, 6), st.integers(0, 6)), max_size=3).map(tuple),
        "first": st.one_of(st.none(), st.integers(0, 6)),
        "last": st.one_of(st.none(), st.integers(0, 6)),
        "never_next": st.lists(st.tuples(st.integers(0, 6), st.integers(0, 6)), max_size=6).map(tuple),
        "skip": st.lists(st.integers(0, 6), max_size=2, unique=True).map(tuple),
        "done": st.lists(st.integers(0, 6), max_size=2, unique=True).map(tuple),
    }
)


def allowed_orders(wish: Constraints, n: int) -> list[tuple[int, ...]]:
    """By the words of the wishes alone."""
    kept = [a for a in range(n) if a not in wish.skip]
    found = []
    for order in itertools.permutations(kept):
        place = {a: i for i, a in enumerate(order)}
        fits = order[: len(wish.done)] == wish.done
        fits &= all(place[a] < place[b] for a, b in wish.before if a in place and b in place)
        fits &= wish.first is None or order[0] == wish.first
        fits &= wish.last is None or order[-1] == wish.last
        fits &= not any((a, b) in wish.never_next for a, b in itertools.pairwise(order))
        if fits:
            found.append(order)
    return found


@given(wishes, seeds, sources, st.booleans())
@settings(max_examples=40, deadline=None)
def test_constraints_equal_brute_force(wish: dict, seed: int, source: GraphSource, signed: bool):
    problem, constraints = problem_for(grid_graph(1, 7, seed, source)), Constraints(**wish)
    w = np.random.default_rng(seed).normal(size=len(problem.columns))
    w = w if signed else np.abs(w)
    try:
        found = shortest_sequence(problem, w, constraints=constraints)
    except ContradictoryConstraints:
        skipped_end = {constraints.first, constraints.last} & {*constraints.skip}
        both = {*constraints.skip} & {*constraints.done}
        assert skipped_end or both or not allowed_orders(constraints, 7) or any(a == b for a, b in constraints.before)
        return
    costs = {order: problem.cost_of(w, order) for order in allowed_orders(constraints, 7)}
    lowest = min(costs.values())
    assert found.cost == pytest.approx(lowest, rel=1e-9, abs=1e-9)
    assert found.sequence in costs
    assert not check_order(found.sequence, resolve(constraints, 7))
    scale = max(1.0, abs(lowest))
    classes = best_classes(problem, w, 3, constraints=constraints)
    assert [c.cost for c in classes] == sorted(c.cost for c in classes)
    assert classes[0].count == sum(c < lowest + 1e-7 * scale for c in costs.values()) or found.ties == classes[0].count
    assert set(optimal_sequences(problem, w, constraints=constraints).sequences) <= set(costs)


@given(seeds, st.booleans())
@settings(max_examples=10, deadline=None)
def test_costs_of_the_region_before_equal_brute_force(seed: int, many: bool):
    rng, n = np.random.default_rng(seed), 7 if many else 5
    normals = rng.normal(size=(n, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    last = (travel(rng.random((n, 3)), np.zeros(3)), reorientation(normals), regripping(rng.integers(0, 2, n)))
    base = problem_for(grid_graph(1, n, seed))
    problem = SequencingProblem(base.graph, base.features, base.interactions, last)
    w = np.concatenate([rng.normal(size=13), rng.random(3) * 3])
    costs = {order: problem.cost(w, order) for order in itertools.permutations(range(n))}
    found = shortest_sequence(problem, w)
    assert found.cost == pytest.approx(min(costs.values()), rel=1e-9, abs=1e-9)
    classes = best_classes(problem, w, 4)
    distinct = sorted(costs.values())
    assert classes[1].cost == pytest.approx(next(c for c in distinct if c > distinct[0] + 1e-6), abs=1e-8)


def test_way_between_regions_by_hand():
    problem = SequencingProblem(
        grid_graph(1, 3, 0), FEATURE_SETS["clean"], (), (travel(np.array([[0.0, 0, 0], [3, 4, 0], [3, 0, 0]]), np.array([0.0, 0, 1])),)
    )
    assert problem.step_features((0, 1, 2))[:, -1].tolist() == [1, 5, 4]


def test_neighbours_that_leave_no_order_are_named_and_only_those():
    """A must never meet B or C, and there are only three: B and C are both needed for A to have no neighbour."""
    problem, w = problem_for(grid_graph(1, 3, 0)), np.ones(13)
    never = ((0, 1), (1, 0), (0, 2), (2, 0), (1, 1))
    with pytest.raises(
        ContradictoryConstraints, match="B never directly after A, C never directly after A, A never directly after B and A never"
    ):
        shortest_sequence(problem, w, constraints=Constraints(never_next=never))


@given(seeds, sources, st.integers(0, 5))
@settings(max_examples=15, deadline=None)
def test_best_completion_is_the_best_of_all_with_that_start(seed: int, source: GraphSource, begun: int):
    problem = problem_for(grid_graph(1, 6, seed, source))
    w, order = np.random.default_rng(seed).normal(size=len(problem.columns)), tuple(np.random.default_rng(seed).permutation(6).tolist())
    orders, sums = every_order(problem)
    following = min(c for o, c in zip(orders, sums @ w, strict=True) if o[:begun] == order[:begun])
    found = best_completion(problem, w, order[:begun])
    assert found.sequence[:begun] == order[:begun]
    assert found.cost == pytest.approx(following, rel=1e-9, abs=1e-9)
    assert found.spent == pytest.approx(problem.steps_of(order[:begun]).sum(axis=0) @ w, abs=1e-9)


def test_classes_above_the_table_equal_brute_force():
    """Eight regions go through the kernel and the graph of nearly cheapest sequences."""
    problem = problem_for(grid_graph(2, 4, 5))
    w = np.random.default_rng(5).normal(size=13)
    _, sums = every_order(problem)
    cost = np.sort(sums @ w)
    distinct = cost[np.concatenate([[True], np.diff(cost) > 1e-7])]
    found = best_classes(problem, w, 30)
    assert [c.cost for c in found] == pytest.approx(distinct[:30].tolist(), abs=1e-8)
    assert [c.count for c in found] == [int(((cost > d - 1e-8) & (cost < d + 1e-7)).sum()) for d in distinct[:30]]


@pytest.mark.parametrize("seed", [None, 2])
def test_ends_settle_ties_like_a_function(seed: int | None):
    problem, w = problem_for(grid_graph(2, 4, seed)), np.ones(13)
    rng = np.random.default_rng(0)
    start, end = rng.random(8), rng.random(8)
    by_function = shortest_sequence(problem, w, lambda s: start[s[0]] + end[s[-1]])
    assert shortest_sequence(problem, w, Ends(start, end)).sequence == by_function.sequence


def test_counts_beyond_64_bits_are_exact():
    """Nothing but the first region matters: 21! orders in a graph where every set is a node would be too many, so a chain of
    precedence pairs keeps the graph small and the count known."""
    problem = problem_for(grid_graph(3, 4, 1))
    chain = tuple((a, a + 1) for a in range(0, 5))
    found = shortest_sequence(problem, np.zeros(13), constraints=Constraints(before=chain))
    assert found.ties == 479_001_600 // 720


def test_diverse_members_are_farther_apart_than_the_first_ones():
    orders = [tuple(o) for o in itertools.permutations(range(5))]
    chosen = diverse(orders, 4)
    closest = max(kendall_tau(a, b) for a, b in itertools.combinations(chosen, 2))
    assert closest < max(kendall_tau(a, b) for a, b in itertools.combinations(orders[:4], 2))
    assert kendall_tau(*chosen[:2]) == -1


def test_a_hull_is_never_larger_than_the_box():
    graph = grid_graph(2, 3, 1)
    sets = all_sets(6)
    area = np.ones(6)
    hull, box = (Gap(graph.low, graph.high, area, "done", shape).of_sets(sets) for shape in ("hull", "plain"))
    assert (hull <= box + 1e-12).all()
    assert hull[0b100001] == pytest.approx(1 - 2 / 4)  # squares at (0, 0) and (2, 1): the hull of their corners has area 4
    assert box[0b100001] == pytest.approx(1 - 2 / 6)


def test_replaced_problems_forget_their_tables():
    problem = problem_for(grid_graph(2, 4, 1))
    shortest_sequence(problem, np.ones(13))
    other = replace(problem, interactions=())
    assert "model" not in other.kept
