"""The exact dynamic program over all states on the fly, compiled (Sec. IV-B): no table of costs is built.

A state s is a bit mask of finished regions. V(s), the cheapest cost from s to the end, is the minimum over the next region a of
c(s, a) + V(s | a), filled in from the full set downwards; costs may be negative. The trick is to split s = high bits | low bits.
For a region a among the high bits the successors of all 64 states that share their high bits lie side by side in V, so what
depends on a is computed for 64 lanes at once and vectorises. Only the six regions of the low bits look inside the block.

    for each block of 64 states, from the last to the first:
        means and set values of the lanes
        for each high region a not finished:   best = min(best, cost(a, lanes) + V[block with a])     64 lanes at once
        for each low region a:                 cost(a, lanes), then V inside the block, lane by lane from the last
        V[block] = best + what depends on the state only

Blocks whose high bits hold the same number of regions don't need each other, so two threads can share them: `fill_parallel`
deals out superblocks (all blocks with the same topmost bits) layer by layer.
"""

# pyright: reportArgumentType=false, reportCallIssue=false
# Compiled code: the checker takes elements of arrays for numpy's own scalars and doesn't know all of numba's options.

from typing import NamedTuple

import numba as nb
import numpy as np
from numpy.typing import NDArray

from app.geometry.tool import Array
from app.sequencing.forms import Form, Ints

Single = NDArray[np.float32]
LOW = 6  # bits of a block
LANES = 1 << LOW
SMALLEST = LOW + 1  # regions; fewer are left to `nearly`
FAST = {"nnan", "nsz", "contract", "arcp", "reassoc"}  # infinities stay: they mark what is not allowed


class Rows(NamedTuple):
    """A form laid out for the block kernel: what the high bits add, and what the lanes add."""

    middle: Single  # (F, 2^m, N) start and change of the regions of the middle bits
    top: Single  # (F, 2^t, N) and of the topmost bits
    lane: Single  # (F, N, K, 64) change and touch of the lanes; K levels that the high bits reach; infinite: not allowed yet
    levels: int  # K
    sum_middle: Single  # (Q, 2^m)
    sum_top: Single  # (Q, 2^t)
    sum_lane: Single  # (Q, 64)
    tests: Ints  # (U, 3, N) bit masks
    reached: Ints  # (U, N)
    before: Ints  # (N,)
    own: Single  # (T, N) T at least 2, padded with zeros
    of: Ints  # (T,)
    slope: Single  # (F, T)
    drift: Single  # (F, Q)
    ranked: NDArray[np.bool_]  # (F,)
    rank: Single  # (F, N + 1, N)
    state: Single  # (F, G)
    flip: NDArray[np.bool_]  # (G,) read at the unfinished set
    pair: Ints  # (P, 2)
    weight: Single  # (P,)
    stated: NDArray[np.bool_]  # (F,) depends on state values
    ones: Ints  # (64,) regions of each lane
    share: Single  # (N, 64) 1 / number finished, by the number of high regions
    row: Ints  # (G,) row of the table of set values
    extra: Single  # (N, 2^N) or (0, 0)


@nb.njit(cache=True, nogil=True)
def lay_out(form: Form, middle_bits: int, top_bits: int, flip: NDArray[np.bool_], row: Ints, extra: Single) -> Rows:
    """Tables of the sums over the middle, topmost and low bits."""
    f, n = form.start.shape
    u, q = len(form.reached), len(form.averaged)
    middle, top = np.zeros((f, 1 << middle_bits, n), np.float32), np.zeros((f, 1 << top_bits, n), np.float32)
    sum_middle, sum_top, sum_lane = np.zeros((q, 1 << middle_bits)), np.zeros((q, 1 << top_bits)), np.zeros((q, LANES))
    for i in range(f):
        _subset_rows(form.change[i], LOW, middle[i])
        _subset_rows(form.change[i], LOW + middle_bits, top[i])
        for s in range(1 << top_bits):
            top[i, s] += form.start[i].astype(np.float32)
    for k in range(q):
        _subset_sums(form.averaged[k], 0, sum_lane[k])
        _subset_sums(form.averaged[k], LOW, sum_middle[k])
        _subset_sums(form.averaged[k], LOW + middle_bits, sum_top[k])
        sum_top[k] += form.total[k]
    tests = np.zeros((u, 3, n), np.int64)
    for i in range(u):
        for k in range(3):
            for a in range(n):
                for b in range(n):
                    if form.tests[i, k, a, b]:
                        tests[i, k, a] |= 1 << b
    levels = 4**u
    lane = np.zeros((f, n, levels, LANES), np.float32)
    for i in range(f):
        for a in range(n):
            plain = np.zeros(LANES)
            _subset_sums(form.change[i, a], 0, plain)
            for k in range(levels):
                for x in range(LANES):
                    value = plain[x]
                    for j in range(u):
                        level = k >> (2 * j) & 3
                        for test in range(level):
                            if tests[j, test, a] & x:
                                level = test
                                break
                        value += form.touch[i, j, level]
                    if i == 0 and form.before[a] & (LANES - 1) & ~x:
                        value = np.inf
                    lane[i, a, k, x] = value
    t = max(2, len(form.of))
    own, of, slope = np.zeros((t, n), np.float32), np.zeros(t, np.int64), np.zeros((f, t), np.float32)
    for k in range(len(form.of)):
        own[k], of[k], slope[:, k] = form.own[k], form.of[k], form.slope[:, k]
    ones, share = np.empty(LANES, np.int64), np.empty((n, LANES), np.float32)
    for x in range(LANES):
        ones[x] = _bits(x)
        for above in range(n):
            share[above, x] = 1 / max(form.count + above + ones[x], 1)
    ranked, stated = np.zeros(f, np.bool_), np.zeros(f, np.bool_)
    for i in range(f):
        ranked[i] = (form.rank[i] != 0).any()
        stated[i] = (form.state[i] != 0).any() or (form.drift[i] != 0).any()
    return Rows(
        middle, top, lane, levels, sum_middle.astype(np.float32), sum_top.astype(np.float32), sum_lane.astype(np.float32), tests,
        form.reached, form.before, own, of, slope, form.drift.astype(np.float32),
        ranked, _padded(form.rank), form.state.astype(np.float32), flip, form.pair, form.weight.astype(np.float32), stated,
        ones, share, row, extra,
    )  # fmt: skip


@nb.njit(cache=True, nogil=True)
def _padded(rank: Array) -> Single:
    """One more row, for the full set."""
    out = np.zeros((len(rank), rank.shape[1] + 1, rank.shape[2]), np.float32)
    out[:, :-1] = rank
    return out


@nb.njit(cache=True, nogil=True)
def _subset_sums(values: Array, first: int, out: Array) -> None:
    """out[s] = the sum of values[first + i] over the bits i of s."""
    bits = 0
    while 1 << bits < len(out):
        for s in range(1 << bits):
            out[(1 << bits) | s] = out[s] + values[first + bits]
        bits += 1


@nb.njit(cache=True, nogil=True)
def _subset_rows(change: Array, first: int, out: Single) -> None:
    """out[s, a] = the sum of change[a, first + i] over the bits i of s."""
    bits = 0
    while 1 << bits < len(out):
        for s in range(1 << bits):
            for a in range(len(change)):
                out[(1 << bits) | s, a] = out[s, a] + np.float32(change[a, first + bits])
        bits += 1


@nb.njit(inline="always")
def _bits(x: int) -> int:
    n = 0
    while x:
        x &= x - 1
        n += 1
    return n


@nb.njit(cache=True, nogil=True, fastmath=FAST, error_model="numpy", _nrt=False)
def fill_superblock(
    rows: Rows, sets: Single, v: Single, top: int, mean: Single, state: Single, value: Single, low: Single, best: Single, fixed: Single
) -> None:
    """V of every state whose topmost bits are `top`; those with more of them are filled in already.

    `sets` (G', 2^N) holds the values of sets; one row serves a value and the same value of the unfinished set.
    """
    f, middles, n = rows.middle.shape
    simple = len(rows.weight) == 0 and len(rows.extra) == 0 and not rows.ranked[0] and len(rows.of) <= 2
    full, shift = np.int64((1 << n) - 1), _bits(middles - 1)
    for m in range(middles - 1, -1, -1):
        base = ((np.int64(top) << shift) | m) << LOW
        above = _bits(base)
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
            if rows.before[a] & ~base & ~(LANES - 1):
                out[:] = np.inf
                continue
            level = _level(rows, base, a)
            if simple and a >= LOW:
                _simple_minimum(rows, fixed[0, a], rows.lane[0, a, level], mean, a, v[base | bit : (base | bit) + LANES], best)
                continue
            _costs(rows, fixed, mean, state, level, a, above, base, value, out)
            if a >= LOW:
                _take_minimum(best, out, v[base | bit : (base | bit) + LANES])
        _inside(low, best, v[base : base + LANES], state[0], base + LANES - 1 == full)


@nb.njit(cache=True, nogil=True, fastmath=FAST, inline="always")
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


@nb.njit(cache=True, nogil=True, fastmath=FAST, inline="always")
def _add_multiple(out: Single, factor: np.float32, values: Single) -> None:
    for x in range(LANES):
        out[x] += factor * values[x]


@nb.njit(cache=True, nogil=True, inline="always")
def _level(rows: Rows, base: int, a: int) -> int:
    """Which tests the high bits pass, two bits per cascade."""
    out = 0
    for u in range(len(rows.reached)):
        level = rows.reached[u, a]
        for k in range(level):
            if rows.tests[u, k, a] & base:
                level = k
                break
        out |= level << (2 * u)
    return out


@nb.njit(cache=True, nogil=True, fastmath=FAST, inline="always")
def _simple_minimum(rows: Rows, start: np.float32, lane: Single, mean: Single, a: int, after: Single, best: Single) -> None:
    """The usual case in one pass: no product, no table, at most two means."""
    slope, own, one = rows.slope[0, 0], rows.own[0, a], mean[rows.of[0]]
    other_slope, other, two = rows.slope[0, 1], rows.own[1, a], mean[rows.of[1]]
    for x in range(LANES):
        cost = start + lane[x] + slope * abs(own - one[x]) + other_slope * abs(other - two[x]) + after[x]
        best[x] = cost if cost < best[x] else best[x]


@nb.njit(cache=True, nogil=True, fastmath=FAST, inline="always")
def _take_minimum(best: Single, cost: Single, after: Single) -> None:
    for x in range(LANES):
        total = cost[x] + after[x]
        best[x] = total if total < best[x] else best[x]


@nb.njit(cache=True, nogil=True, fastmath=FAST, inline="always")
def _sum_of(rows: Rows, i: int, start: np.float32, lane: Single, mean: Single, above: int, a: int, out: Single) -> None:
    """F_i without its state part, for all lanes."""
    slope, own, one = rows.slope[i, 0], rows.own[0, a], mean[rows.of[0]]
    other_slope, other, two = rows.slope[i, 1], rows.own[1, a], mean[rows.of[1]]
    for x in range(LANES):
        out[x] = start + lane[x] + slope * abs(own - one[x]) + other_slope * abs(other - two[x])
    for t in range(2, len(rows.of)):
        slope, own, m = rows.slope[i, t], rows.own[t, a], mean[rows.of[t]]
        if slope != 0:
            for x in range(LANES):
                out[x] += slope * abs(own - m[x])
    if rows.ranked[i]:
        for x in range(LANES):
            out[x] += rows.rank[i, above + rows.ones[x], a]


@nb.njit(cache=True, nogil=True, fastmath=FAST, inline="always")
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


@nb.njit(cache=True, nogil=True, fastmath=FAST, _nrt=False)
def _inside(low: Single, best: Single, v: Single, state: Single, full: bool) -> None:
    """The regions of the low bits, whose successors lie in the block itself: eight lanes at a time from the last.

    Once eight lanes are final they serve the lanes without bit 3, sixteen those without bit 4, thirty-two those without bit 5.
    """
    for at in range(LANES - 8, -1, -8):
        v7 = best[at + 7] + state[at + 7]
        if full and at == LANES - 8:
            v7 = np.float32(0)
        v6 = min(best[at + 6], low[0, at + 6] + v7) + state[at + 6]
        v5 = min(best[at + 5], low[1, at + 5] + v7) + state[at + 5]
        v3 = min(best[at + 3], low[2, at + 3] + v7) + state[at + 3]
        v4 = min(best[at + 4], min(low[0, at + 4] + v5, low[1, at + 4] + v6)) + state[at + 4]
        v2 = min(best[at + 2], min(low[0, at + 2] + v3, low[2, at + 2] + v6)) + state[at + 2]
        v1 = min(best[at + 1], min(low[1, at + 1] + v3, low[2, at + 1] + v5)) + state[at + 1]
        v0 = min(min(best[at], low[0, at] + v1), min(low[1, at] + v2, low[2, at] + v4)) + state[at]
        v[at], v[at + 1], v[at + 2], v[at + 3] = v0, v1, v2, v3
        v[at + 4], v[at + 5], v[at + 6], v[at + 7] = v4, v5, v6, v7
        for a in range(3, LOW):
            bit = 1 << a
            if at & (2 * bit - 1) == bit:  # `bit` lanes from here on are final
                _serve(best[at - bit : at], low[a, at - bit : at], v[at : at + bit])


@nb.njit(cache=True, nogil=True, fastmath=FAST, inline="always")
def _serve(best: Single, cost: Single, after: Single) -> None:
    for x in range(len(best)):
        total = cost[x] + after[x]
        best[x] = total if total < best[x] else best[x]


@nb.njit(cache=True, nogil=True)
def _one(rows: Rows, sets: Single, v: Single, top: int) -> None:
    f, n = rows.middle.shape[0], rows.middle.shape[2]
    mean, state = np.zeros((max(2, len(rows.sum_lane)), LANES), np.float32), np.empty((f, LANES), np.float32)
    value, low = np.empty((f, LANES), np.float32), np.empty((LOW, LANES), np.float32)
    best, fixed = np.empty(LANES, np.float32), np.empty((f, n), np.float32)
    fill_superblock(rows, sets, v, top, mean, state, value, low, best, fixed)


@nb.njit(cache=True, nogil=True)
def fill(rows: Rows, sets: Single, v: Single) -> None:
    """V of every state, one thread."""
    for top in range(rows.top.shape[1] - 1, -1, -1):
        _one(rows, sets, v, top)


@nb.njit(cache=True, nogil=True, parallel=True)
def fill_parallel(rows: Rows, sets: Single, v: Single) -> None:
    """V of every state; superblocks with equally many topmost regions at the same time."""
    tops = rows.top.shape[1]
    most = _bits(tops - 1)
    layer = np.empty(tops, np.int64)
    for ones in range(most, -1, -1):
        size = 0
        for top in range(tops - 1, -1, -1):
            if _bits(top) == ones:
                layer[size] = top
                size += 1
        for i in nb.prange(size):
            _one(rows, sets, v, layer[i])
