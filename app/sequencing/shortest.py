"""The cheapest sequence of a tool (Eq. 1-2, Sec. IV-B): exact while all sets of finished regions fit, best found above.

Equally cheap sequences are told apart by a tie-break (the effort penalty), then by the lowest region ids, so that the
answer is the same on every machine.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from app.errors import ContradictoryConstraints
from app.geometry.tool import Array, region_letters
from app.sequencing import kernels
from app.sequencing.answer import MOST_NODES, TOLERANCE, answer, lowest_cost
from app.sequencing.block import SMALLEST
from app.sequencing.constraints import Constraints, Resolved, listed, resolve
from app.sequencing.exact import Limits, Model, costs_to_go, extra_costs, form_for, model_for, uses_threads, why_not_exact
from app.sequencing.forms import Form
from app.sequencing.large import best_found
from app.sequencing.last import LAST_LIMIT, after_last, costs_to_go_by_last
from app.sequencing.nearly import Nearly
from app.sequencing.problem import SequencingProblem
from app.sequencing.rows import Single

TIE_CAP = 2000  # equally cheap sequences that a tie-break looks at one by one
LIMITS = Limits()

TieBreak = Callable[[tuple[int, ...]], float]


@dataclass(frozen=True, eq=False)
class Ends:
    """A tie-break that only looks at where a sequence starts and ends: exact in a class of any size."""

    start: Array  # (N,) penalty of a as the first region
    end: Array  # (N,) and as the last


@dataclass(frozen=True)
class Shortest:
    """A cheapest sequence and how sure we are of it."""

    sequence: tuple[int, ...]  # finished regions first, skipped ones left out
    cost: float  # in float64 along the sequence
    ties: int  # sequences of this cost, this one included
    proved: bool
    method: str  # plain words: what was done, and why
    bound: float = -np.inf  # no sequence costs less; the cost itself when proved, -inf when not looked for
    counted: bool = True  # False: there may be more ties than `ties`

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
    """The exact costs-to-go of a problem under fixed weights, and the graph of its cheapest sequences."""

    model: Model
    w: Array  # of the columns that don't depend on the region before
    after: Array  # what depends on the region before (`last.after_last`)
    v: Single  # costs-to-go in single precision; empty for few regions
    graph: Nearly  # all cheapest sequences, perhaps some more; not all where it isn't complete
    order: tuple[int, ...]  # the cheapest of lowest ids, as `named` takes it
    ties: int  # cheapest sequences in the graph
    scale: float  # cost that relative tolerances refer to
    error: float  # of v

    @property
    def form(self) -> Form:
        """The cost in one form."""
        return form_for(self.model, self.w)

    @property
    def tolerance(self) -> float:
        """Absolute difference of costs that still counts as a tie."""
        return TOLERANCE * self.scale

    def named(self, order: tuple[int, ...]) -> tuple[int, ...]:
        """The sequence of the tool's regions: finished ones, then the free ones that `order` numbers."""
        return self.model.resolved.done + tuple(self.model.resolved.free[a] for a in order)


def reason_against(problem: SequencingProblem, resolved: Resolved, limits: Limits = LIMITS) -> str | None:
    """Why the exact search is not used; None when it is."""
    n = len(resolved.free)
    if (problem.last or resolved.parted) and n > LAST_LIMIT:
        return f"costs depend on the region before, and {n} regions are more than the {LAST_LIMIT} searched exactly then"
    return why_not_exact(problem, n, limits)


def solve(problem: SequencingProblem, w: Array, resolved: Resolved | None = None) -> Solution:
    """Exact costs-to-go, and the graph of the cheapest sequences.

    The scale is the lowest cost, or a thousandth of the largest sum of absolute costs where that is more (costs may be
    negative and add up to nearly nothing).

    Raises:
        ContradictoryConstraints: No order avoids the forbidden neighbours.
    """
    w, resolved = problem.check_weights(w), resolved or resolve(None, problem.n)
    model, plain = model_for(problem, resolved), w[: problem.width].copy()  # writable: compiled code takes no other
    after = after_last(problem.last, w[problem.width :], resolved)
    v, filled = np.empty(1 << model.n if model.n >= SMALLEST else 0, np.float32), False
    if len(v) and (len(after) or uses_threads(model.n)):
        form, filled = form_for(model, plain), True
        v = costs_to_go_by_last(form, after) if len(after) else costs_to_go(model, form)
    a = answer(model.prepared, plain, extra_costs(model, plain), after, v, filled, MOST_NODES)
    if model.n and a.to_go[0] == np.inf:
        raise ContradictoryConstraints(_forbidden(problem, resolved))
    graph = Nearly(a.first, a.region, a.cost, a.to, a.end, model.n, a.complete, a.to_go)
    return Solution(model, plain, after, v, graph, tuple(a.order.tolist()), (int(a.high) << 64) + int(a.low), a.scale, a.error)


def _forbidden(problem: SequencingProblem, resolved: Resolved) -> str:
    """The fewest forbidden neighbours without which there would be an order, each one needed."""
    pairs = [(int(a), int(b)) for a, b in np.argwhere(resolved.never_next)]
    plain = replace(problem, last=())
    zero = np.zeros(len(plain.columns))
    needed = pairs[:]
    for pair in pairs:
        fewer = np.zeros_like(resolved.never_next)
        for a, b in (p for p in needed if p != pair):
            fewer[a, b] = True
        trial = replace(resolved, never_next=fewer)
        model = model_for(plain, trial)
        form, after = form_for(model, zero), after_last((), zero[:0], trial)
        if not len(after):
            continue
        v = costs_to_go_by_last(form, after)
        if not np.isfinite(lowest_cost(form, after, v)):
            needed.remove(pair)
    letters = region_letters(problem.n)
    words = [f"{letters[b]} never directly after {letters[a]}" for a, b in needed]
    also = " together with the precedence given" if resolved.ordered else ""
    return f"No order can have {listed(words)}{also}. Take one of these away."


def cost_to_go(problem: SequencingProblem, w: Array) -> Array:
    """Cheapest cost from every set of finished regions to the full set, (2^N,), from a table of all costs."""
    return kernels.lowest_to_go(problem.cost_table(w), problem.n)


def shortest_sequence(
    problem: SequencingProblem,
    w: Array,
    tie_break: TieBreak | Ends | None = None,
    constraints: Constraints | None = None,
    limits: Limits = LIMITS,
) -> Shortest:
    """The cheapest sequence under weights w.

    Args:
        problem: The tool and its features.
        w: Weights, shape (n + m,).
        tie_break: Lower is better among equally cheap sequences. `Ends` is exact in a class of any size; a function over the
            whole class up to TIE_CAP members, in a larger one over those with the lowest ids.
        constraints: What the order must respect.
        limits: Regions and memory up to which the search is exact.

    Raises:
        ContradictoryConstraints: The constraints can't hold together.

    Paper: Dijkstra on an explicit graph there; the backward pass here also bears negative costs and needs no graph.
    """
    resolved = resolve(constraints, problem.n)
    against = reason_against(problem, resolved, limits)
    if against:
        sequence = best_found(problem, w, resolved)
        method = f"Best found: beam search, then exact re-ordering of short stretches. Not proved optimal: {against}."
        return Shortest(sequence, problem.cost_of(w, sequence), 1, proved=False, method=method, counted=False)
    solution = solve(problem, w, resolved)
    n, counted = solution.model.n, solution.graph.complete
    method = f"Exact: dynamic programming over all {1 << n:,} sets of finished regions{' and the last one' if len(solution.after) else ''}."
    if not counted:
        method += f" At least {solution.ties:,} orders tie; so many nearly do that they were not all counted."
    order, more = _settle(solution, tie_break)
    sequence = solution.named(order)
    cost = float(np.asarray(w, np.float64) @ problem.sums_of(sequence))  # `problem.cost_of`, weights checked before
    return Shortest(sequence, cost, solution.ties, proved=True, method=method + more, bound=cost, counted=counted)


def _settle(solution: Solution, tie_break: TieBreak | Ends | None) -> tuple[tuple[int, ...], str]:
    graph, tolerance, free = solution.graph, solution.tolerance, list(solution.model.resolved.free)
    if tie_break is None or not free:
        return solution.order, ""
    if isinstance(tie_break, Ends):
        start = np.zeros(len(free)) if solution.model.resolved.done else tie_break.start[free]
        return graph.by_ends(start, tie_break.end[free], tolerance), ""
    candidates = graph.members(tolerance, TIE_CAP)
    more = f" Ties settled among {len(candidates):,} of {solution.ties:,} equal sequences." if solution.ties > len(candidates) else ""
    return min(candidates, key=lambda s: (tie_break(solution.named(s)), s)), more


@dataclass(frozen=True)
class Completion:
    """The best that can follow a start."""

    sequence: tuple[int, ...]  # the whole order, the given start first
    spent: float  # cost of the start
    rest: float  # cheapest cost of what follows
    proved: bool

    @property
    def cost(self) -> float:
        return self.spent + self.rest


def best_completion(problem: SequencingProblem, w: Array, prefix: tuple[int, ...], constraints: Constraints | None = None) -> Completion:
    """If the expert starts so: the cheapest way to go on.

    Raises:
        ContradictoryConstraints: The start breaks the constraints already.
    """
    begun = replace(constraints or Constraints(), done=tuple(prefix))
    found = shortest_sequence(problem, w, None, begun)
    spent = problem.cost_of(w, found.sequence[: len(prefix)])
    return Completion(found.sequence, spent, found.cost - spent, found.proved)
