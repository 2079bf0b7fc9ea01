"""The three relaxed problems behind `bounds`, compiled: positions with a tracked mean, sets in boxes, and pairs.

Each takes prices (Lagrange multipliers) and returns its lowest value with what it chose; any prices give a valid bound.
"""

import numba as nb
import numpy as np
from numpy.typing import NDArray

from app.geometry.tool import Array


@nb.njit(cache=True, nogil=True, error_model="numpy")
def cheapest_walk(table: Array, price: Array, step: NDArray[np.int64], start: int, end: int) -> tuple[float, NDArray[np.int64]]:
    """The cheapest walk that makes one step per position and ends where the sum of all steps ends.

    Args:
        table: Cost of region a at position p with the tracked sum at level l, (P, F, L); inf where that can't be.
        price: Added to every step, (P, F).
        step: What region a adds to the level, (F,).
        start: Level before the first step.
        end: Level after the last.

    Returns:
        The walk's cost and the region at each position; regions may repeat.
    """
    positions, count, levels = table.shape
    value, came = np.full((positions + 1, levels), np.inf), np.zeros((positions, levels), np.int64)
    value[0, start] = 0.0
    for p in range(positions):
        for a in range(count):
            k, x = step[a], price[p, a]
            lo, hi = max(0, -k), min(levels, levels - k)
            for level in range(lo, hi):
                y = value[p, level] + table[p, a, level] + x
                if y < value[p + 1, level + k]:
                    value[p + 1, level + k] = y
                    came[p, level + k] = a
    walk, level = np.zeros(positions, np.int64), end
    if value[positions, end] == np.inf:
        return np.inf, walk
    for p in range(positions - 1, -1, -1):
        walk[p] = came[p, level]
        level -= step[walk[p]]
    return value[positions, end], walk


@nb.njit(cache=True, nogil=True, error_model="numpy")
def cheapest_sets(
    price: Array,
    area: Array,
    fixed: NDArray[np.int64],
    pairs: Array,
    weights: Array,
    total: float,
    base: Array,
    low: Array,
    chosen: NDArray[np.bool_],
) -> None:
    """For every size, the least gap cost plus prices of a set of free regions within a pair of boxes.

    Args:
        price: Paid for each region in the set, (F,).
        area: Areas of the free regions, (F,).
        fixed: Per pair of boxes and region 0 free, 1 must be in the set, -1 must not, (Q, F).
        pairs: Areas of the box around the set and around the rest, (Q, 2).
        weights: Of the gap inside the set and of the gap left.
        total: Area of all regions.
        base: Area and number of regions that are in every set, those already finished, (2,).
        low: Filled in: least value per size 0 .. F, (F + 1,); inf on entry.
        chosen: Filled in: the set of that value, (F + 1, F).
    """
    count = len(price)
    key, order = np.empty(count), np.empty(count, np.int64)
    for q in range(len(pairs)):
        one, two = pairs[q, 0], pairs[q, 1]
        slope = (-weights[0] / one if one > 0 else 0.0) + (weights[1] / two if two > 0 else 0.0)
        inside = base[0]
        value, size, free = 0.0, 0, 0
        for a in range(count):
            if fixed[q, a] == 1:
                value += price[a]
                inside += area[a]
                size += 1
            elif fixed[q, a] == 0:
                key[free], order[free] = price[a] + slope * area[a], a
                free += 1
        value += (weights[0] * (1 - inside / one) if one > 0 else 0.0) + (weights[1] * (1 - (total - inside) / two) if two > 0 else 0.0)
        ranked = np.argsort(key[:free])
        for i in range(free + 1):
            if value < low[size + i]:
                low[size + i] = value
                for a in range(count):
                    chosen[size + i, a] = fixed[q, a] == 1
                for j in range(i):
                    chosen[size + i, order[ranked[j]]] = True
            if i < free:
                value += key[ranked[i]]
    return


@nb.njit(cache=True, nogil=True, error_model="numpy")
def cheapest_pairs(change: Array, slope: Array, before: NDArray[np.bool_], place: Array) -> float:
    """The least sum over pairs when each pair is ordered for itself; a region pays `slope` per region before it.

    `change[a, b]` is what a pays when b is before it; `place` (F,) is filled with how many were put before each.
    """
    n, total = len(slope), 0.0
    place[:] = 0
    for a in range(n):
        for b in range(a):
            late, early = change[a, b] + slope[a], change[b, a] + slope[b]  # b before a, a before b
            if before[b, a] or (not before[a, b] and late < early):
                total += late
                place[a] += 1
            elif late == early and not before[a, b]:
                total += late
                place[a] += 0.5
                place[b] += 0.5
            else:
                total += early
                place[b] += 1
    return total
