"""Cheapest sequences of one tool under many weights at once.

Samples of the version space ask for the same dynamic program over and over with other weights. Done together, the
features of a transition are read once and the innermost loop runs over the samples.
"""

import numba as nb
import numpy as np
from numpy.typing import NDArray

from app.learning.qp import Array
from app.sequencing.problem import TENSOR_LIMIT, SequencingProblem
from app.sequencing.shortest import shortest_sequence

Orders = NDArray[np.int64]  # (S, N)


@nb.njit(cache=True, fastmath={"contract"})
def _lowest(tensor: Array, columns: NDArray[np.int64], weights: Array, n: int) -> Orders:
    """One cheapest order (S, n) for each column of weights (j, S) on some columns of the tensor.

    Of equally cheap regions the lowest id goes first.
    """
    full, width, count = (1 << n) - 1, len(columns), weights.shape[1]
    to_go = np.zeros((full + 1, count))
    step = np.empty(count)
    for s in range(full - 1, -1, -1):
        for p in range(count):
            to_go[s, p] = np.inf
        for a in range(n):
            t = s | 1 << a
            if t == s:
                continue
            for p in range(count):
                step[p] = to_go[t, p]
            for k in range(width):
                x = tensor[s, a, columns[k]]
                if x != 0.0:
                    for p in range(count):
                        step[p] += x * weights[k, p]
            for p in range(count):
                if step[p] < to_go[s, p]:
                    to_go[s, p] = step[p]
    orders = np.empty((count, n), np.int64)
    for p in range(count):
        s = 0
        for q in range(n):
            best, who = np.inf, -1
            for a in range(n):
                t = s | 1 << a
                if t == s:
                    continue
                value = to_go[t, p]
                for k in range(width):
                    x = tensor[s, a, columns[k]]
                    if x != 0.0:
                        value += x * weights[k, p]
                if who < 0 or value < best - 1e-12 * abs(best):
                    best, who = value, a
            orders[p, q] = who
            s |= 1 << who
    return orders


def cheapest_orders(problem: SequencingProblem, weights: Array) -> Orders:
    """One cheapest sequence for each row of weights (S, n + m).

    Above 14 regions each takes a pass of its own; above 20 it is the best found.
    """
    if problem.n > TENSOR_LIMIT:
        return np.array([shortest_sequence(problem, w).sequence for w in weights], np.int64).reshape(len(weights), problem.n)
    columns = np.flatnonzero(np.any(weights != 0, axis=0))
    return _lowest(problem.tensor(), columns, np.ascontiguousarray(weights[:, columns].T), problem.n)


def sums_of(problem: SequencingProblem, orders: Orders) -> Array:
    """Feature sums (S, n + m) of many sequences."""
    if problem.n > TENSOR_LIMIT:
        return np.array([problem.feature_sum([int(a) for a in order]) for order in orders]).reshape(len(orders), len(problem.columns))
    bits = np.int64(1) << orders
    return problem.tensor()[np.cumsum(bits, axis=1) - bits, orders].sum(axis=1)


def random_orders(problem: SequencingProblem, count: int, generator: np.random.Generator) -> Orders:
    """`count` uniformly random sequences."""
    return np.argsort(generator.random((count, problem.n)), axis=1, kind="stable")


def warm_up() -> None:
    """Compile or load the kernel, for tables that may and may not be written to."""
    table = np.ones((4, 2, 1))
    for _ in range(2):
        _lowest(table, np.zeros(1, np.int64), np.ones((1, 1)), 2)
        table.flags.writeable = False
