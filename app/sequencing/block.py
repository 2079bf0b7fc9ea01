"""The exact dynamic program over all states, compiled (Sec. IV-B): no graph is built, no table of costs either.

A state s is a bit mask of finished regions. V(s), the cheapest cost from s to the end, is

    V(s) = min over the regions a that are not in s of   c(s, a) + V(s | a)

filled in from the full set downwards, so that every V(s | a) is known when V(s) asks for it; costs may be negative.
`kernels.lowest_to_go` is just that, for a table of costs. This is the same, computing the costs on the way, 128 states
at a time. A block is the states that share all but their low bits:

    for each block, from the last to the first:
        of the state:     the means of what is finished, and what depends on the set only
        high regions a:   best = min(best, c(lanes, a) + V[the block with a])      all lanes at once: they lie side by side
        low regions a:    c(lanes, a), then V inside the block, lane by lane from the last
        V[block] = best + what depends on the set only

Costs come from the tables of `rows`, each for some of the bits. Superblocks (all blocks with the same topmost bits) that hold
equally many topmost regions don't need each other, so threads can share them.
"""

# pyright: reportArgumentType=false, reportCallIssue=false
# Compiled code: the checker takes elements of arrays for numpy's own scalars and doesn't know all of numba's options.

from typing import NamedTuple

import numba as nb
import numpy as np

from app.geometry.compiled import kernel
from app.sequencing.rows import LANES, LOW, Rows, Single, count_bits, first_passed

SMALLEST = LOW  # regions; fewer are left to `nearly`
FAST = {"nnan", "nsz", "contract", "arcp", "reassoc"}  # infinities stay: they mark what is not allowed


class Scratch(NamedTuple):
    """Where one block is worked out."""

    mean: Single  # (Q, LANES) at least two rows
    state: Single  # (F, LANES) what depends on the set only
    fixed: Single  # (F, N) what the high bits add for each region
    value: Single  # (F, LANES) of one region
    low: Single  # (LOW, LANES) cost of each low region
    best: Single  # (LANES,) without what depends on the set only


@kernel(nogil=True)
def _scratch(rows: Rows) -> Scratch:
    f, n = rows.middle.shape[0], rows.middle.shape[2]
    return Scratch(
        np.zeros((max(2, len(rows.sum_lane)), LANES), np.float32), np.empty((f, LANES), np.float32), np.empty((f, n), np.float32),
        np.empty((f, LANES), np.float32), np.empty((LOW, LANES), np.float32), np.empty(LANES, np.float32),
    )  # fmt: skip


@kernel(nogil=True)
def fill(rows: Rows, sets: Single, v: Single) -> None:
    """V of every state, one thread; `sets` (G', 2^N) holds the values that depend on a set only."""
    scratch = _scratch(rows)
    for top in range(rows.top.shape[1] - 1, -1, -1):
        _fill_superblock(rows, sets, v, top, scratch)


@kernel(nogil=True, parallel=True)
def fill_parallel(rows: Rows, sets: Single, v: Single) -> None:
    """The same; superblocks with equally many topmost regions at the same time."""
    tops = rows.top.shape[1]
    layer = np.empty(tops, np.int64)
    for ones in range(count_bits(tops - 1), -1, -1):
        size = 0
        for top in range(tops - 1, -1, -1):
            if count_bits(top) == ones:
                layer[size] = top
                size += 1
        for i in nb.prange(size):
            _fill_superblock(rows, sets, v, layer[i], _scratch(rows))


@kernel(nogil=True, fastmath=FAST, error_model="numpy", _nrt=False)
def _fill_superblock(rows: Rows, sets: Single, v: Single, top: int, scratch: Scratch) -> None:
    """V of every state whose topmost bits are `top`; those with more of them are filled in already."""
    f, middles, n = rows.middle.shape
    mean, state, fixed, value, low, best = scratch
    plain = len(rows.extra) == 0 and not rows.ranked.any() and not rows.stated[1:].any() and len(rows.of) == 2
    simple, paired = plain and len(rows.weight) == 0, plain and 0 < len(rows.weight) <= 2
    full, shift = np.int64((1 << n) - 1), count_bits(middles - 1)
    for m in range(middles - 1, -1, -1):
        base = ((np.int64(top) << shift) | m) << LOW  # the block's first state: no low region finished
        above = count_bits(base)
        _of_state(rows, sets, top, m, base, above, full, mean, state)
        for i in range(f):
            for a in range(n):
                fixed[i, a] = rows.middle[i, m, a] + rows.top[i, top, a]
        best[:] = np.inf
        for a in range(n - 1, -1, -1):
            bit = np.int64(1) << a
            if base & bit:
                continue
            out = low[a] if a < LOW else value[0]
            if rows.before[a] & ~base & ~(LANES - 1):  # a high region must come first
                out[:] = np.inf
                continue
            level = _level(rows, base, a)
            after = v[base | bit : (base | bit) + LANES]
            if a >= LOW and simple:
                _simple_minimum(rows, fixed[0, a], rows.lane[0, a, level], mean, a, after, best)
                continue
            if paired:
                _with_products(rows, fixed, level, mean, a, out)
            else:
                _costs(rows, fixed, mean, state, level, a, above, base, value, out)
            if a >= LOW:
                _take_minimum(best, out, after)
        _inside(low, best, v[base : base + LANES], state[0], base + LANES - 1 == full)


@kernel(nogil=True, fastmath=FAST, inline="always")
def _of_state(rows: Rows, sets: Single, top: int, m: int, base: int, above: int, full: int, mean: Single, state: Single) -> None:
    """Means of the lanes, and the state part of every F."""
    for k in range(len(rows.sum_lane)):
        here, lane, share, out = rows.sum_middle[k, m] + rows.sum_top[k, top], rows.sum_lane[k], rows.share[above], mean[k]
        for x in range(LANES):
            out[x] = (here + lane[x]) * share[x]
    for i in range(len(state)):
        out = state[i]
        out[:] = 0
        for k in range(len(rows.sum_lane)):
            _add_multiple(out, rows.drift[i, k], mean[k])
        for k in range(rows.state.shape[1]):
            weight = rows.state[i, k]
            if weight != 0 and rows.flip[k]:
                values = sets[rows.row[k], (full ^ base) - (LANES - 1) : (full ^ base) + 1]
                for x in range(LANES):
                    out[x] += weight * values[LANES - 1 - x]
            elif weight != 0:
                _add_multiple(out, weight, sets[rows.row[k], base : base + LANES])


@kernel(nogil=True, fastmath=FAST, inline="always")
def _add_multiple(out: Single, factor: np.float32, values: Single) -> None:
    for x in range(LANES):
        out[x] += factor * values[x]


@kernel(nogil=True, inline="always")
def _level(rows: Rows, base: int, a: int) -> int:
    """Which tests the high bits pass, two bits per cascade."""
    out = 0
    for u in range(len(rows.reached)):
        out |= first_passed(rows.tests, u, a, base, rows.reached[u, a]) << (2 * u)
    return out


@kernel(nogil=True, fastmath=FAST, inline="always")
def _simple_minimum(rows: Rows, start: np.float32, lane: Single, mean: Single, a: int, after: Single, best: Single) -> None:
    """Cost and minimum in one pass, for the usual case: no product, no table, at most two distances from a mean."""
    slope, own, one = rows.slope[0, 0], rows.own[0, a], mean[rows.of[0]]
    other_slope, other, two = rows.slope[0, 1], rows.own[1, a], mean[rows.of[1]]
    for x in range(LANES):
        cost = start + lane[x] + slope * abs(own - one[x]) + other_slope * abs(other - two[x]) + after[x]
        best[x] = cost if cost < best[x] else best[x]


@kernel(nogil=True, fastmath=FAST, inline="always")
def _with_products(rows: Rows, fixed: Single, level: int, mean: Single, a: int, out: Single) -> None:
    """Cost in one pass, for one or two products of factors that depend on pairs of regions and two distances from means."""
    (i, j), (k, m), slope = rows.pair[0], rows.pair[-1], rows.slope
    weight, other_weight = rows.weight[0], rows.weight[-1] if len(rows.weight) > 1 else np.float32(0)
    own, one, other, two = rows.own[0, a], mean[rows.of[0]], rows.own[1, a], mean[rows.of[1]]
    lane, lane_i, lane_j = rows.lane[0, a, level], rows.lane[i, a, level], rows.lane[j, a, level]
    lane_k, lane_m = rows.lane[k, a, level], rows.lane[m, a, level]
    for x in range(LANES):
        near, far = abs(own - one[x]), abs(other - two[x])
        factor_i = fixed[i, a] + lane_i[x] + slope[i, 0] * near + slope[i, 1] * far
        factor_j = fixed[j, a] + lane_j[x] + slope[j, 0] * near + slope[j, 1] * far
        factor_k = fixed[k, a] + lane_k[x] + slope[k, 0] * near + slope[k, 1] * far
        factor_m = fixed[m, a] + lane_m[x] + slope[m, 0] * near + slope[m, 1] * far
        cost = fixed[0, a] + lane[x] + slope[0, 0] * near + slope[0, 1] * far
        out[x] = cost + weight * factor_i * factor_j + other_weight * factor_k * factor_m


@kernel(nogil=True, fastmath=FAST, inline="always")
def _take_minimum(best: Single, cost: Single, after: Single) -> None:
    for x in range(len(best)):
        total = cost[x] + after[x]
        best[x] = total if total < best[x] else best[x]


@kernel(nogil=True, fastmath=FAST, inline="always")
def _sum_of(rows: Rows, i: int, start: np.float32, lane: Single, mean: Single, above: int, a: int, out: Single) -> None:
    """F_i without its state part, for all lanes."""
    slope, own, one = rows.slope[i, 0], rows.own[0, a], mean[rows.of[0]]
    other_slope, other, two = rows.slope[i, 1], rows.own[1, a], mean[rows.of[1]]
    if slope != 0 and other_slope != 0:
        for x in range(LANES):
            out[x] = start + lane[x] + slope * abs(own - one[x]) + other_slope * abs(other - two[x])
    elif slope != 0:
        for x in range(LANES):
            out[x] = start + lane[x] + slope * abs(own - one[x])
    else:
        for x in range(LANES):
            out[x] = start + lane[x] + other_slope * abs(other - two[x])
    for t in range(2, len(rows.of)):
        slope, own, m = rows.slope[i, t], rows.own[t, a], mean[rows.of[t]]
        if slope != 0:
            for x in range(LANES):
                out[x] += slope * abs(own - m[x])
    if rows.ranked[i]:
        for x in range(LANES):
            out[x] += rows.rank[i, above + rows.ones[x], a]


@kernel(nogil=True, fastmath=FAST, inline="always")
def _costs(
    rows: Rows, fixed: Single, mean: Single, state: Single, level: int, a: int, above: int, base: int, value: Single, out: Single
) -> None:
    """The cost of region a without what depends on the state only, for all lanes."""
    for i in range(1, len(fixed)):
        _sum_of(rows, i, fixed[i, a], rows.lane[i, a, level], mean, above, a, value[i])
        if rows.stated[i]:
            _add_multiple(value[i], np.float32(1), state[i])
    _sum_of(rows, 0, fixed[0, a], rows.lane[0, a, level], mean, above, a, out)
    for k in range(len(rows.weight)):
        one, other, weight = value[rows.pair[k, 0]], value[rows.pair[k, 1]], rows.weight[k]
        for x in range(LANES):
            out[x] += weight * one[x] * other[x]
    if len(rows.extra):
        _add_multiple(out, np.float32(1), rows.extra[a, base : base + LANES])


@kernel(nogil=True, fastmath=FAST, _nrt=False)
def _inside(low: Single, best: Single, v: Single, state: Single, full: bool) -> None:
    """The low regions, whose successors lie in the block itself: the recurrence as it stands, lane by lane from the last."""
    for x in range(LANES - 1, -1, -1):
        lowest = best[x]
        for a in range(LOW):
            if not x >> a & 1:
                lowest = min(lowest, low[a, x] + v[x | 1 << a])
        v[x] = lowest + state[x]
        if full and x == LANES - 1:
            v[x] = np.float32(0)
