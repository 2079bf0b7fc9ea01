"""The dynamic program of maximum-entropy IRL: every sequence in proportion to exp(-cost), summed exactly over 2^N sets."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from app.learning.qp import Array


@njit(cache=True)
def soft_to_go(values: Array, w: Array, n: int) -> tuple[Array, Array]:
    """-log of the sum of exp(-cost) from each set to the full one, and the probability of each next region.

    Args:
        values: Features of each transition, (2^N, N, F); entries of regions already done are not read.
        w: (F,).
        n: Number of regions.

    Returns:
        To go (2^N,), probability (2^N, N), zero where already done.
    """
    states, size = 1 << n, len(w)
    to_go, chosen = np.zeros(states), np.zeros((states, n))
    for s in range(states - 2, -1, -1):
        lowest = np.inf
        for a in range(n):
            if not s >> a & 1:
                cost = to_go[s | 1 << a]
                for k in range(size):
                    cost += values[s, a, k] * w[k]
                chosen[s, a] = cost
                lowest = min(lowest, cost)
        total = 0.0
        for a in range(n):
            if not s >> a & 1:
                chosen[s, a] = np.exp(lowest - chosen[s, a])
                total += chosen[s, a]
        for a in range(n):
            chosen[s, a] /= total
        to_go[s] = lowest - np.log(total)
    return to_go, chosen


@njit(cache=True)
def expected_sums(values: Array, chosen: Array, n: int) -> Array:
    """Expected feature sum (F,) of a sequence drawn region by region from `chosen` (2^N, N)."""
    states, size = 1 << n, values.shape[2]
    reached, total = np.zeros(states), np.zeros(size)
    reached[0] = 1.0
    for s in range(states - 1):
        if reached[s] > 0.0:
            for a in range(n):
                if not s >> a & 1:
                    p = reached[s] * chosen[s, a]
                    reached[s | 1 << a] += p
                    for k in range(size):
                        total[k] += p * values[s, a, k]
    return total


@njit(cache=True)
def drawn(chosen: Array, n: int, uniform: Array) -> NDArray[np.int64]:
    """Sequences drawn from `chosen`, one per row of uniform numbers (M, N)."""
    found = np.zeros(uniform.shape, np.int64)
    for m in range(len(uniform)):
        s = 0
        for step in range(n):
            left, pick = uniform[m, step], -1
            for a in range(n):
                if not s >> a & 1:
                    pick = a
                    left -= chosen[s, a]
                    if left < 0:
                        break
            found[m, step] = pick
            s |= 1 << pick
    return found


def warm_up() -> None:
    """Compile or load the kernels."""
    values = np.zeros((4, 2, 1))
    chosen = soft_to_go(values, np.zeros(1), 2)[1]
    expected_sums(values, chosen, 2)
    drawn(chosen, 2, np.full((1, 2), 0.5))
