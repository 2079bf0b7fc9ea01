"""Made-up features of every declared structure: the block kernel, the table and every order agree."""

from dataclasses import dataclass
from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.errors import ContradictoryConstraints
from app.geometry.tool import RegionGraph
from app.sequencing import features, kernels
from app.sequencing.classes import best_classes, optimal_sequences
from app.sequencing.constraints import Constraints, check_order, resolve
from app.sequencing.exact import costs_to_go, form_for, model_for
from app.sequencing.features import Feature, FeatureSet, Interaction
from app.sequencing.last import LastFeature
from app.sequencing.problem import SequencingProblem
from app.sequencing.shortest import Ends, best_completion, shortest_sequence, solve
from app.sequencing.structure import Between, Declaration, FirstTouch, Gap, MeanStep, Pairwise, Rank, Undeclared
from tests.sequencing.graphs import every_order, grid_graph


@dataclass(frozen=True)
class Draw:
    """Random numbers; in quarters, so that many sequences cost the same, or any."""

    rng: np.random.Generator
    coarse: bool

    def array(self, *shape: int) -> np.ndarray:
        values = self.rng.uniform(-1, 1, shape)
        return np.round(4 * values) / 4 if self.coarse else values

    def pairs(self, n: int) -> np.ndarray:
        return self.rng.random((n, n)) < 0.3


def odd_plugin(graph: RegionGraph, done: np.ndarray) -> np.ndarray:
    """No declaration says this."""
    return (done.sum(axis=1) % 3)[:, None] * graph.height[None, :]


def declarations(d: Draw, graph: RegionGraph, chosen: list[str]) -> tuple[Declaration, ...]:
    n = graph.n
    low = d.rng.integers(0, 4, (n, 2)).astype(float)
    high, area = low + d.rng.integers(1, 3, (n, 2)), 0.5 + d.rng.random(n) / 2
    mean = d.array(n)

    def empty() -> np.ndarray | None:
        return d.array(n) if d.rng.random() < 0.4 else None

    made = {
        "pairs": lambda: Pairwise(d.array(n), d.array(n, n), empty()),
        "static": lambda: Pairwise(d.array(n), np.zeros((n, n)), empty()),
        "mean": lambda: MeanStep(mean, d.array(n), *d.array(2), d.array(n), empty()),
        "touch": lambda: FirstTouch(tuple((d.pairs(n), float(v)) for v in d.array(int(d.rng.integers(1, 4)))), 0.75, empty()),
        "box": lambda: Gap(low, high, area, "done", "within", empty()),
        "box left": lambda: Gap(low, high, area, "left", "plain", empty()),
        "hull": lambda: Gap(low, high, area, "done", "hull", empty()),
        "hull left": lambda: Gap(low, high, area, "left", "hull", empty()),
        "between": lambda: Between(d.array(n, n), empty()),
        "rank": lambda: Rank(d.array(n, n), empty()),
        "undeclared": lambda: Undeclared(odd_plugin, graph),
    }
    return tuple(made[name]() for name in chosen)


KINDS = ("pairs", "static", "mean", "touch", "box", "box left", "hull", "hull left", "between", "rank", "undeclared")
tools = st.fixed_dictionaries(
    {
        "n": st.sampled_from([5, 7, 7, 8]),
        "seed": st.integers(0, 10_000),
        "coarse": st.booleans(),
        "chosen": st.lists(st.sampled_from(KINDS), min_size=1, max_size=6),
        "products": st.integers(0, 2),
        "by_last": st.booleans(),
        "wishes": st.booleans(),
    }
)


def brute_force(problem: SequencingProblem, w: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """All orders (M, N) and what they cost."""
    plain = SequencingProblem(problem.graph, problem.features, problem.interactions)
    orders, sums = every_order(plain)
    order, cost = np.array(orders), sums @ w[: problem.width]
    for weight, f in zip(w[problem.width :], problem.last, strict=True):
        cost = cost + weight * (f.start[order[:, 0]] + f.between[order[:, :-1], order[:, 1:]].sum(axis=1))
    return order, cost


@given(tools)
@settings(max_examples=25, deadline=None)
def test_every_structure_equals_brute_force(tool: dict):
    n, d = tool["n"], Draw(np.random.default_rng(tool["seed"]), tool["coarse"])
    graph = grid_graph(1, n, tool["seed"])
    declared = declarations(d, graph, tool["chosen"])
    keys = [f"f{i}" for i in range(len(declared))]
    columns = tuple(Feature(k, k, k) for k in keys)
    made_up = FeatureSet("made-up", 1, columns, {k: (i,) for i, k in enumerate(keys)})
    interactions = tuple(Interaction(*d.rng.choice(keys, 2)) for _ in range(tool["products"]))
    last = (LastFeature(Feature("l", "l", "l"), d.array(n, n), d.array(n)),) if tool["by_last"] else ()
    first, second, third = (int(a) for a in d.rng.choice(n, 3, replace=False))
    wish = Constraints(before=((first, second),), never_next=((second, third),) if d.coarse else ()) if tool["wishes"] else None
    with patch.dict(features.FEATURE_SETS, {"made-up": made_up}), patch.dict(features._DEFINITIONS, {"made-up": lambda _: declared}):
        problem = SequencingProblem(graph, made_up, interactions, last)
        w = d.array(len(problem.columns))
        order, cost = brute_force(problem, w)
        agree_with_every_order(problem, w, wish, order, cost)
        if not last and n >= 7:
            agree_with_the_table(problem, w)
        agree_along_a_prefix(problem, w, order, cost, d.rng)


def agree_with_every_order(problem: SequencingProblem, w: np.ndarray, wish: Constraints | None, order: np.ndarray, cost: np.ndarray):
    resolved = resolve(wish, problem.n)
    if wish:
        place = np.argsort(order, axis=1)
        fits = np.ones(len(order), np.bool_)
        for a, b in wish.before:
            fits &= place[:, a] < place[:, b]
        for a, b in wish.never_next:
            fits &= place[:, b] != place[:, a] + 1
        order, cost = order[fits], cost[fits]
    solution = solve(problem, w, resolved)
    ranked = np.sort(cost)
    opens = np.flatnonzero(np.concatenate([[True], np.diff(ranked) > solution.tolerance]))
    counts = np.diff([*opens, len(ranked)])
    found = shortest_sequence(problem, w, constraints=wish)
    assert found.cost == pytest.approx(ranked[0], rel=1e-9, abs=1e-9)
    assert found.ties == counts[0]
    assert not check_order(found.sequence, resolved)
    tied = order[cost <= ranked[0] + solution.tolerance]
    assert found.sequence == min(map(tuple, tied.tolist()))
    assert sorted(optimal_sequences(problem, w, 50_000, wish).sequences) == sorted(map(tuple, tied.tolist()))
    start, end = np.arange(problem.n)[::-1] / 8.0, np.arange(problem.n) % 3 / 4.0
    ends = shortest_sequence(problem, w, Ends(start, end), wish).sequence
    assert start[ends[0]] + end[ends[-1]] == (start[tied[:, 0]] + end[tied[:, -1]]).min()
    classes = best_classes(problem, w, 4, constraints=wish)
    assert [c.cost for c in classes] == sorted(c.cost for c in classes)
    assert [c.cost for c in classes] == pytest.approx(ranked[opens[: len(classes)]].tolist(), rel=1e-6, abs=1e-6)
    assert [c.count for c in classes] == counts[: len(classes)].tolist()
    assert len(classes) == min(4, len(opens))


def agree_with_the_table(problem: SequencingProblem, w: np.ndarray):
    table = kernels.lowest_to_go(problem.cost_table(w), problem.n)
    model = model_for(problem, resolve(None, problem.n))
    for threads in (False, True):
        v = costs_to_go(model, form_for(model, w), threads=threads)
        assert np.abs(v - table)[1:].max() < 1e-5 * max(np.abs(table).max(), 1.0)


def agree_along_a_prefix(problem: SequencingProblem, w: np.ndarray, order: np.ndarray, cost: np.ndarray, rng: np.random.Generator):
    """What a start leaves at best falls short by nothing along the best continuation."""
    begun = order[rng.integers(len(order))][: rng.integers(0, problem.n)]
    found = best_completion(problem, w, tuple(begun.tolist()))
    same_start = (order[:, : len(begun)] == begun).all(axis=1)
    assert found.cost == pytest.approx(cost[same_start].min(), rel=1e-9, abs=1e-9)
    longer = best_completion(problem, w, found.sequence[: len(begun) + 1])
    assert longer.cost == pytest.approx(found.cost, rel=1e-9, abs=1e-9)


def test_forbidden_neighbours_that_leave_nothing_are_refused_with_made_up_features_too():
    problem = SequencingProblem(grid_graph(1, 3, 0), features.FEATURE_SETS["layout"], ())
    never = tuple((a, b) for a in range(3) for b in range(3) if a != b)
    with pytest.raises(ContradictoryConstraints):
        shortest_sequence(problem, np.ones(10), constraints=Constraints(never_next=never))


def test_ties_beyond_what_is_counted_are_a_lower_bound(monkeypatch: pytest.MonkeyPatch):
    """With zero weights all 9! orders tie; a graph of few nodes counts fewer, and says so."""
    problem = SequencingProblem(grid_graph(3, 3, 1), features.FEATURE_SETS["clean"], ())
    monkeypatch.setattr("app.sequencing.shortest.MOST_NODES", 500)
    found = shortest_sequence(problem, np.zeros(11))
    assert found.sequence == tuple(range(9))
    assert not found.counted
    assert 1 < found.ties < 362_880
    assert f"At least {found.ties:,} orders tie" in found.method
