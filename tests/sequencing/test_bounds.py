"""The bound against the exact optimum, whatever the features, weights and constraints."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.geometry.tool import GraphSource
from app.sequencing.bounds import Prices, evaluate, lower_bound, no_prices
from app.sequencing.constraints import Constraints, check_order, resolve
from app.sequencing.exact import Limits
from app.sequencing.features import FEATURE_SETS, Interaction
from app.sequencing.last import travel
from app.sequencing.parts import split
from app.sequencing.problem import SequencingProblem, problem_for
from app.sequencing.shortest import shortest_sequence
from tests.sequencing.graphs import every_order, grid_graph

sources = st.sampled_from(["mesh", "real", "synthetic"])
shapes = st.sampled_from([(1, 1), (1, 2), (1, 3), (2, 2), (1, 5), (2, 3), (2, 4)])
factors = st.sampled_from(["height", "curvature", "orientation", "jump", "gaps_inside", "borders_unfinished"])


def weights(problem: SequencingProblem, seed: int, signed: bool) -> np.ndarray:
    w = np.random.default_rng(seed).normal(size=len(problem.columns))
    return w if signed else np.abs(w)


@given(shapes, st.integers(0, 10_000), sources, st.booleans(), factors, factors, st.booleans())
@settings(max_examples=25, deadline=None)
def test_never_above_the_optimum(shape: tuple[int, int], seed: int, source: GraphSource, signed: bool, one: str, two: str, layout: bool):
    graph = grid_graph(*shape, seed, source)
    features = FEATURE_SETS["layout"] if layout else problem_for(graph).features
    problem = SequencingProblem(graph, features, () if layout else (Interaction(one, two), Interaction("height", "curvature")))
    w = weights(problem, seed, signed)
    best = float((every_order(problem)[1] @ w).min())
    bound = lower_bound(problem, w, best + 1.0 + abs(best), steps=25)  # aims above the optimum, to be tempted past it
    assert bound <= best + 1e-9 * max(1.0, abs(best))


@given(shapes, st.integers(0, 10_000), sources, st.booleans())
@settings(max_examples=25, deadline=None)
def test_any_prices_give_a_bound(shape: tuple[int, int], seed: int, source: GraphSource, signed: bool):
    problem, rng = problem_for(grid_graph(*shape, seed, source)), np.random.default_rng(seed)
    w = weights(problem, seed, signed)
    parts = split(problem, w, resolve(None, problem.n))
    prices = Prices(*(rng.normal(size=x.shape) for x in no_prices(parts).arrays()))
    best = float((every_order(problem)[1] @ w).min())
    for cells in (1, 20, 400):
        assert evaluate(parts, parts.steps.walk(parts.pairs, cells), prices).bound <= best + 1e-9


@given(st.integers(0, 10_000), sources)
@settings(max_examples=15, deadline=None)
def test_below_what_constraints_leave(seed: int, source: GraphSource):
    rng = np.random.default_rng(seed)
    a, b, c, d, e, f = rng.permutation(7)[:6].tolist()
    problem = problem_for(grid_graph(1, 7, seed, source))
    w, resolved = weights(problem, seed, True), resolve(Constraints(before=((a, b),), last=c, skip=(d,), done=(e, f)), 7)
    free = [x for x in range(7) if x not in (d, e, f)]
    orders = [rest for rest in itertools.permutations(free) if not check_order((e, f, *rest), resolved)]
    best = min(problem.cost_of(w, (e, f, *rest)) for rest in orders)
    assert lower_bound(problem, w, best + 1.0, resolved, steps=25) <= best + 1e-9


@given(st.integers(0, 10_000), sources)
@settings(max_examples=6, deadline=None)
def test_what_is_said_of_an_order_that_is_not_proved_is_true(seed: int, source: GraphSource):
    """As on a large tool: the optimum under all kinds of wishes lies between the bound and the cost of the order found."""
    rng, graph = np.random.default_rng(seed), grid_graph(1, 7, seed, source)
    a, b, c, d, e, f, g = rng.permutation(7).tolist()
    problem = SequencingProblem(graph, problem_for(graph).features, (), (travel(rng.normal(size=(7, 3))),))
    wishes = Constraints(before=((a, b),), never_next=((b, c), (e, c)), skip=(f,), done=(g, e))
    w, resolved = weights(problem, seed, bool(seed % 2)), resolve(wishes, 7)
    found = shortest_sequence(problem, w, constraints=wishes, limits=Limits(regions=0))
    bound = lower_bound(problem, w, found.cost, resolved, steps=60)
    orders = [(g, e, *rest) for rest in itertools.permutations((a, b, c, d)) if not check_order((g, e, *rest), resolved)]
    best = min(problem.cost_of(w, order) for order in orders)
    assert not found.proved
    assert bound - 1e-9 <= best <= found.cost + 1e-9


@pytest.mark.parametrize(("source", "most"), [("mesh", 0.12), ("synthetic", 0.2), ("real", 0.2)])
def test_close_enough_to_be_of_use_at_twelve_regions(source: GraphSource, most: float):
    for seed in range(2):
        problem = problem_for(grid_graph(3, 4, seed, source))
        w = np.ones(len(problem.columns))
        best = shortest_sequence(problem, w).cost
        bound = lower_bound(problem, w, best, steps=200)
        assert bound <= best
        assert (best - bound) / abs(best) < most


def test_more_steps_never_hurt_and_stopping_is_heard():
    problem, w = problem_for(grid_graph(3, 4, 1)), np.ones(13)
    best = shortest_sequence(problem, w).cost
    few, many = (lower_bound(problem, w, best, steps=k) for k in (10, 100))
    assert few <= many <= best
    assert lower_bound(problem, w, best, should_stop=lambda: True) == lower_bound(problem, w, best, steps=1)


@given(st.integers(0, 10_000), sources)
@settings(max_examples=5, deadline=None)
def test_below_where_costs_depend_on_the_region_before(seed: int, source: GraphSource):
    rng, graph = np.random.default_rng(seed), grid_graph(2, 3, seed, source)
    problem = SequencingProblem(graph, problem_for(graph).features, (), (travel(rng.normal(size=(6, 3))),))
    w, pairs = weights(problem, seed, True), rng.permutation(6)[:4].tolist()
    resolved = resolve(Constraints(never_next=((pairs[0], pairs[1]), (pairs[2], pairs[3]))), 6)
    orders = [order for order in itertools.permutations(range(6)) if not check_order(order, resolved)]
    best = min(problem.cost(w, order) for order in orders)
    bound = lower_bound(problem, w, best + 1.0, resolved, steps=25)
    assert bound <= best + 1e-9


def test_what_depends_on_the_region_before_raises_the_bound():
    graph = grid_graph(3, 4, 1)
    alone = problem_for(graph, ())
    problem = SequencingProblem(graph, alone.features, (), (travel(np.arange(36.0).reshape(12, 3)),))
    w = np.ones(len(problem.columns))
    assert lower_bound(problem, w, 100.0, steps=100) > lower_bound(alone, w[:-1], 100.0, steps=100) + 20
