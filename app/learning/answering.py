"""What does the expert want on this one tool? A few comparisons of two orders find out, even where the weights can't say it.

The likelihood that was learned (`generalising`) says how probable every order of the tool is. Orders are drawn from it and from
its uncertainty, those with equal feature sums are one candidate, and each answer makes the candidates it speaks against
improbable. What is found may be an exception that no weights on the features express; it is then an order for this tool, and
changes no weights.

An answer says that one of the two is how the expert would do it, which ends the questions, or which of the two is closer to it,
that both are equally far from it, or nothing. Closer means: fewer pairs of regions come in another order (Kendall).
"""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from app.learning.generalising import Generalised, on_features
from app.learning.many_optima import Orders, sums_of
from app.learning.maximum_entropy import check_size, unit_of
from app.learning.qp import Array
from app.learning.soft_graph import cheapest_in, drawn_from, part_graph, to_go_of
from app.learning.soft_program import drawn, soft_to_go
from app.sequencing.constraints import resolve
from app.sequencing.features import FEATURE_SETS
from app.sequencing.omega import equal_sums
from app.sequencing.problem import TENSOR_LIMIT, SequencingProblem

DRAWS = (200, 30)  # weights from the posterior, orders from each
BOLDNESS = 1.5  # temperature: an expert makes bolder exceptions than the demonstrations' likelihood has room for
CANDIDATES = 300  # most frequent ones kept
COMPARED = 60  # of these may be shown
MEMBERS = 64  # orders looked at per candidate
SLIP = 0.02  # probability of an answer against the expert's own order
DIGITS = 6  # of a feature sum, in its unit, that tell candidates apart

Sequence = tuple[int, ...]
Reply = Literal["left_mine", "right_mine", "left", "right", "equal", "cant_tell"]
OUTCOMES: dict[str, int] = {"left": -1, "equal": 0, "right": 1, "left_mine": 2, "right_mine": 3}


@dataclass(frozen=True)
class Candidates:
    """Orders the expert may want, one class of equal feature sums each."""

    classes: tuple[tuple[Sequence, ...], ...]  # members, the one that is shown first
    probability: Array  # (C,)
    distance: Array  # (A, C) pairs of regions in another order, from candidate a to the nearest member of c
    asked: frozenset[tuple[int, int]] = frozenset()

    @property
    def best(self) -> int:
        """The most probable one."""
        return int(np.argmax(self.probability))


def candidates_for(problem: SequencingProblem, learned: Generalised, generator: np.random.Generator) -> Candidates:
    """Candidates and how probable they are before any answer.

    Args:
        problem: The tool, under any features. Above 14 regions orders are drawn from the likeliest sets only (`soft_graph`).
        learned: From the demonstrations of other tools.
        generator: For the draws.

    Raises:
        InvalidInput: The tool has too many regions.
    """
    check_size(problem.n)
    own = problem.features  # perhaps with features switched off or added
    problem = on_features(problem, own if own.name == learned.policy.features else FEATURE_SETS[learned.policy.features])
    unit = unit_of(learned.scale, learned.policy.identifiable)
    draw = _drawer(problem, unit, learned.fit.weights / BOLDNESS)
    root = np.linalg.cholesky(learned.fit.covariance)
    found: Counter[tuple[float, ...]] = Counter()
    shown: dict[tuple[float, ...], Sequence] = {}
    drawn_weights: list[tuple[Array, float]] = []
    weights, orders = DRAWS
    for _ in range(weights):
        w = (learned.fit.weights + root @ generator.normal(size=len(root))) / BOLDNESS
        start, rows, sums = draw(w, generator.random((orders, problem.n)))
        drawn_weights.append((w, start))
        for row, total in zip(rows, np.round(sums, DIGITS) + 0.0, strict=True):
            key = tuple(float(x) for x in total)
            found[key] += 1
            shown.setdefault(key, tuple(int(a) for a in row))
    totals = np.array([key for key, _ in found.most_common(CANDIDATES)])
    classes = [_members(problem, shown[tuple(total)]) for total in totals.tolist()]
    probability = np.mean([np.exp(start - totals @ w) for w, start in drawn_weights], axis=0) * [len(members) for members in classes]
    ranked = np.argsort(-probability, kind="stable")
    classes = tuple(classes[k] for k in ranked)
    return Candidates(classes, probability[ranked] / probability.sum(), _distances(classes))


def _drawer(problem: SequencingProblem, unit: Array, w: Array) -> Callable[[Array, Array], tuple[float, Orders, Array]]:
    """Of weights and uniform numbers: -log of the sum over all orders, orders drawn, and their feature sums in units."""
    if problem.n <= TENSOR_LIMIT:
        values = np.ascontiguousarray(problem.tensor() * unit)

        def from_table(w: Array, uniform: Array) -> tuple[float, Orders, Array]:
            to_go, chosen = soft_to_go(values, w, problem.n)
            rows = drawn(chosen, problem.n, uniform)
            return float(to_go[0]), rows, sums_of(problem, rows) * unit

        return from_table
    first, _, _ = cheapest_in(part_graph(problem, unit, w, ()), w)
    graph = part_graph(problem, unit, w, (first,))

    def from_part(w: Array, uniform: Array) -> tuple[float, Orders, Array]:
        start, chosen = to_go_of(graph, w)
        return start, *drawn_from(graph, chosen, uniform)

    return from_part


def next_pair(candidates: Candidates) -> tuple[int, int] | None:
    """The two candidates whose comparison is expected to tell most; None when no pair tells anything."""
    d, p = candidates.distance, candidates.probability
    best, pair = 1e-9, None
    for a in range(len(d) - 1):
        others = np.arange(a + 1, len(d))
        expected = _expected(d, a, others)
        shares = np.stack([(expected == outcome) @ p for outcome in OUTCOMES.values()])
        worth = -(shares * np.log(np.maximum(shares, 1e-300))).sum(axis=0)
        for k in np.argsort(-worth, kind="stable"):
            if (a, int(others[k])) not in candidates.asked:
                if worth[k] > best:
                    best, pair = float(worth[k]), (a, int(others[k]))
                break
    return pair


def after_answer(candidates: Candidates, pair: tuple[int, int], reply: Reply) -> Candidates:
    """The candidates once the expert has compared the pair.

    "left_mine" and "right_mine" are taken at their word; of the others one in `SLIP` may be a mistake.
    """
    asked = candidates.asked | {(min(pair), max(pair))}
    if reply == "cant_tell":
        return replace(candidates, asked=asked)
    expected = _expected(candidates.distance, pair[0], np.array(pair[1:]))[0]
    mistaken = 0.0 if reply in ("left_mine", "right_mine") else SLIP
    weight = candidates.probability * np.where(expected == OUTCOMES[reply], 1 - mistaken, mistaken)
    return replace(candidates, probability=weight / weight.sum(), asked=asked)


def reply_of(left: Sequence, right: Sequence, wanted: tuple[Sequence, ...]) -> Reply:
    """How an expert answers to whom any of the wanted orders is as good as another."""
    if left in wanted or right in wanted:
        return "left_mine" if left in wanted else "right_mine"
    first, second = (float(_apart(np.array([s]), np.array(wanted)).min()) for s in (left, right))
    return "equal" if first == second else ("left" if first < second else "right")


def _expected(distance: Array, a: int, others: NDArray[np.int64]) -> NDArray[np.int64]:
    """(others, C) what an expert who wants candidate c says to a against each of the others, as in `OUTCOMES`."""
    outcome = np.sign(distance[a] - distance[others]).astype(np.int64)
    outcome[:, a] = OUTCOMES["left_mine"]
    outcome[np.arange(len(others)), others] = OUTCOMES["right_mine"]
    return outcome


def _members(problem: SequencingProblem, order: Sequence) -> tuple[Sequence, ...]:
    """Orders of equal features, those with the lowest ids: a diverse choice would take ten times as long. Of large tools itself."""
    graph = equal_sums(problem, order, resolve(None, problem.n)) if problem.n <= TENSOR_LIMIT else None
    return (order,) if graph is None else tuple(sorted({order, *graph.members(0.0, MEMBERS)}))


def _distances(classes: tuple[tuple[Sequence, ...], ...]) -> Array:
    shown = np.array([members[0] for members in classes[:COMPARED]])
    return np.stack([_apart(shown, np.array(members)).min(axis=1) for members in classes], axis=1)


def _apart(one: NDArray[np.int64], other: NDArray[np.int64]) -> Array:
    """Pairs of regions in another order (Kendall), (A, B) for orders (A, N) and (B, N)."""
    first, second = _signs(one), _signs(other)
    return (first.shape[1] - first @ second.T) / 2


def _signs(orders: NDArray[np.int64]) -> Array:
    place = np.argsort(orders, axis=1)
    i, j = np.triu_indices(orders.shape[1], 1)
    return np.sign(place[:, j] - place[:, i]).astype(np.float64)
