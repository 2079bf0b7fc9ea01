"""Exact re-insertion: take a few regions out of a stretch of a sequence and put them back where the whole is cheapest.

Every cost depends on the set of finished regions only. With the other regions of the stretch kept in their order, a state
is (how many of those are finished, which of the taken ones are finished): a dynamic program over rest x 2^k. When every
region of the stretch is taken, this is the best order of the stretch (the window).
"""

# pyright: reportArgumentType=false, reportPossiblyUnboundVariable=false
# Compiled code: the checker takes elements of arrays for arrays.

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.geometry.compiled import kernel
from app.geometry.tool import Array
from app.sequencing.problem import SequencingProblem, all_sets
from app.sequencing.transitions import Model, gap_of, grow_box, no_box, transition_cost

Order = NDArray[np.int64]


@kernel(nogil=True, error_model="numpy")
def order_cost(m: Model, order: Order, done: NDArray[np.bool_]) -> float:
    """Cost of the order after the regions of `done`; regions in neither are never worked on but count as unfinished."""
    phi, boxes, border = np.zeros(len(m.w) + 1), np.zeros((m.n + 2, 7)), np.zeros((m.n, 3))
    edge, corner = np.zeros(m.n, np.int64), np.zeros(m.n, np.int64)
    inside = done.copy()
    for b in order:
        inside[b] = True
    last = len(order)
    no_box(boxes, last)
    for b in range(m.n):
        if not inside[b]:
            grow_box(m, boxes, last, last, b)
    for p in range(last - 1, -1, -1):
        grow_box(m, boxes, p, p + 1, order[p])
    count, curve, level, total = 0, 0.0, 0.0, 0.0
    no_box(boxes, m.n + 1)
    inside[:] = done
    for b in range(m.n):
        if done[b]:
            count, curve, level = count + 1, curve + m.curvature[b], level + m.level[b]
            add_finished(m, b, border, edge, corner)
            grow_box(m, boxes, m.n + 1, m.n + 1, b)
    for p in range(last):
        a = order[p]
        beside = m.first[a] >= 0 and inside[m.first[a]]
        gaps, left = gap_of(boxes, m.n + 1), gap_of(boxes, p)
        total += transition_cost(m, a, count, curve, level, border[a], edge[a] > 0, corner[a] > 0, beside, gaps, left, phi)
        count, curve, level = count + 1, curve + m.curvature[a], level + m.level[a]
        inside[a] = True
        add_finished(m, a, border, edge, corner)
        grow_box(m, boxes, m.n + 1, m.n + 1, a)
    return total


@kernel(nogil=True, error_model="numpy")
def add_finished(m: Model, b: int, border: Array, edge: NDArray[np.int64], corner: NDArray[np.int64]) -> None:
    """Note for every region that b is finished."""
    for a in range(m.n):
        border[a, 0] += m.shared[a, b]
        border[a, 1] += m.opposite[a, b]
        border[a, 2] += m.turn[a, b]
        edge[a] += m.edge[a, b]
        corner[a] += m.corner[a, b]


class Past(NamedTuple):
    """What is finished before the stretch, or by the regions of it that stay."""

    finished: NDArray[np.bool_]  # (N,)
    sums: Array  # (3,) number, curvature, level
    border: Array  # (N, 3) taken of each one's shared border, opposite border and turn
    edge: Order  # (N,) neighbours
    corner: Order  # (N,)


class Choice(NamedTuple):
    """The k regions taken out, their subsets, and in the last place the next of the regions that stay."""

    region: Order  # (k + 1,)
    slot: Order  # (N,) which of the k a region is, -1 for others
    edge: Order  # (k + 1,) neighbours among the k, as bits
    corner: Order  # (k + 1,)
    need: Order  # (k + 1,) those of the k that have to be finished first, as bits
    ready: Order  # (k + 1,) how many of those that stay have to be
    lowest: Order  # (2^k,) lowest bit
    sums: Array  # (2^k, 3) number, curvature, level
    border: Array  # (2^k, k + 1, 3) what a subset takes of each one's borders and turn
    boxes: Array  # (2^k, 7) box around what is finished
    after: Array  # (2^k, 7) and around the rest


@kernel(nogil=True, error_model="numpy")
def reinsert(
    m: Model, order: Order, done: NDArray[np.bool_], before: NDArray[np.bool_], start: int, stop: int, taken: Order, out: Order
) -> bool:
    """Fill `out` with the best order that moves only the regions at positions `taken`, all within start .. stop - 1.

    `before[b, a]`: b has to come before a. False when no such order is allowed (`out` is then the order itself).
    """
    k, out[:] = len(taken), order
    c = _choose(m, order[taken], before)
    stay = np.empty(stop - start - k, np.int64)
    r = 0
    for p in range(start, stop):
        if c.slot[order[p]] < 0:
            stay[r] = order[p]
            r += 1
    for i in range(k):
        for j in range(r):
            if before[stay[j], c.region[i]]:
                c.ready[i] = j + 1
    past = _past(m, order[:start], done, c)
    tails = _tails(m, past.finished, order[start:stop], stay)
    value, came = np.full((r + 2, 1 << k), np.inf), np.full((r + 2, 1 << k), -1, np.int8)
    value[0, 0] = 0.0
    for j in range(r + 1):
        if j < r:
            _meet(m, c, stay[j], before)
        _layer_boxes(m, c, tails[j])
        _layer(m, c, past, j, j < r, value, came)
        if j < r:
            _finish(m, past, c, stay[j])
    if value[r, (1 << k) - 1] == np.inf:
        return False
    _write(c.region, stay, came, start, stop, out)
    return True


@kernel(nogil=True, error_model="numpy")
def _choose(m: Model, items: Order, before: NDArray[np.bool_]) -> Choice:
    k, region = len(items), np.zeros(len(items) + 1, np.int64)
    size, slot = 1 << k, np.full(m.n, -1)
    region[:k] = items
    edge, corner, need, ready = (np.zeros(k + 1, np.int64), np.zeros(k + 1, np.int64), np.zeros(k + 1, np.int64), np.zeros(k + 1, np.int64))
    lowest, sums, border = np.zeros(size, np.int64), np.zeros((size, 3)), np.zeros((size, k + 1, 3))
    boxes, after = np.full((size, 7), np.nan), np.full((size, 7), np.nan)
    c = Choice(region, slot, edge, corner, need, ready, lowest, sums, border, boxes, after)
    for s in range(1, size):
        i, parent = 0, s & (s - 1)
        while not s >> i & 1:
            i += 1
        lowest[s] = i
        sums[s, 0], sums[s, 1], sums[s, 2] = (
            sums[parent, 0] + 1,
            sums[parent, 1] + m.curvature[items[i]],
            sums[parent, 2] + m.level[items[i]],
        )
    for i in range(k):
        slot[items[i]] = i
        _join(m, c, i, before)
    return c


@kernel(nogil=True, error_model="numpy")
def _join(m: Model, c: Choice, i: int, before: NDArray[np.bool_]) -> None:
    """What the k regions mean to the one in place i."""
    a, k = c.region[i], len(c.region) - 1
    c.edge[i], c.corner[i], c.need[i] = 0, 0, 0
    for j in range(k):
        b = c.region[j]
        c.edge[i] |= np.int64(m.edge[a, b]) << j
        c.corner[i] |= np.int64(m.corner[a, b]) << j
        c.need[i] |= np.int64(before[b, a]) << j
    for s in range(1, len(c.lowest)):
        b, parent = c.region[c.lowest[s]], s & (s - 1)
        c.border[s, i, 0] = c.border[parent, i, 0] + m.shared[a, b]
        c.border[s, i, 1] = c.border[parent, i, 1] + m.opposite[a, b]
        c.border[s, i, 2] = c.border[parent, i, 2] + m.turn[a, b]


@kernel(nogil=True, error_model="numpy")
def _meet(m: Model, c: Choice, a: int, before: NDArray[np.bool_]) -> None:
    """Region a is the next of those that stay."""
    c.region[-1] = a
    _join(m, c, len(c.region) - 1, before)


@kernel(nogil=True, error_model="numpy")
def _past(m: Model, prefix: Order, done: NDArray[np.bool_], c: Choice) -> Past:
    past = Past(done.copy(), np.zeros(3), np.zeros((m.n, 3)), np.zeros(m.n, np.int64), np.zeros(m.n, np.int64))
    no_box(c.boxes, 0)
    for b in range(m.n):
        if done[b]:
            _finish(m, past, c, b)
    for b in prefix:
        _finish(m, past, c, b)
    return past


@kernel(nogil=True, error_model="numpy")
def _finish(m: Model, past: Past, c: Choice, b: int) -> None:
    """Region b is finished whatever becomes of the k."""
    past.finished[b] = True
    past.sums[0], past.sums[1], past.sums[2] = past.sums[0] + 1, past.sums[1] + m.curvature[b], past.sums[2] + m.level[b]
    add_finished(m, b, past.border, past.edge, past.corner)
    grow_box(m, c.boxes, 0, 0, b)


@kernel(nogil=True, error_model="numpy")
def _tails(m: Model, finished: NDArray[np.bool_], stretch: Order, stay: Order) -> Array:
    """Boxes of what is unfinished apart from the k, from each region that stays on."""
    r, outside = len(stay), ~finished
    tails = np.full((r + 1, 7), np.nan)
    no_box(tails, r)
    for b in stretch:
        outside[b] = False
    for b in range(m.n):
        if outside[b]:
            grow_box(m, tails, r, r, b)
    for j in range(r - 1, -1, -1):
        grow_box(m, tails, j, j + 1, stay[j])
    return tails


@kernel(nogil=True, error_model="numpy")
def _layer_boxes(m: Model, c: Choice, tail: Array) -> None:
    """Boxes around what is finished and around the rest for every subset of the k."""
    full = len(c.lowest) - 1
    c.after[full] = tail
    for s in range(full - 1, -1, -1):
        i = c.lowest[full ^ s]
        grow_box(m, c.after, s, s | 1 << i, c.region[i])
    for s in range(1, full + 1):
        grow_box(m, c.boxes, s, s & (s - 1), c.region[c.lowest[s]])


@kernel(nogil=True, error_model="numpy")
def _layer(m: Model, c: Choice, past: Past, j: int, more: bool, value: Array, came: NDArray[np.int8]) -> None:
    """All steps where j of the regions that stay are finished; `more` says that another one is to come."""
    k, phi, border = len(c.region) - 1, np.zeros(len(m.w) + 1), np.zeros(3)
    for s in range(len(c.lowest)):
        if value[j, s] == np.inf:
            continue
        gaps, left = gap_of(c.boxes, s), gap_of(c.after, s)
        count, curve, level = int(past.sums[0] + c.sums[s, 0]), past.sums[1] + c.sums[s, 1], past.sums[2] + c.sums[s, 2]
        for i in range(k + 1 if more else k):
            if (i < k and (s >> i & 1 or c.ready[i] > j)) or c.need[i] & ~s:
                continue
            a = c.region[i]
            f = m.first[a]
            beside = f >= 0 and (past.finished[f] or (c.slot[f] >= 0 and s >> c.slot[f] & 1))
            for q in range(3):
                border[q] = past.border[a, q] + c.border[s, i, q]
            edge, corner = past.edge[a] > 0 or c.edge[i] & s != 0, past.corner[a] > 0 or c.corner[i] & s != 0
            x = value[j, s] + transition_cost(m, a, count, curve, level, border, edge, corner, beside, gaps, left, phi)
            to, then = (j, s | 1 << i) if i < k else (j + 1, s)
            if x < value[to, then]:
                value[to, then], came[to, then] = x, i


@kernel(nogil=True, error_model="numpy")
def _write(region: Order, stay: Order, came: NDArray[np.int8], start: int, stop: int, out: Order) -> None:
    """The way to the end, backwards."""
    k, j = len(region) - 1, len(stay)
    s = (1 << k) - 1
    for p in range(stop - 1, start - 1, -1):
        i = came[j, s]
        if i == k:
            j -= 1
            out[p] = stay[j]
        else:
            s ^= 1 << i
            out[p] = region[i]


def reinsert_by_values(
    problem: SequencingProblem,
    w: Array,
    order: Order,
    done: NDArray[np.bool_],
    before: NDArray[np.bool_],
    start: int,
    stop: int,
    taken: Order,
) -> Order:
    """The same as `reinsert` for features that are not compiled: all sets at once through their values."""
    items = order[taken]
    rest = np.array([a for a in order[start:stop] if a not in items], np.int64)
    subsets, prefix = all_sets(len(items)), done.copy()
    prefix[order[:start]] = True
    sets = np.repeat(np.repeat(prefix[None, None], len(subsets), axis=1), len(rest) + 1, axis=0)
    sets[:, :, items] = subsets
    sets[:, :, rest] = np.tri(len(rest) + 1, len(rest), k=-1, dtype=np.bool_)[:, None]
    flat = sets.reshape(-1, problem.n)
    waiting = np.zeros(problem.n, np.bool_)
    waiting[order[start:stop]] = True
    blocked = (~flat & waiting).astype(np.float64) @ before > 0
    cost = np.where(blocked | flat, np.inf, problem.values(flat) @ w).reshape(sets.shape)
    return np.concatenate([order[:start], _put_back(cost, items, rest), order[stop:]])


def _put_back(cost: Array, items: Order, rest: Order) -> Order:
    """The cheapest way through (rest finished, items finished), by the cost (R + 1, 2^k, N) of every next region."""
    count, k = len(rest), len(items)
    value, came = np.full(cost.shape[:2], np.inf), np.full(cost.shape[:2], -1)
    value[0, 0] = 0.0
    for j in range(count + 1):
        for s in range(1 << k):
            for i in (i for i in range(k) if not s >> i & 1):
                x = value[j, s] + cost[j, s, items[i]]
                if x < value[j, s | 1 << i]:
                    value[j, s | 1 << i], came[j, s | 1 << i] = x, i
            if j < count and value[j, s] + cost[j, s, rest[j]] < value[j + 1, s]:
                value[j + 1, s], came[j + 1, s] = value[j, s] + cost[j, s, rest[j]], k
    j, s, out = count, (1 << k) - 1, []
    while j or s:
        i = came[j, s]
        out.append(rest[j - 1] if i == k else items[i])
        j, s = (j - 1, s) if i == k else (j, s ^ 1 << i)
    return np.array(out[::-1], np.int64)
