"""Exact re-insertion: take a few regions out of a stretch of a sequence and put them back where the whole is cheapest.

Every cost depends on the set of finished regions only. With the other regions of the stretch kept in their order, a state
is (how many of those are finished, which of the taken ones are finished): a dynamic program over rest x 2^k. When every
region of the stretch is taken, this is the best order of the stretch (the window).
"""

# pyright: reportArgumentType=false, reportPossiblyUnboundVariable=false
# Compiled code: the checker takes elements of arrays for arrays.

import numba as nb
import numpy as np
from numpy.typing import NDArray

from app.geometry.tool import Array
from app.sequencing.problem import SequencingProblem, all_sets
from app.sequencing.transitions import Model, gap_of, grow_box, no_box, transition_cost

Order = NDArray[np.int64]


@nb.njit(cache=True, nogil=True, error_model="numpy")
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


@nb.njit(cache=True, nogil=True, error_model="numpy")
def add_finished(m: Model, b: int, border: Array, edge: NDArray[np.int64], corner: NDArray[np.int64]) -> None:
    """Note for every region that b is finished."""
    for a in range(m.n):
        border[a, 0] += m.shared[a, b]
        border[a, 1] += m.opposite[a, b]
        border[a, 2] += m.turn[a, b]
        edge[a] += m.edge[a, b]
        corner[a] += m.corner[a, b]


@nb.njit(cache=True, nogil=True, error_model="numpy")
def reinsert(
    m: Model, order: Order, done: NDArray[np.bool_], before: NDArray[np.bool_], start: int, stop: int, taken: Order, out: Order
) -> bool:
    """Fill `out` with the best order that moves only the regions at positions `taken`, all within start .. stop - 1.

    `before[b, a]`: b has to come before a. False when no such order is allowed (`out` is then the order itself).
    """
    k, n = len(taken), m.n
    out[:] = order
    rest = np.empty(stop - start - k, np.int64)
    items = order[taken]
    slot = np.full(n, -1)  # which item a region is
    for i in range(k):
        slot[items[i]] = i
    r = 0
    for p in range(start, stop):
        if slot[order[p]] < 0:
            rest[r] = order[p]
            r += 1
    full = (1 << k) - 1
    phi, extra = np.zeros(len(m.w) + 1), np.zeros(3)
    # what the subsets of the items add
    sub_border, sub_next = np.zeros((full + 1, k, 3)), np.zeros((full + 1, 3))
    sub_curve, sub_level, sub_count = np.zeros(full + 1), np.zeros(full + 1), np.zeros(full + 1, np.int64)
    low_item = np.zeros(full + 1, np.int64)
    for s in range(1, full + 1):
        i = 0
        while not s >> i & 1:
            i += 1
        b, parent = items[i], s & (s - 1)
        low_item[s] = i
        sub_curve[s], sub_level[s] = sub_curve[parent] + m.curvature[b], sub_level[parent] + m.level[b]
        sub_count[s] = sub_count[parent] + 1
        for j in range(k):
            sub_border[s, j, 0] = sub_border[parent, j, 0] + m.shared[items[j], b]
            sub_border[s, j, 1] = sub_border[parent, j, 1] + m.opposite[items[j], b]
            sub_border[s, j, 2] = sub_border[parent, j, 2] + m.turn[items[j], b]
    item_edge, item_corner, item_need = np.zeros(k, np.int64), np.zeros(k, np.int64), np.zeros(k, np.int64)
    item_ready = np.zeros(k, np.int64)  # rest regions that have to be finished first
    for i in range(k):
        for j in range(k):
            item_edge[i] |= np.int64(m.edge[items[i], items[j]]) << j
            item_corner[i] |= np.int64(m.corner[items[i], items[j]]) << j
            item_need[i] |= np.int64(before[items[j], items[i]]) << j
        for j in range(r):
            if before[rest[j], items[i]]:
                item_ready[i] = j + 1
    # the prefix
    border, edge, corner = np.zeros((n, 3)), np.zeros(n, np.int64), np.zeros(n, np.int64)
    finished = done.copy()
    count, curve, level = 0, 0.0, 0.0
    boxes, after = np.full((full + 1, 7), np.nan), np.full((full + 1, 7), np.nan)
    no_box(boxes, 0)
    for p in range(start):
        finished[order[p]] = True
    for b in range(n):
        if finished[b]:
            count, curve, level = count + 1, curve + m.curvature[b], level + m.level[b]
            add_finished(m, b, border, edge, corner)
            grow_box(m, boxes, 0, 0, b)
    # boxes of what is unfinished apart from the items, from each rest region on
    tails = np.full((r + 1, 7), np.nan)
    no_box(tails, r)
    within = np.zeros(n, np.bool_)
    for p in range(start, stop):
        within[order[p]] = True
    for b in range(n):
        if not finished[b] and not within[b]:
            grow_box(m, tails, r, r, b)
    for j in range(r - 1, -1, -1):
        grow_box(m, tails, j, j + 1, rest[j])
    value, came = np.full((r + 1, full + 1), np.inf), np.full((r + 1, full + 1), -1, np.int8)
    value[0, 0] = 0.0
    for j in range(r + 1):
        after[full] = tails[j]
        for s in range(full - 1, -1, -1):
            i = 0
            while s >> i & 1:
                i += 1
            grow_box(m, after, s, s | 1 << i, items[i])
        a, need = -1, 0
        if j < r:
            a = rest[j]
            next_edge, next_corner = 0, 0
            for i in range(k):
                next_edge |= np.int64(m.edge[a, items[i]]) << i
                next_corner |= np.int64(m.corner[a, items[i]]) << i
                need |= np.int64(before[items[i], a]) << i
        for s in range(full + 1):
            if s:
                b, parent = items[low_item[s]], s & (s - 1)
                grow_box(m, boxes, s, parent, b)
                if a >= 0:
                    sub_next[s, 0] = sub_next[parent, 0] + m.shared[a, b]
                    sub_next[s, 1] = sub_next[parent, 1] + m.opposite[a, b]
                    sub_next[s, 2] = sub_next[parent, 2] + m.turn[a, b]
            spent = value[j, s]
            if spent == np.inf:
                continue
            gaps, left = gap_of(boxes, s), gap_of(after, s)
            many, bend, high = count + sub_count[s], curve + sub_curve[s], level + sub_level[s]
            for i in range(k):
                if s >> i & 1 or item_ready[i] > j or item_need[i] & ~s:
                    continue
                c, f = items[i], m.first[items[i]]
                beside = f >= 0 and (finished[f] or (slot[f] >= 0 and s >> slot[f] & 1))
                for q in range(3):
                    extra[q] = border[c, q] + sub_border[s, i, q]
                has_edge, has_corner = edge[c] > 0 or item_edge[i] & s != 0, corner[c] > 0 or item_corner[i] & s != 0
                x = spent + transition_cost(m, c, many, bend, high, extra, has_edge, has_corner, beside, gaps, left, phi)
                if x < value[j, s | 1 << i]:
                    value[j, s | 1 << i] = x
                    came[j, s | 1 << i] = i
            if a >= 0 and not need & ~s:
                f = m.first[a]
                beside = f >= 0 and (finished[f] or (slot[f] >= 0 and s >> slot[f] & 1))
                for q in range(3):
                    extra[q] = border[a, q] + sub_next[s, q]
                has_edge, has_corner = edge[a] > 0 or next_edge & s != 0, corner[a] > 0 or next_corner & s != 0
                x = spent + transition_cost(m, a, many, bend, high, extra, has_edge, has_corner, beside, gaps, left, phi)
                if x < value[j + 1, s]:
                    value[j + 1, s] = x
                    came[j + 1, s] = k
        if a >= 0:
            finished[a] = True
            count, curve, level = count + 1, curve + m.curvature[a], level + m.level[a]
            add_finished(m, a, border, edge, corner)
            grow_box(m, boxes, 0, 0, a)
    if value[r, full] == np.inf:
        return False
    j, s = r, full
    for p in range(stop - 1, start - 1, -1):
        i = came[j, s]
        if i == k:
            j -= 1
            out[p] = rest[j]
        else:
            s ^= 1 << i
            out[p] = items[i]
    return True


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
