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

KEPT = 2  # choices of columns: a run's own, and those that are left once a demonstration pins a weight to 0


@nb.njit(cache=True, fastmath={"contract", "nnan", "nsz"})
def _to_go(steps: Array, weights: Array, n: int) -> Array:
    """Lowest cost from every set to the full one, (2^N, S), for each column of weights (j, S).

    Args:
        steps: (transitions, j) features of every transition, sets downwards from the full one, regions upwards.
        weights: (j, S).
        n: Number of regions.
    """
    full, width, count = (1 << n) - 1, steps.shape[1], weights.shape[1]
    to_go = np.empty((full + 1, count))
    to_go[full] = 0.0
    step = np.empty(count)
    at = 0
    for s in range(full - 1, -1, -1):
        lowest = to_go[s]
        for p in range(count):
            lowest[p] = np.inf
        for a in range(n):
            t = s | 1 << a
            if t == s:
                continue
            x, after = steps[at], to_go[t]
            at += 1
            for p in range(count):
                step[p] = after[p]
            k = 0
            while k + 4 <= width:  # four at a time: what is read and written is `step`, not the features
                x0, x1, x2, x3 = x[k], x[k + 1], x[k + 2], x[k + 3]
                w0, w1, w2, w3 = weights[k], weights[k + 1], weights[k + 2], weights[k + 3]
                for p in range(count):
                    step[p] += x0 * w0[p] + x1 * w1[p] + x2 * w2[p] + x3 * w3[p]
                k += 4
            while k < width:
                x0, w0 = x[k], weights[k]
                for p in range(count):
                    step[p] += x0 * w0[p]
                k += 1
            for p in range(count):
                lowest[p] = min(lowest[p], step[p])
    return to_go


@nb.njit(cache=True, fastmath={"contract"})
def _followed(to_go: Array, tensor: Array, columns: NDArray[np.int64], weights: Array, n: int) -> Orders:
    """One cheapest order (S, n) per column of weights; of equally cheap regions the lowest id goes first."""
    count, width = to_go.shape[1], len(columns)
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
                    value += tensor[s, a, columns[k]] * weights[k, p]
                if who < 0 or value < best - 1e-12 * abs(best):
                    best, who = value, a
            orders[p, q] = who
            s |= 1 << who
    return orders


def _steps(problem: SequencingProblem, columns: NDArray[np.int64]) -> Array:
    """Some columns of all transitions in the order `_to_go` reads them; kept with the problem for the last few choices of columns."""
    known, key = problem.kept.setdefault("steps", {}), columns.tobytes()
    if key not in known:
        if len(known) == KEPT:
            known.pop(next(iter(known)))
        sets = np.arange((1 << problem.n) - 2, -1, -1)
        waiting = (sets[:, None] >> np.arange(problem.n)) & 1 == 0
        known[key] = np.ascontiguousarray(problem.tensor()[sets][waiting][:, columns])
    return known[key]


def cheapest_orders(problem: SequencingProblem, weights: Array) -> Orders:
    """One cheapest sequence for each row of weights (S, n + m).

    Above 14 regions each takes a pass of its own; above 20 it is the best found.
    """
    if problem.n > TENSOR_LIMIT:
        return np.array([shortest_sequence(problem, w).sequence for w in weights], np.int64).reshape(len(weights), problem.n)
    columns = np.flatnonzero(np.any(weights != 0, axis=0))
    chosen = np.ascontiguousarray(weights[:, columns].T)
    to_go = _to_go(_steps(problem, columns), chosen, problem.n)
    return _followed(to_go, problem.tensor(), columns, chosen, problem.n)


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
    """Compile or load the kernels, for tables that may and may not be written to."""
    table, to_go = np.ones((4, 2, 1)), _to_go(np.ones((4, 1)), np.ones((1, 1)), 2)
    for _ in range(2):
        _followed(to_go, table, np.zeros(1, np.int64), np.ones((1, 1)), 2)
        table.flags.writeable = False
