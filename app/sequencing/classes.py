"""Sequences that cost the same: the K best distinct cost classes, all optimal sequences, and Omega (Eq. 3).

Symmetric tools have many equally cheap sequences, so the K cheapest sequences are often one cost K times over. The
learner asks about classes instead, each with the number of its members.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.geometry.tool import Array
from app.sequencing import kernels
from app.sequencing.omega import equal_sums, equal_sums_searched
from app.sequencing.problem import EXACT_LIMIT, TENSOR_LIMIT, SequencingProblem, check_sequence
from app.sequencing.shortest import TOLERANCE, Solution, lowest_orders, shortest_sequence, solve, tie_count

CAP = 256  # members of a class that are listed


@dataclass(frozen=True)
class CostClass:
    """All sequences of one cost."""

    cost: float
    count: int  # exact for at most 20 regions, else those found
    sequence: tuple[int, ...]  # a representative


@dataclass(frozen=True)
class Equivalents:
    """Members of a class, at most a cap."""

    sequences: tuple[tuple[int, ...], ...]
    complete: bool  # these are all


def best_classes(problem: SequencingProblem, w: Array, k: int, tolerance: float = TOLERANCE) -> tuple[CostClass, ...]:
    """The k cheapest distinct cost classes, cheapest first; fewer when the tool has fewer.

    Args:
        problem: The tool and its features.
        w: Weights, shape (n + m,).
        k: Number of classes, at least 1.
        tolerance: Costs closer than this share of the cost scale (`shortest.solve`) are one class.

    Paper: Algorithm 1 takes the K shortest sequences; on symmetric tools these are mostly one cost, which would ask the
    expert K times the same. Above 20 regions the classes are those among the best found sequence and its neighbours.
    """
    if problem.n > EXACT_LIMIT:
        return _classes_nearby(problem, w, k, tolerance)
    solution = solve(problem, w)
    merged = Merged(*kernels.distinct_classes(solution.table, solution.to_go, problem.n, k, tolerance * solution.scale))
    orders = [_representative(solution, merged, j) for j in range(merged.filled[merged.row[0]])]
    counts = merged.counts[merged.row[0]]
    return tuple(CostClass(problem.cost(w, s), int(counts[j]), s) for j, s in enumerate(orders))


@dataclass(frozen=True)
class Merged:
    """Distinct totals from each kept set of finished regions to the full set (`kernels.distinct_classes`)."""

    totals: Array  # (S, k)
    counts: NDArray[np.int64]  # (S, k)
    filled: NDArray[np.int64]  # (S,)
    row: NDArray[np.int64]  # (2^N,)


def _representative(solution: Solution, merged: Merged, which: int) -> tuple[int, ...]:
    """The sequence that opened class `which`, lowest ids first."""
    order, state = [], 0
    while state != (1 << solution.n) - 1:
        target = merged.totals[merged.row[state], which]
        error, a, which = min(
            (abs(solution.table[state, a] + merged.totals[j, q] - target), a, q)
            for a in range(solution.n)
            for j in [merged.row[state | 1 << a]]
            if not state >> a & 1 and j >= 0
            for q in range(merged.filled[j])
        )
        assert error <= 1e-12 * solution.scale  # the opener's total was computed from these very numbers
        order.append(a)
        state |= 1 << a
    return tuple(order)


def _classes_nearby(problem: SequencingProblem, w: Array, k: int, tolerance: float) -> tuple[CostClass, ...]:
    best = shortest_sequence(problem, w).sequence
    costs = sorted((problem.cost(w, s), s) for s in {best, *neighbours(best)})
    slack = tolerance * max(abs(costs[0][0]), 1e-300)
    classes: list[CostClass] = []
    for cost, sequence in costs:
        if classes and cost - classes[-1].cost <= slack:
            classes[-1] = CostClass(classes[-1].cost, classes[-1].count + 1, classes[-1].sequence)
        elif len(classes) == k:
            break
        else:
            classes.append(CostClass(cost, 1, sequence))
    return tuple(classes)


def neighbours(sequence: tuple[int, ...]) -> set[tuple[int, ...]]:
    """Sequences with two regions exchanged."""
    found = set()
    for i in range(len(sequence)):
        for j in range(i):
            other = list(sequence)
            other[i], other[j] = other[j], other[i]
            found.add(tuple(other))
    return found


def optimal_sequences(problem: SequencingProblem, w: Array, cap: int = CAP) -> Equivalents:
    """All cheapest sequences, lowest ids first, at most `cap`."""
    if problem.n > EXACT_LIMIT:
        return Equivalents((shortest_sequence(problem, w).sequence,), complete=False)
    solution = solve(problem, w)
    found = lowest_orders(solution, cap)
    return Equivalents(tuple(found), complete=len(found) == tie_count(solution))


def class_size(problem: SequencingProblem, w: Array) -> int:
    """Number of cheapest sequences."""
    return 1 if problem.n > EXACT_LIMIT else tie_count(solve(problem, w))


def equivalent_sequences(problem: SequencingProblem, sequence: Sequence[int], cap: int = CAP) -> Equivalents:
    """Omega: all sequences with the same feature sum, so the same cost under any weights (Eq. 3).

    The given sequence comes first, then the others with the lowest ids first. Complete for at most 20 regions unless the
    cap (or, above 14, the search limit) was reached; above 20 regions only exchanges of two regions are looked at.
    """
    order = check_sequence(sequence, problem.n)
    if problem.n <= TENSOR_LIMIT:
        found, complete = equal_sums(problem, order, cap)
    elif problem.n <= EXACT_LIMIT:
        found, complete = equal_sums_searched(problem, order, cap)
    else:
        total = problem.feature_sum(order)
        found = [s for s in sorted(neighbours(order)) if np.allclose(problem.feature_sum(s), total, rtol=1e-9, atol=1e-9)]
        complete = False
    others = [s for s in found if s != order]
    return Equivalents((order, *others)[:cap], complete)
