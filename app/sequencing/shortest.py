"""The cheapest sequence of a tool (Eq. 1-2, Sec. IV-B): exact up to 20 regions, best found above.

Equally cheap sequences are told apart by a tie-break (the effort penalty), then by the lowest region ids, so that the
answer is the same on every machine.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.geometry.tool import Array
from app.sequencing import kernels
from app.sequencing.large import best_found
from app.sequencing.problem import EXACT_LIMIT, SequencingProblem

TOLERANCE = 1e-7  # relative: costs closer than this count as equal
TIE_CAP = 2000  # equally cheap sequences that a tie-break looks at one by one

TieBreak = Callable[[tuple[int, ...]], float]


@dataclass(frozen=True)
class Shortest:
    """A cheapest sequence and how sure we are of it."""

    sequence: tuple[int, ...]
    cost: float  # in float64 along the sequence
    ties: int  # sequences of this cost, this one included; 1 when not proved
    proved: bool
    method: str  # plain words
    bound: float = -np.inf  # no sequence costs less; the cost itself when proved, -inf when not looked for

    @property
    def gap(self) -> float:
        """How far the cost may lie above the optimum, as a share of |cost|: 0 when proved, infinite without a bound."""
        return gap_between(self.cost, self.bound)


def gap_between(cost: float, bound: float) -> float:
    """(cost - bound) / |cost|; the optimum is at least cost - gap * |cost|, whatever the signs."""
    if cost <= bound:
        return 0.0
    return float((cost - bound) / abs(cost)) if cost else np.inf


@dataclass(frozen=True)
class Solution:
    """The exact dynamic program of a problem under fixed weights."""

    table: Array  # (2^N, N) cost of each transition
    to_go: Array  # (2^N,) cheapest cost from each set to the full one
    scale: float  # cost that relative tolerances refer to

    @property
    def tolerance(self) -> float:
        """Absolute difference of costs that still counts as a tie."""
        return TOLERANCE * self.scale

    @property
    def n(self) -> int:
        return self.table.shape[1]


def solve(problem: SequencingProblem, w: Array) -> Solution:
    """Exact cost-to-go of every set, for at most 20 regions.

    The scale is the lowest cost, or a thousandth of the largest cost any sequence could have where that is more (costs
    may be negative and add up to nearly nothing).
    """
    table = problem.cost_table(w)
    to_go = kernels.lowest_to_go(table, problem.n)
    return Solution(table, to_go, max(abs(float(to_go[0])), 1e-3 * kernels.largest_sum(table, problem.n), 1e-300))


def cost_to_go(problem: SequencingProblem, w: Array) -> Array:
    """Cheapest cost from every set of finished regions to the full set, (2^N,)."""
    return kernels.lowest_to_go(problem.cost_table(w), problem.n)


def shortest_sequence(problem: SequencingProblem, w: Array, tie_break: TieBreak | None = None) -> Shortest:
    """The cheapest sequence under weights w.

    Args:
        problem: The tool and its features.
        w: Weights, shape (n + m,).
        tie_break: Lower is better among equally cheap sequences. Exact over the whole class up to TIE_CAP members; in a
            larger class over those with the lowest ids and one of each pair of first and last region, which is exact
            for a penalty on the two ends.

    Paper: Dijkstra on an explicit graph there; the backward pass here also bears negative costs and needs no graph.
    """
    if problem.n > EXACT_LIMIT:
        sequence = best_found(problem, w)
        method = "Best found: a beam search, then exact re-ordering of short stretches until nothing improves. Not proved optimal."
        return Shortest(sequence, problem.cost(w, sequence), 1, proved=False, method=method)
    solution = solve(problem, w)
    ties = tie_count(solution)
    candidates = lowest_orders(solution, TIE_CAP if tie_break else 1)
    method = f"Exact: dynamic programming over all {1 << problem.n:,} sets of finished regions."
    if tie_break and ties > len(candidates):
        candidates += one_per_ends(solution)
        method += f" Ties settled among {len(set(candidates)):,} of {ties:,} equal sequences, every pair of first and last region included."
    sequence = min(candidates, key=lambda s: (tie_break(s), s)) if tie_break else candidates[0]
    cost = problem.cost(w, sequence)
    return Shortest(sequence, cost, ties, proved=True, method=method, bound=cost)


def tie_count(solution: Solution) -> int:
    """Number of cheapest sequences."""
    return int(kernels.count_lowest(solution.table, solution.to_go, solution.n, solution.tolerance)[0])


def lowest_orders(solution: Solution, cap: int) -> list[tuple[int, ...]]:
    """Cheapest sequences, lowest ids first, at most `cap`."""
    to_go = solution.to_go[:, None]
    slack = np.array([solution.tolerance])
    found, _ = kernels.members_within(
        solution.table[:, :, None], solution.n, solution.to_go[:1], to_go, np.full_like(to_go, np.inf), slack, cap
    )
    return [tuple(int(a) for a in row) for row in found]


def one_per_ends(solution: Solution) -> list[tuple[int, ...]]:
    """For each pair of first and last region of a cheapest sequence, the one with the lowest ids."""
    last = kernels.last_regions(solution.table, solution.to_go, solution.n, solution.tolerance)
    ends = ((a, b) for a in range(solution.n) if _tied(solution, 0, a) for b in range(solution.n) if last[1 << a] >> b & 1)
    return [_between(solution, last, a, b) for a, b in ends]


def _tied(solution: Solution, state: int, a: int) -> bool:
    after = state | 1 << a
    return after != state and solution.table[state, a] + solution.to_go[after] <= solution.to_go[state] + solution.tolerance


def _between(solution: Solution, last: NDArray[np.int64], first: int, end: int) -> tuple[int, ...]:
    full = (1 << solution.n) - 1
    order, state = [first], 1 << first
    while state != full:
        a = next(
            a
            for a in range(solution.n)
            if _tied(solution, state, a) and (a == end if state | 1 << a == full else last[state | 1 << a] >> end & 1)
        )
        order.append(a)
        state |= 1 << a
    return tuple(order)
