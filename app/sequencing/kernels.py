"""Dynamic programs over sets of finished regions, compiled.

A state is a bit mask of finished regions; bit a is region a. Every successor of a state is a larger number, so one pass
from the full set downwards meets each state after its successors. Negative costs are no problem, unlike for Dijkstra.
"""

import numba as nb
import numpy as np
from numpy.typing import NDArray

from app.geometry.tool import Array
from app.sequencing.gaps import box_gaps


@nb.njit(cache=True)
def lowest_to_go(c: Array, n: int) -> Array:
    """Cheapest cost from every state to the full set, (2^n,). `c` is (2^n, n)."""
    full = (1 << n) - 1
    v = np.zeros(full + 1)
    for s in range(full - 1, -1, -1):
        best = np.inf
        for a in range(n):
            if not (s >> a) & 1:
                best = min(best, c[s, a] + v[s | 1 << a])
        v[s] = best
    return v


@nb.njit(cache=True)
def range_to_go(g: Array, start: int, n: int, low: Array, high: Array) -> None:
    """Fill in the smallest and largest total still possible of P quantities for the states of one block.

    `g` (M, n, P) holds the quantities from the states start, start + 1, ...; `low` and `high` (2^n, P) are complete above
    the block and zero at the full set.
    """
    width, full = g.shape[2], (1 << n) - 1
    for i in range(g.shape[0] - 1, -1, -1):
        s = start + i
        if s == full:
            continue
        low[s, :], high[s, :] = np.inf, -np.inf
        for a in range(n):
            t = s | 1 << a
            if t != s:
                for p in range(width):
                    low[s, p] = min(low[s, p], g[i, a, p] + low[t, p])
                    high[s, p] = max(high[s, p], g[i, a, p] + high[t, p])


@nb.njit(cache=True)
def count_lowest(c: Array, v: Array, n: int, tolerance: float) -> NDArray[np.int64]:
    """Number of cheapest completions of every state, (2^n,). Fits 64 bits up to n = 20, where 20! orders are 2.4e18."""
    full = (1 << n) - 1
    ties = np.zeros(full + 1, np.int64)
    ties[full] = 1
    for s in range(full - 1, -1, -1):
        for a in range(n):
            t = s | 1 << a
            if t != s and c[s, a] + v[t] <= v[s] + tolerance:
                ties[s] += ties[t]
    return ties


@nb.njit(cache=True)
def largest_sum(c: Array, n: int) -> float:
    """The sum of each region's largest absolute cost: no sequence's cost is farther from zero."""
    top = np.zeros(n)
    for s in range((1 << n) - 1):
        for a in range(n):
            if not (s >> a) & 1:
                top[a] = max(top[a], abs(c[s, a]))
    return top.sum()


@nb.njit(cache=True)
def lowest_so_far(c: Array, n: int) -> Array:
    """Cheapest cost from the empty set to every state, (2^n,)."""
    f = np.full(1 << n, np.inf)
    f[0] = 0.0
    for s in range((1 << n) - 1):
        for a in range(n):
            t = s | 1 << a
            if t != s:
                f[t] = min(f[t], f[s] + c[s, a])
    return f


@nb.njit(cache=True)
def class_bound(c: Array, so_far: Array, to_go: Array, n: int, k: int, tolerance: float) -> float:
    """A cost that the k-th distinct class does not exceed; infinite when fewer than k costs were seen.

    The cheapest sequence through each transition is a real one, so k of their costs that lie more than the tolerance
    apart belong to k classes.
    """
    seen, filled = np.empty(k + 1), 0
    for s in range((1 << n) - 1):
        for a in range(n):
            t = s | 1 << a
            if t == s:
                continue
            x = so_far[s] + c[s, a] + to_go[t]
            if filled == k and x >= seen[k - 1]:
                continue
            at = np.searchsorted(seen[:filled], x)
            if (at > 0 and x - seen[at - 1] <= tolerance) or (at < filled and seen[at] - x <= tolerance):
                continue
            for q in range(filled, at, -1):
                seen[q] = seen[q - 1]
            seen[at] = x
            filled = min(filled + 1, k)
    return seen[k - 1] if filled == k else np.inf


@nb.njit(cache=True)
def distinct_classes(
    c: Array, to_go: Array, n: int, k: int, tolerance: float
) -> tuple[Array, NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """The k lowest distinct totals and how many sequences have each.

    A k-way merge of the successors' sorted lists, in the states that some sequence of these classes passes through; a
    total joins the class opened below it when within the tolerance.

    Returns:
        Totals and counts (S, k) from each of S kept states, how many of the k are there (S,), and the row of each state
        (2^n,), -1 where not kept.
    """
    full, so_far = (1 << n) - 1, lowest_so_far(c, n)
    limit = class_bound(c, so_far, to_go, n, k, tolerance) + 2 * tolerance
    row = np.where(so_far + to_go <= limit, 0, -1)
    row[row == 0] = np.arange((row == 0).sum())
    kept = row.max() + 1
    best, many, filled = np.empty((kept, k)), np.empty((kept, k), np.int64), np.zeros(kept, np.int64)
    best[row[full], 0], many[row[full], 0], filled[row[full]] = 0.0, 1, 1
    head = np.zeros(n, np.int64)
    for s in range(full - 1, -1, -1):
        i = row[s]
        if i < 0:
            continue
        head[:] = 0
        while True:
            value, who = np.inf, -1
            for a in range(n):
                j = row[s | 1 << a]
                if not (s >> a) & 1 and j >= 0 and head[a] < filled[j]:
                    x = c[s, a] + best[j, head[a]]
                    if x < value:
                        value, who = x, a
            if who < 0 or so_far[s] + value > limit:
                break
            j = row[s | 1 << who]
            if filled[i] and value - best[i, filled[i] - 1] <= tolerance:
                many[i, filled[i] - 1] += many[j, head[who]]
            elif filled[i] == k:
                break
            else:
                best[i, filled[i]], many[i, filled[i]] = value, many[j, head[who]]
                filled[i] += 1
            head[who] += 1
    return best, many, filled, row


@nb.njit(cache=True)
def members_within(g: Array, n: int, target: Array, low: Array, high: Array, slack: Array, cap: int) -> tuple[NDArray[np.int64], bool]:
    """Orders whose totals of all P quantities equal `target` within `slack`, lowest ids first, at most `cap` of them.

    Depth-first; a prefix is dropped when some remaining total leaves what is still possible. `g` is (2^n, n, P), `low`
    and `high` are (2^n, P). Returns the orders (found, n) and whether these are all.
    """
    width, full = g.shape[2], (1 << n) - 1
    out = np.zeros((cap, n), np.int64)
    spent, state, todo = np.zeros((n + 1, width)), np.zeros(n + 1, np.int64), np.zeros(n + 1, np.int64)
    depth, found = 0, 0
    while depth >= 0:
        s, a = state[depth], todo[depth]
        if a == n:
            depth -= 1
            continue
        todo[depth] = a + 1
        t = s | 1 << a
        if t == s:
            continue
        possible = True
        for p in range(width):
            spent[depth + 1, p] = spent[depth, p] + g[s, a, p]
            rest = target[p] - spent[depth + 1, p]
            if rest < low[t, p] - slack[p] or rest > high[t, p] + slack[p]:
                possible = False
                break
        if not possible:
            continue
        if t == full:
            if found == cap:
                return out, False
            for q in range(n):
                out[found, q] = todo[q] - 1
            found += 1
            continue
        depth += 1
        state[depth], todo[depth] = t, 0
    return out[:found], True


@nb.njit(cache=True)
def last_regions(c: Array, v: Array, n: int, tolerance: float) -> NDArray[np.int64]:
    """Bit mask of the regions that some cheapest completion of each state ends with, (2^n,)."""
    full = (1 << n) - 1
    last = np.zeros(full + 1, np.int64)
    for s in range(full - 1, -1, -1):
        for a in range(n):
            t = s | 1 << a
            if t != s and c[s, a] + v[t] <= v[s] + tolerance:
                last[s] |= 1 << a if t == full else last[t]
    return last


def warm_up() -> None:
    """Compile or load every kernel, so that the first click doesn't wait for it."""
    c = np.ones((4, 2))
    v = lowest_to_go(c, 2)
    range_to_go(c[:, :, None], 0, 2, v[:, None].copy(), v[:, None].copy())
    box_gaps(np.ones((1, 2), np.bool_), c[:2], c[:2], v, True)
    count_lowest(c, v, 2, 1e-9)
    last_regions(c, v, 2, 1e-9)
    largest_sum(c, 2)
    distinct_classes(c, v, 2, 2, 1e-9)
    members_within(c[:, :, None], 2, np.array([2.0]), v[:, None], v[:, None], np.array([1e-9]), 2)
