"""The relaxed sequence behind `bounds`, compiled: one region per position, met any number of times.

It knows exactly, up to a rounding that the tables account for, the sums behind two means (curvature and height), so their
product too. For every step it also chooses which of the region's neighbours are finished, whether they are or not; prices
make these choices agree with those of the other relaxed problems.
"""

# pyright: reportArgumentType=false, reportPossiblyUnboundVariable=false
# Compiled code: the checker takes elements of arrays for arrays.

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.geometry.compiled import kernel
from app.geometry.tool import Array

Ints = NDArray[np.int64]
CLASSES = 3  # tests of proximity; a neighbour of class 3 passes none


class Walk(NamedTuple):
    """Costs of the steps of F regions at P = F positions, with levels L1 and L2 of the two tracked sums.

    The first and the last step cost `fixed` alone, for there all or none of the other regions are finished.
    """

    fixed: Array  # (P, F) inf where the region can't be at the position
    one: Array  # (P, F, L1)
    two: Array  # (P, F, L2)
    left: Array  # (J, K, P, F, L1) products: the least over K of left * right is paid, for each of J
    right: Array  # (J, K, P, F, L2)
    ends: Array  # (H, P, F, L1) factor of what depends on neighbours: the least over H is paid
    weight: Array  # (F,) times the factor in any case
    pull: Array  # (F, D) times the factor where the neighbour is finished
    near: Ints  # (F, D) neighbours, -1 where there are fewer
    pair: Ints  # (F, D) which pair that is
    side: Ints  # (F, D) and which of its two regions this one is
    kind: Ints  # (F, D) first test of proximity that the neighbour passes, 3 for none
    touch: Array  # (4,) cost by the first test that a finished neighbour passes
    reached: Ints  # (F,) first test passed by regions finished before
    step: Ints  # (2, F) what a region adds to the levels
    low: Ints  # (2, P + 1) lowest level there can be at a position
    high: Ints  # (2, P + 1)


@kernel(nogil=True, error_model="numpy")
def cheapest_walk(w: Walk, price: Array, bits: Array, value: Array, regions: Ints, finished: Ints) -> float:
    """Cost of the cheapest walk.

    Args:
        w: The steps.
        price: Paid besides by a region at a position, (P, F).
        bits: Paid for a neighbour that is not finished (0) or is (1), (E, 2, 2, P) [pair, side of the region, 0 or 1, position].
        value: Scratch, (P + 1, L1, L2).
        regions: Filled in: the region at each position, (P,).
        finished: Filled in: which of its neighbours it takes for finished, (P, D).
    """
    count = len(w.fixed)
    sums, local = np.zeros((2 * CLASSES + 2, value.shape[1])), np.zeros(value.shape[1])
    row = np.zeros(value.shape[2])
    from_one, from_two = -w.low[0].min(), -w.low[1].min()
    value[:] = np.inf
    value[0, from_one, from_two] = 0.0
    for p in range(count):
        for a in range(count):
            k1, k2, paid = w.step[0, a], w.step[1, a], price[p, a] + w.fixed[p, a]
            if paid == np.inf:
                continue
            i = max(w.low[0, p], w.low[0, p + 1] - k1) + from_one
            j = min(w.high[0, p], w.high[0, p + 1] - k1) + from_one + 1
            lo = max(w.low[1, p], w.low[1, p + 1] - k2) + from_two
            hi = min(w.high[1, p], w.high[1, p + 1] - k2) + from_two + 1
            local_costs(w, bits, p, a, i, j, sums, local)
            before, after = value[p, i:j, lo:hi], value[p + 1, i + k1 : j + k1, lo + k2 : hi + k2]
            if p == 0 or p == count - 1:
                _move(before, local[i:j], paid, after)
            else:
                _spread(w.two[p, a, lo:hi], w.left[:, :, p, a, i:j], w.right[:, :, p, a, lo:hi], before, local[i:j], paid, row, after)
    end = (from_one + w.high[0, count], from_two + w.high[1, count])
    if value[count, end[0], end[1]] < np.inf:
        _trace(w, price, bits, value, end, sums, local, row, regions, finished)
    return value[count, end[0], end[1]]


@kernel(nogil=True, error_model="numpy", fastmath={"nnan", "nsz"})
def _move(before: Array, local: Array, paid: float, after: Array) -> None:
    """Lower `after` to what a first or last step reaches."""
    for i in range(len(before)):
        for k in range(before.shape[1]):
            after[i, k] = min(after[i, k], before[i, k] + (paid + local[i]))


@kernel(nogil=True, error_model="numpy", fastmath={"nnan", "nsz"})
def _spread(two: Array, left: Array, right: Array, before: Array, local: Array, paid: float, row: Array, after: Array) -> None:
    """Lower `after` to what a step reaches from each pair of levels."""
    size = before.shape[1]
    for i in range(len(before)):
        base, source, target = paid + local[i], before[i], after[i]
        if left.shape[0] == 1 and left.shape[1] == 1:
            x, y = left[0, 0, i], right[0, 0]
            for k in range(size):
                target[k] = min(target[k], source[k] + (base + two[k] + x * y[k]))
            continue
        row[:size] = 0.0
        for j in range(left.shape[0]):
            for k in range(size):
                least = left[j, 0, i] * right[j, 0, k]
                for c in range(1, left.shape[1]):
                    least = min(least, left[j, c, i] * right[j, c, k])
                row[k] += least
        for k in range(size):
            target[k] = min(target[k], source[k] + (base + two[k] + row[k]))


@kernel(nogil=True, error_model="numpy")
def local_costs(w: Walk, bits: Array, p: int, a: int, i: int, j: int, sums: Array, out: Array) -> None:
    """For the levels i .. j - 1 of the first sum: the least cost that depends on it and on which neighbours are finished."""
    if p == 0 or p == len(w.fixed) - 1:
        paid = 0.0
        for d in range(w.near.shape[1]):
            if w.near[a, d] >= 0:
                paid += bits[w.pair[a, d], w.side[a, d], 1 if p else 0, p]
        out[i:j] = paid
        return
    for h in range(len(w.ends)):
        _pattern_costs(w, bits, p, a, h, i, j, sums)
        for k in range(i, j):
            x = sums[2 * CLASSES + 1, k] + w.one[p, a, k]
            out[k] = x if h == 0 else min(out[k], x)


@kernel(nogil=True, error_model="numpy", fastmath={"nnan", "nsz"})
def _pattern_costs(w: Walk, bits: Array, p: int, a: int, h: int, i: int, j: int, sums: Array) -> None:
    """Into the last row of `sums`: the cheapest choice of finished neighbours.

    Rows 0 to 3 add up the cheaper choice for each neighbour of a class, 4 to 6 hold the least it costs more to have one of
    class 0 to 2 finished.
    """
    factor, open_ = w.ends[h, p, a], np.zeros(CLASSES + 1)
    sums[: CLASSES + 1, i:j] = 0.0
    sums[CLASSES + 1 : 2 * CLASSES + 1, i:j] = np.inf
    for d in range(w.near.shape[1]):
        if w.near[a, d] < 0:
            break
        waiting, done, pull = bits[w.pair[a, d], w.side[a, d], 0, p], bits[w.pair[a, d], w.side[a, d], 1, p], w.pull[a, d]
        kind = w.kind[a, d]
        open_[kind] += waiting
        total, more = sums[kind], sums[min(kind, CLASSES - 1) + CLASSES + 1]
        for k in range(i, j):
            x = done + pull * factor[k]
            total[k] += min(waiting, x)
            if kind < CLASSES:
                more[k] = min(more[k], x - min(waiting, x))
    reached, out = w.reached[a], sums[2 * CLASSES + 1]
    for k in range(i, j):
        best, without = np.inf, 0.0
        for level in range(CLASSES + 1):
            if level <= reached:
                x = without + w.touch[level]
                for later in range(level, CLASSES):
                    x += sums[later, k]
                if level < reached:
                    x += sums[CLASSES + 1 + level, k]
                best = min(best, x)
                without += open_[level]
        out[k] = best + sums[CLASSES, k] + w.weight[a] * factor[k]


@kernel(nogil=True, error_model="numpy")
def _trace(
    w: Walk,
    price: Array,
    bits: Array,
    value: Array,
    end: tuple[int, int],
    sums: Array,
    local: Array,
    row: Array,
    regions: Ints,
    finished: Ints,
) -> None:
    """The steps of the cheapest walk, from its end."""
    count, (one, two) = len(w.fixed), end
    reached = np.zeros((1, 1))
    for p in range(count - 1, -1, -1):
        best, region = np.inf, 0
        for a in range(count):
            i, k, paid = one - w.step[0, a], two - w.step[1, a], price[p, a] + w.fixed[p, a]
            if not (0 <= i < value.shape[1] and 0 <= k < value.shape[2]) or paid == np.inf or value[p, i, k] == np.inf:
                continue
            local_costs(w, bits, p, a, i, i + 1, sums, local)
            reached[0, 0] = np.inf
            before = value[p, i : i + 1, k : k + 1]
            if p == 0 or p == count - 1:
                _move(before, local[i : i + 1], paid, reached)
            else:
                left, right = w.left[:, :, p, a, i : i + 1], w.right[:, :, p, a, k : k + 1]
                _spread(w.two[p, a, k : k + 1], left, right, before, local[i : i + 1], paid, row, reached)
            if reached[0, 0] < best:
                best, region = reached[0, 0], a
        regions[p] = region
        one, two = one - w.step[0, region], two - w.step[1, region]
        if p == 0 or p == count - 1:
            finished[p] = 1 if p else 0
        else:
            _choose(w, bits, p, region, one, sums, finished[p])


@kernel(nogil=True, error_model="numpy")
def _choose(w: Walk, bits: Array, p: int, a: int, level: int, sums: Array, finished: Ints) -> None:
    """Which neighbours the cheapest choice takes for finished."""
    best, h = np.inf, 0
    for k in range(len(w.ends)):
        _pattern_costs(w, bits, p, a, k, level, level + 1, sums)
        if sums[2 * CLASSES + 1, level] < best:
            best, h = sums[2 * CLASSES + 1, level], k
    cheapest, trial = np.inf, np.zeros(w.near.shape[1], np.int64)
    for first in range(w.reached[a] + 1):
        x = _pattern(w, bits, p, a, w.ends[h, p, a, level], first, trial)
        if x < cheapest:
            cheapest = x
            finished[:] = trial


@kernel(nogil=True, error_model="numpy")
def _pattern(w: Walk, bits: Array, p: int, a: int, factor: float, first: int, out: Ints) -> float:
    """The cheapest choice in which `first` is the first test passed, and its cost."""
    total, least, forced = w.touch[first], np.inf, -1
    for d in range(w.near.shape[1]):
        if w.near[a, d] < 0:
            break
        waiting = bits[w.pair[a, d], w.side[a, d], 0, p]
        more = bits[w.pair[a, d], w.side[a, d], 1, p] + w.pull[a, d] * factor - waiting
        out[d] = 1 if more < 0 and w.kind[a, d] >= first else 0
        total += waiting + more * out[d]
        if w.kind[a, d] == first and max(more, 0.0) < least:
            least, forced = max(more, 0.0), d
    if first < w.reached[a] and first < CLASSES:
        total += least
        if forced >= 0:
            out[forced] = 1
    return total
