"""What regions of a tool have to do with each other two at a time: which comes first costs something, now or through proximity."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.geometry.tool import Array
from app.sequencing.relaxations import Ints
from app.sequencing.relaxed_walk import CLASSES
from app.sequencing.structure import FirstTouch


@dataclass(frozen=True)
class Pairs:
    """Pairs of free regions, and every region's neighbours among them."""

    ends: Ints  # (E, 2)
    change: Array  # (E, 2) what either pays when it comes second; inf where it must not
    constant: float  # of all other pairs, whichever way round
    near: Ints  # (F, D) the other region, -1 where there are fewer
    pair: Ints  # (F, D) number of the pair
    side: Ints  # (F, D) which of its regions this one is
    kind: Ints  # (F, D) first test of proximity that the neighbour passes
    touch: Array  # (4,) cost by the first test passed
    reached: Ints  # (F,) first test that the regions finished before pass


@dataclass(frozen=True)
class Proximity:
    """Tests of one column between free regions, and its cost by the first test passed."""

    tests: NDArray[np.bool_]  # (3, F, F)
    cost: Array  # (4,)
    reached: Ints  # (F,)


def proximity(d: FirstTouch | None, weight: float, free: Ints, past: Ints) -> Proximity:
    """The column's tests; nothing ever passed or paid without a column."""
    count = len(free)
    tests, cost, reached = np.zeros((CLASSES, count, count), np.bool_), np.zeros(CLASSES + 1), np.full(count, CLASSES)
    if d is None:
        return Proximity(tests, cost, reached)
    cost[:] = weight * d.otherwise
    for k, (passes, value) in reversed(list(enumerate(d.tests))):
        tests[k], cost[k] = passes[np.ix_(free, free)], weight * value
        reached[passes[np.ix_(free, past)].any(axis=1)] = k
    return Proximity(tests, cost, reached)


def pairs_of(change: Array, pull: Array, near: Proximity, before: NDArray[np.bool_]) -> Pairs:
    """The pairs that matter: their order costs something or is prescribed, or is part of a product (`pull`) or of proximity."""
    count = len(change)
    matter = (change != change.T) | (pull != 0) | near.tests.any(axis=0) | before
    matter |= matter.T
    np.fill_diagonal(matter, False)
    ends = np.argwhere(np.triu(matter)).astype(np.int64).reshape(-1, 2)
    a, b = ends.T
    paid = np.stack([np.where(before[a, b], np.inf, change[a, b]), np.where(before[b, a], np.inf, change[b, a])], axis=1)
    width = max(1, int(matter.sum(axis=1).max(initial=0)))
    other, pair, side = np.full((count, width), -1), np.zeros((count, width), np.int64), np.zeros((count, width), np.int64)
    kind, filled = np.full((count, width), CLASSES), np.zeros(count, np.int64)
    first_passed = np.concatenate([near.tests, np.ones((1, count, count), np.bool_)]).argmax(axis=0)
    for e, (one, two) in enumerate(ends.tolist()):
        for s, (x, y) in enumerate(((one, two), (two, one))):
            d = filled[x]
            other[x, d], pair[x, d], side[x, d], kind[x, d] = y, e, s, first_passed[x, y]
            filled[x] += 1
    rest = float(np.triu(np.where(matter, 0.0, change), 1).sum())
    return Pairs(ends, paid, rest, other, pair, side, kind, near.cost, near.reached)
