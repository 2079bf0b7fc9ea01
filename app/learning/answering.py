"""What does the expert want on this one tool? A few comparisons of two orders find out, even where the weights can't say it.

The likelihood that was learned (`generalising`) says how probable every order of the tool is. Orders are drawn from it and from
its uncertainty, those with equal feature sums are one candidate, and each answer "this one is closer to how I would do it" makes
the candidates it speaks against improbable. What is found may be an exception that no weights on the features express; it is then
an order for this tool, and changes no weights.
"""

from collections import Counter
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from app.learning.generalising import Generalised, on_features
from app.learning.qp import Array
from app.learning.soft_program import drawn, soft_to_go
from app.sequencing.classes import equivalent_sequences
from app.sequencing.features import FEATURE_SETS
from app.sequencing.problem import SequencingProblem

DRAWS = (200, 30)  # weights from the posterior, orders from each
BOLDNESS = 1.5  # temperature: an expert makes bolder exceptions than the demonstrations' likelihood has room for
CANDIDATES = 300  # most frequent ones kept
COMPARED = 60  # of these may be shown
MEMBERS = 64  # orders looked at per candidate
SLIP = 0.02  # probability of an answer against the expert's own order
DIGITS = 6  # of a feature sum, in its unit, that tell candidates apart

Sequence = tuple[int, ...]
Reply = Literal["left", "right", "equal", "cant_tell"]


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
        problem: The tool, under any features; at most 14 regions.
        learned: From the demonstrations of other tools.
        generator: For the draws.
    """
    problem = on_features(problem, FEATURE_SETS[learned.policy.features])
    unit = np.where(learned.policy.identifiable, 1 / learned.scale, 0.0)
    values = np.ascontiguousarray(problem.tensor() * unit)
    root = np.linalg.cholesky(learned.fit.covariance)
    found: Counter[tuple[float, ...]] = Counter()
    shown: dict[tuple[float, ...], Sequence] = {}
    weights, orders = DRAWS
    for _ in range(weights):
        w = (learned.fit.weights + root @ generator.normal(size=len(root))) / BOLDNESS
        _, chosen = soft_to_go(values, w, problem.n)
        for row in drawn(chosen, problem.n, generator.random((orders, problem.n))):
            order = tuple(int(a) for a in row)
            key = tuple(float(x) for x in np.round(problem.feature_sum(order) * unit, DIGITS) + 0.0)
            found[key] += 1
            shown.setdefault(key, order)
    kept = found.most_common(CANDIDATES)
    classes = tuple(_members(problem, shown[key]) for key, _ in kept)
    counts = np.array([count for _, count in kept], np.float64)
    return Candidates(classes, counts / counts.sum(), _distances(classes))


def next_pair(candidates: Candidates) -> tuple[int, int] | None:
    """The two candidates whose comparison is expected to tell most; None when no pair tells anything."""
    d, p = candidates.distance, candidates.probability
    best, pair = 1e-9, None
    for a in range(len(d) - 1):
        sides = np.sign(d[a] - d[a + 1 :])  # (rest, C)
        shares = np.stack([(sides == side) @ p for side in (-1, 0, 1)])
        worth = -(shares * np.log(np.maximum(shares, 1e-300))).sum(axis=0)
        for b in np.argsort(-worth, kind="stable"):
            if (a, a + 1 + int(b)) not in candidates.asked:
                if worth[b] > best:
                    best, pair = float(worth[b]), (a, a + 1 + int(b))
                break
    return pair


def after_answer(candidates: Candidates, pair: tuple[int, int], reply: Reply) -> Candidates:
    """The candidates once the expert has said which of the pair is closer to what they want."""
    asked = candidates.asked | {pair}
    if reply == "cant_tell":
        return replace(candidates, asked=asked)
    expected = np.sign(candidates.distance[pair[0]] - candidates.distance[pair[1]])
    given = {"left": -1, "equal": 0, "right": 1}[reply]
    weight = candidates.probability * np.where(expected == given, 1 - SLIP, SLIP)
    return replace(candidates, probability=weight / weight.sum(), asked=asked)


def closer(left: Sequence, right: Sequence, wanted: tuple[Sequence, ...]) -> Reply:
    """How an expert answers to whom any of the wanted orders is as good as another."""
    first, second = (float(_apart(np.array([s]), np.array(wanted)).min()) for s in (left, right))
    return "equal" if first == second else ("left" if first < second else "right")


def _members(problem: SequencingProblem, order: Sequence) -> tuple[Sequence, ...]:
    """All orders of equal features, lowest ids first."""
    return tuple(sorted(equivalent_sequences(problem, order, MEMBERS).sequences))


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
