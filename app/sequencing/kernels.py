"""The dynamic program over sets of finished regions on a table of all costs: the plainest form of what `block` does.

A state is a bit mask of finished regions; bit a is region a. Every successor of a state is a larger number, so one pass
from the full set downwards meets each state after its successors. Negative costs are no problem, unlike for Dijkstra.
"""

import numpy as np
from numpy.typing import NDArray

from app.geometry.compiled import kernel
from app.geometry.tool import Array


@kernel
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


@kernel
def sums_along(table: Array, order: NDArray[np.int64]) -> Array:
    """Values added along an order, (C,), from a table of the values of all transitions (2^n, n, C)."""
    out, s = np.zeros(table.shape[2]), 0
    for a in order:
        for c in range(len(out)):
            out[c] += table[s, a, c]
        s |= 1 << a
    return out
