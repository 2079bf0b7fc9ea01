"""Dynamic programs over sets of finished regions, compiled.

A state is a bit mask of finished regions; bit a is region a. Every successor of a state is a larger number, so one pass
from the full set downwards meets each state after its successors. Negative costs are no problem, unlike for Dijkstra.
"""

import numba as nb
import numpy as np
from numpy.typing import NDArray

from app.geometry.tool import Array


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
