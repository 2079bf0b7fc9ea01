"""Greedy merging of neighbouring clusters into ever larger primitives, fast enough for 100,000 triangles in seconds.

The cost of a cluster is an integral, so it never falls when the cluster grows: an old key in the heap is a lower bound and is
only computed again when it comes to the top. Then a textbook greedy's neighbour lists are not needed (Attene et al. 2006).
"""

from collections.abc import Callable

import numpy as np

from app.geometry.compiled import kernel
from app.geometry.fitting import AREA, NORMAL_WEIGHT
from app.geometry.merge_tree import Integers, MergeTree, sums_up
from app.geometry.quadrics import fit_any
from app.geometry.tool import Array

CHUNK = 20_000  # merges between two progress reports
RICH_BELOW = 3_000  # clusters left from which general quadrics are fitted too: they take longer, and small clusters need none


@kernel
def _push(key, pair, n, k, a, b):  # pragma: no cover - compiled
    i = n
    while i > 0:
        up = (i - 1) >> 1
        if key[up] <= k:
            break
        key[i] = key[up]
        pair[i, 0], pair[i, 1] = pair[up, 0], pair[up, 1]
        i = up
    key[i], pair[i, 0], pair[i, 1] = k, a, b
    return n + 1


@kernel
def _pop(key, pair, n):  # pragma: no cover - compiled
    n -= 1
    k, a, b, i = key[n], pair[n, 0], pair[n, 1], 0
    while True:
        child = 2 * i + 1
        if child >= n:
            break
        if child + 1 < n and key[child + 1] < key[child]:
            child += 1
        if key[child] >= k:
            break
        key[i] = key[child]
        pair[i, 0], pair[i, 1] = pair[child, 0], pair[child, 1]
        i = child
    key[i], pair[i, 0], pair[i, 1] = k, a, b
    return n


@kernel
def _root(parent, x):  # pragma: no cover - compiled
    top = x
    while parent[top] != top:
        top = parent[top]
    while parent[x] != top:
        parent[x], x = top, parent[x]
    return top


@kernel
def _first_time(table, a, b, total):  # pragma: no cover - compiled
    """Remember the pair in an open-addressing hash table; False when it was there."""
    value = a * total + b + 1
    mask = len(table) - 1
    at = (value * 0x9E3779B97F4A7C1) & mask
    while table[at] != 0:
        if table[at] == value:
            return False
        at = (at + 1) & mask
    table[at] = value
    return True


@kernel
def _fill(sums, slot, pairs, weight, rich, key, heap_pair):  # pragma: no cover - compiled
    out, n = np.empty(5), 0
    for e in range(len(pairs)):
        a, b = pairs[e, 0], pairs[e, 1]
        n = _push(key, heap_pair, n, fit_any(sums[slot[a]] + sums[slot[b]], weight, rich, out), a, b)
    return n


@kernel
def _advance(sums, slot, parent, key, heap_pair, n, table, weight, rich, merges, costs, done, until):  # pragma: no cover - compiled
    """Merge until `until` merges are done or nothing is left; returns (heap size, merges done)."""
    leaves, total = len(sums), len(parent)
    out = np.empty(5)
    while n > 0 and done < until:
        bound, a, b = key[0], heap_pair[0, 0], heap_pair[0, 1]
        n = _pop(key, heap_pair, n)
        ra, rb = _root(parent, a), _root(parent, b)
        if ra == rb:
            continue
        if ra == a and rb == b:  # the key is of these very clusters: nothing is cheaper
            z = leaves + done
            merges[done, 0], merges[done, 1], costs[done] = a, b, bound
            parent[a] = parent[b] = z
            slot[z] = slot[a]
            for k in range(sums.shape[1]):
                sums[slot[a], k] += sums[slot[b], k]
            done += 1
            continue
        if ra > rb:
            ra, rb = rb, ra
        if _first_time(table, ra, rb, total):
            value = fit_any(sums[slot[ra]] + sums[slot[rb]], weight, rich, out)
            n = _push(key, heap_pair, n, max(value, bound), ra, rb)
    return n, done


def _roots(parent: Integers, pairs: Integers) -> Integers:
    """Neighbouring clusters after the merges so far, each pair once."""
    top = parent[pairs]
    while (top != parent[top]).any():
        top = parent[top]
    return np.unique(np.sort(top[top[:, 0] != top[:, 1]], axis=1), axis=0)


def build_tree(sums: Array, leaf: Integers, pairs: Integers, progress: Callable[[float], None], weight: float = NORMAL_WEIGHT) -> MergeTree:
    """Merge clusters along the neighbour pairs until nothing is left to merge.

    Args:
        sums: (L, 54) numbers of the first clusters.
        leaf: (F,) first cluster of each face, or of whatever the tree is to label.
        pairs: (P, 2) neighbouring clusters.
        progress: Told the share done.
        weight: How far a normal error of 1 counts as a distance, diagonals.
    """
    leaves = len(sums)
    pairs = np.unique(np.sort(pairs, axis=1), axis=0).astype(np.int64) if len(pairs) else np.empty((0, 2), np.int64)
    work, slot, parent = sums.copy(), np.zeros(2 * leaves, np.int64), np.arange(2 * leaves)
    slot[:leaves] = np.arange(leaves)
    merges, costs, done = np.empty((leaves, 2), np.int64), np.empty(leaves), 0
    for rich in (False, True):
        until = leaves if rich else max(0, leaves - RICH_BELOW)
        pairs = _roots(parent, pairs)
        key, heap_pair = np.empty(len(pairs) + 1), np.empty((len(pairs) + 1, 2), np.int64)
        table = np.zeros(1 << max(10, int(np.ceil(np.log2(4 * len(pairs) + 4)))), np.int64)
        n = _fill(work, slot, pairs, weight, rich, key, heap_pair) if until > done else 0
        while n > 0 and done < until:
            stop = min(until, done + CHUNK)
            n, done = _advance(work, slot, parent, key, heap_pair, n, table, weight, rich, merges, costs, done, stop)
            progress(done / max(1, leaves - 1))
    return MergeTree(leaf.astype(np.int64), merges[:done].copy(), costs[:done].copy(), sums_up(merges[:done], sums[:, AREA]))


@kernel
def absorb_small(sums, pairs, least, wanted, weight):  # pragma: no cover - compiled
    """Give clusters below a share `least` of the area, smallest first, to the neighbour they fit best while more than `wanted` are left.

    Returns the cluster that each one belongs to then (P,), -1 for small ones without a neighbour.
    """
    n, out = len(sums), np.empty(5)
    total, pairs, into, alive = sums.copy(), pairs.copy(), np.arange(n), np.ones(n, np.bool_)
    area, left = total[:, AREA].sum(), n
    own = np.full(n, -1.0)  # cost of each cluster, once it is needed
    while left > max(wanted, 1):
        small = -1
        for k in range(n):
            if alive[k] and (small < 0 or total[k, AREA] < total[small, AREA]):
                small = k
        if total[small, AREA] >= least * area:
            break
        best, lowest = -1, np.inf
        for e in range(len(pairs)):
            if (pairs[e, 0] == small) != (pairs[e, 1] == small):
                other = pairs[e, 0] + pairs[e, 1] - small
                if other == best:
                    continue
                if own[other] < 0:
                    own[other] = fit_any(total[other], weight, True, out)
                extra = fit_any(total[small] + total[other], weight, True, out) - own[other]
                if extra < lowest or (extra == lowest and other < best):
                    best, lowest = other, extra
        alive[small] = False
        left -= 1
        if best < 0:
            area -= total[small, AREA]
        else:
            total[best] += total[small]
            own[best] = -1.0
        for k in range(n):
            if into[k] == small:
                into[k] = best
        for e in range(len(pairs)):
            for side in range(2):
                if pairs[e, side] == small:
                    pairs[e, side] = best
    return into
