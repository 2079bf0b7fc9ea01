"""Sequences that cost the same: the K best distinct cost classes, all optimal sequences, and Omega (Eq. 3).

Symmetric tools have many equally cheap sequences, so the K cheapest sequences are often one cost K times over. The
learner asks about classes instead, each with the number of its members.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from app.geometry.tool import Array
from app.sequencing.constraints import Constraints, Resolved, check_order, resolve
from app.sequencing.forms import step_costs
from app.sequencing.nearly import Nearly, explore
from app.sequencing.omega import drawn_members, equal_sums, one_per_ends
from app.sequencing.problem import SequencingProblem, check_sequence
from app.sequencing.shortest import TOLERANCE, Solution, reason_against, shortest_sequence, solve

CAP = 256  # members of a class that are listed
POOL = 1000  # members drawn to choose unlike ones from
FIRST_REACH = 4  # of the costs one step beside the cheapest sequence, which one the first search for classes reaches to
CLASS_NODES = 400_000  # of the graph that classes are counted in


@dataclass(frozen=True)
class CostClass:
    """All sequences of one cost."""

    cost: float
    count: int  # exact while the search is, else those found
    sequence: tuple[int, ...]  # a representative


@dataclass(frozen=True)
class Equivalents:
    """Members of a class, at most a cap."""

    sequences: tuple[tuple[int, ...], ...]
    complete: bool  # these are all
    count: int  # members
    counted: bool  # False: there may be more than `count`
    every_end: bool = False  # some member is listed for every first and last region that members have


def best_classes(
    problem: SequencingProblem, w: Array, k: int, tolerance: float = TOLERANCE, constraints: Constraints | None = None
) -> tuple[CostClass, ...]:
    """The k cheapest distinct cost classes, cheapest first; fewer when the tool has fewer.

    Args:
        problem: The tool and its features.
        w: Weights, shape (n + m,).
        k: Number of classes, at least 1.
        tolerance: Costs closer than this share of the cost scale (`shortest.solve`) are one class.
        constraints: What the sequences must respect.

    Paper: Algorithm 1 takes the K shortest sequences; on symmetric tools these are mostly one cost, which would ask the
    expert K times the same. Where the exact search is out of reach, the classes are those among the best found sequence
    and its neighbours.
    """
    resolved = resolve(constraints, problem.n)
    if reason_against(problem, resolved):
        return _classes_nearby(problem, w, k, tolerance, constraints)
    solution = solve(problem, w, resolved)
    slack = tolerance * solution.scale
    if not solution.graph.complete:
        sequence = solution.named(solution.order)
        return (CostClass(problem.cost_of(w, sequence), solution.ties, sequence),)
    graph, limit = _graph_of(solution, k, slack)
    totals = graph.classes(k + 1, slack)
    kept = [c for c in totals if c[0] <= limit][:k]
    orders = [solution.named(order) for _, _, order in kept]
    return tuple(CostClass(problem.cost_of(w, s), count, s) for s, (_, count, _) in zip(orders, kept, strict=True))


def _graph_of(solution: Solution, k: int, slack: float) -> tuple[Nearly, float]:
    """A graph that holds the k cheapest classes completely, and the total up to which it holds every class."""
    if not len(solution.v):
        return solution.graph, np.inf  # few regions: it holds every sequence
    costs, form = beside(solution, slack), solution.form
    graph, limit = solution.graph, solution.graph.lowest + slack
    reach = costs[min(FIRST_REACH, k, len(costs) - 1)] - graph.lowest
    while len([c for c in graph.classes(k, slack) if c[0] <= limit]) < k and np.isfinite(limit):
        limit = graph.lowest + reach if reach < 4 * solution.error / TOLERANCE else np.inf
        wider = explore(form, solution.v, solution.after, limit + slack + solution.error, CLASS_NODES)
        if not wider.complete:
            return graph, graph.lowest + reach / 2
        graph, reach = wider, 2 * max(reach, 10 * slack)
    return graph, limit


def beside(solution: Solution, slack: float) -> list[float]:
    """Distinct costs of the sequences that leave the cheapest one once and go on in the best way, to single precision."""
    graph, node, spent, found = solution.graph, 0, 0.0, [solution.graph.lowest]
    n = solution.model.n
    costs, state, last, form = np.empty(n), 0, n, solution.form
    while node < graph.end:
        step_costs(form, state, costs)
        a, following = next(graph.tied(node, solution.tolerance))
        for b in range(n):
            if np.isfinite(costs[b]):
                by_last = len(solution.after) > 0
                key = (state | 1 << b) * (n if by_last else 1) + (b if by_last else 0)
                found.append(spent + costs[b] + (solution.after[last, b] if by_last else 0.0) + float(solution.v[key]))
        spent += costs[a] + (solution.after[last, a] if len(solution.after) else 0.0)
        state, node, last = state | 1 << a, following, a
    values = sorted(x for x in found if np.isfinite(x))
    return [x for x, before in zip(values, [-np.inf, *values], strict=False) if x - before > slack + solution.error]


def _classes_nearby(
    problem: SequencingProblem, w: Array, k: int, tolerance: float, constraints: Constraints | None
) -> tuple[CostClass, ...]:
    best, resolved = shortest_sequence(problem, w, constraints=constraints).sequence, resolve(constraints, problem.n)
    allowed = (s for s in neighbours(best) if s[: len(resolved.done)] == resolved.done and not check_order(s, resolved))
    costs = sorted((problem.cost_of(w, s), s) for s in {best, *allowed})
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


def optimal_sequences(problem: SequencingProblem, w: Array, cap: int = CAP, constraints: Constraints | None = None) -> Equivalents:
    """All cheapest sequences, lowest ids first, at most `cap`."""
    resolved = resolve(constraints, problem.n)
    if not reason_against(problem, resolved):
        solution = solve(problem, w, resolved)
        found = tuple(solution.named(s) for s in solution.graph.members(solution.tolerance, cap))
        whole = solution.graph.complete
        return Equivalents(found, whole and len(found) == solution.ties, solution.ties, whole)
    return Equivalents((shortest_sequence(problem, w, constraints=constraints).sequence,), complete=False, count=1, counted=False)


def class_size(problem: SequencingProblem, w: Array, constraints: Constraints | None = None) -> int:
    """Number of cheapest sequences, or of those met (at least 1) where not all are counted (`Shortest.counted`)."""
    resolved = resolve(constraints, problem.n)
    return 1 if reason_against(problem, resolved) else solve(problem, w, resolved).ties


def equivalent_sequences(
    problem: SequencingProblem, sequence: Sequence[int], cap: int = CAP, constraints: Constraints | None = None
) -> Equivalents:
    """Omega: all sequences with the same feature sum, so the same cost under any weights (Eq. 3).

    The given sequence comes first. All others follow, lowest ids first, when they fit under the cap; else a sample as unlike as
    possible: first one member for each first and last region that members have, then those farthest from what is listed. The
    count is exact to `omega.MOST_REGIONS` regions; above, only exchanges of two regions are looked at. With constraints, only
    members that respect them; regions can't be skipped here, because sums over other regions never compare.
    """
    order, resolved = check_sequence(sequence, problem.n), resolve(constraints, problem.n)
    if resolved.skip or order[: len(resolved.done)] != resolved.done or check_order(order, resolved):
        return Equivalents((order,), complete=False, count=1, counted=False)
    graph = equal_sums(problem, order, resolved)
    if graph is None:
        return _equal_nearby(problem, order, resolved)
    count, known = graph.count(0.0), {order: None}

    def add(members: Iterable[tuple[int, ...]]) -> None:
        known.update((resolved.done + tuple(resolved.free[a] for a in m), None) for m in members)

    if count <= cap:
        add(graph.members(0.0, cap))
        return Equivalents(tuple(known), graph.complete, count, graph.complete, every_end=graph.complete)
    add(one_per_ends(graph))
    ends = list(known)[:cap]
    every_end = graph.complete and len(ends) == len(known)
    add(drawn_members(graph, POOL))
    return Equivalents(diverse(tuple(known), cap, len(ends)), complete=False, count=count, counted=graph.complete, every_end=every_end)


def _equal_nearby(problem: SequencingProblem, order: tuple[int, ...], resolved: Resolved) -> Equivalents:
    """Members that differ by one exchange."""
    total, done = problem.feature_sum(order), len(resolved.done)
    near = [s for s in sorted(neighbours(order)) if s[:done] == order[:done] and not check_order(s, resolved)]
    others = [s for s in near if np.allclose(problem.feature_sum(s), total, rtol=1e-9, atol=1e-9)]
    return Equivalents((order, *others), complete=False, count=1 + len(others), counted=False)


def omega_size(problem: SequencingProblem, sequence: Sequence[int]) -> tuple[int, bool]:
    """Number of sequences with the same feature sum, and whether these are all."""
    order = check_sequence(sequence, problem.n)
    graph = equal_sums(problem, order, resolve(None, problem.n))
    return (graph.count(0.0), graph.complete) if graph else (1, False)


def diverse(sequences: Sequence[tuple[int, ...]], k: int, given: int = 0) -> tuple[tuple[int, ...], ...]:
    """k of the sequences as unlike each other as a greedy choice finds: the first `given` of them, or else the farthest pair,
    then always the one farthest from its nearest chosen one (Kendall's tau); ties by position."""
    pool = list(dict.fromkeys(sequences))
    if k >= len(pool):
        return tuple(pool)
    if k == 1:
        return (pool[0],)
    place = np.argsort(np.array(pool), axis=1)
    one, two = np.triu_indices(place.shape[1], 1)
    ahead = np.where(place[:, one] < place[:, two], 1.0, -1.0)
    alike = ahead @ ahead.T / max(len(one), 1)  # Kendall's tau of every two
    chosen = list(range(min(given, k))) or [int(i) for i in np.unravel_index(int(alike.argmin()), alike.shape)]
    while len(chosen) < k:
        nearest = alike[:, chosen].max(axis=1)
        nearest[chosen] = np.inf
        chosen.append(int(nearest.argmin()))
    return tuple(pool[i] for i in chosen)
