"""The relaxed problems behind `bounds` besides the walk, compiled: pairs of regions, sets in boxes, and chains of neighbours.

Each takes prices (Lagrange multipliers) and returns its lowest value with what it chose; any prices give a valid bound.
"""

# pyright: reportArgumentType=false, reportPossiblyUnboundVariable=false
# Compiled code: the checker takes elements of arrays for arrays.

import numpy as np
from numpy.typing import NDArray

from app.geometry.compiled import kernel
from app.geometry.tool import Array

Ints = NDArray[np.int64]


@kernel(nogil=True, error_model="numpy")
def cheapest_pairs(ends: Ints, change: Array, bits: Array, first: Ints, last: Ints, chosen: Array) -> float:
    """The least sum over pairs when each pair chooses its two positions for itself.

    Args:
        ends: The two regions of each pair, (E, 2).
        change: What either pays when it comes second, (E, 2); inf where it must not.
        bits: What a region gets at a position for the other not yet (0) or already (1) being finished, (E, 2, 2, P).
        first: First position a region can have, (F,).
        last: And the last.
        chosen: Filled in: -1 at what each pair chose, zeros on entry, (E, 2, 2, P).
    """
    total = 0.0
    for e in range(len(ends)):
        best, late, early, second = np.inf, 0, 0, 0
        for s in range(2):
            a, b, low, at = ends[e, s], ends[e, 1 - s], np.inf, 0
            for p in range(bits.shape[3]):
                if low < np.inf and first[a] <= p <= last[a]:
                    x = low - bits[e, s, 1, p] + change[e, s]
                    if x < best:
                        best, late, early, second = x, p, at, s
                if first[b] <= p <= last[b] and -bits[e, 1 - s, 0, p] < low:
                    low, at = -bits[e, 1 - s, 0, p], p
        total += best
        chosen[e, second, 1, late] -= 1
        chosen[e, 1 - second, 0, early] -= 1
    return total


@kernel(nogil=True, error_model="numpy")
def cheapest_chain(price: Array, between: Array, start: Array, regions: Ints) -> float:
    """The cheapest choice of a region for every position when only neighbours in the order count.

    Args:
        price: Of a region at a position, (P, F); inf where it can't be.
        between: Of a region directly after another, (F, F) [before, after]; inf where it must not follow.
        start: Of a region as the first, (F,).
        regions: Filled in, (P,).
    """
    count = len(price)
    value, came = np.full((count, count), np.inf), np.zeros((count, count), np.int64)
    value[0] = start + price[0]
    for p in range(1, count):
        for a in range(count):
            for b in range(count):
                x = value[p - 1, b] + between[b, a] + price[p, a]
                if x < value[p, a]:
                    value[p, a], came[p, a] = x, b
    a = int(np.argmin(value[count - 1]))
    total = value[count - 1, a]
    for p in range(count - 1, -1, -1):
        regions[p] = a
        a = came[p, a]
    return total


@kernel(nogil=True, error_model="numpy")
def cheapest_sets(
    price: Array, area: Array, fixed: NDArray[np.int8], boxes: Array, last: Ints, low: Array, chosen: NDArray[np.bool_]
) -> None:
    """For the sizes 2 .. F - 2, the least gap cost plus prices of a set of free regions within a pair of boxes.

    Args:
        price: Paid for each region in the set of a size, (F, F) [size, region].
        area: Areas of the free regions, (F,).
        fixed: Per pair of boxes and region 0 free, 1 must be in the set, -1 must not, (Q, F).
        boxes: Per pair how many must be in the set, how many are free, the gap cost of those that must, and what each area
            in the set adds, (Q, 4).
        last: The pair each size chose before, (F,): looked at first.
        low: Filled in: least value per size, (F,); inf on entry.
        chosen: Filled in: the set of that value, (F, F).
    """
    count = len(area)
    key, region = np.empty(count + 1), np.empty(count + 1, np.int64)
    small, large = area.min(), area.max()
    for size in range(2, count - 1):
        order = np.argsort(price[size])
        prices = price[size][order][:size].sum()  # no set of this size costs less
        for turn in range(-1, len(boxes)):
            q = last[size] if turn < 0 else turn
            need, slope = size - int(boxes[q, 0]), boxes[q, 3]
            if need < 0 or need > boxes[q, 1]:
                continue
            if boxes[q, 2] + prices + need * min(slope * small, slope * large) >= low[size]:
                continue
            value = boxes[q, 2] + _fill(price[size], area, fixed[q], slope, need, order, key, region)
            if value < low[size]:
                low[size], last[size] = value, q
                chosen[size] = fixed[q] == 1
                for i in range(need):
                    chosen[size, region[i]] = True


@kernel(nogil=True, error_model="numpy")
def _fill(price: Array, area: Array, fixed: NDArray[np.int8], slope: float, need: int, order: Ints, key: Array, region: Ints) -> float:
    """Prices of the regions that must be in a set, and of the `need` cheapest free ones, which `region` then starts with."""
    held, value = 0, 0.0
    for a in order:
        if fixed[a] == 1:
            value += float(price[a])
        elif fixed[a] == 0:
            x, j = price[a] + slope * area[a], min(held, need)
            while j > 0 and key[j - 1] > x:
                key[j], region[j] = key[j - 1], region[j - 1]
                j -= 1
            key[j], region[j] = x, a
            held += 1
    for i in range(need):
        value += float(key[i])
    return value
