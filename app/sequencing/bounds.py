"""Lower bounds on the cost of every sequence of a tool, for tools too large for the exact dynamic program.

The cost is split into parts that are easy on their own, and each part is free to choose its own order:

    walk        an exact dynamic program over position and the two sums behind the means; a region may be met twice, and a
                step chooses which of its neighbours are finished (`relaxed_walk`)
    pairs       every two regions that have to do with each other choose their positions
    sets        the gaps: for every number of finished regions the cheapest set in the cheapest pair of boxes
    chain       where costs depend on the region before: the cheapest choice of a region for every position

Their optima add up to a bound. Prices (Lagrange multipliers) make the parts agree: a region pays a price for being at a
position in one part and gets it back in another, which changes no sequence's cost. Every choice of prices gives a valid
bound; subgradient steps look for good ones and the best bound met counts. What no part models enters with the least value
it can have at each position. At the end the bound is lowered by more than rounding could have raised it.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from app.geometry.tool import Array
from app.sequencing.constraints import Resolved, resolve
from app.sequencing.features import declare
from app.sequencing.parts import Parts, split
from app.sequencing.problem import SequencingProblem
from app.sequencing.relaxations import cheapest_chain, cheapest_pairs
from app.sequencing.relaxed_walk import Walk, cheapest_walk
from app.sequencing.structure import Undeclared

ROUNDING = 1e-9  # of the sum of all numbers involved: far more than float64 can lose
STEPS = 1200  # of the subgradient method
COARSE, MIDDLE, FINE = 4000, 10_000, 30_000  # pairs of levels of the two sums: for most steps, for the rest, for the last bound
REFINED = 0.4  # share of the steps with the middle tables
STRIDE = 0.25  # of the steps when the larger tables take over
PATIENCE = 30  # steps without gain before they are halved
TINY = 1e-3  # steps this small end the search
KEPT = 0.93  # share of the direction before that goes on
EVEN = 10.0  # how much further prices of a pair go together at all positions than each for itself

Report = Callable[[float], None]


@dataclass
class Prices:
    """Lagrange multipliers: what a region pays in one part, which it gets back in another."""

    bits: Array  # (E, 2, 2, P) in the walk [pair, side, other not yet or already finished, position], back in the pairs
    member: Array  # (P, F) in the sets of a size, back in the walk at every position before
    visit: Array  # (F,) for being met at all; it is met once
    chain: Array  # (P, F) in the chain, back in the walk

    def arrays(self) -> tuple[Array, Array, Array, Array]:
        """All of them."""
        return self.bits, self.member, self.visit, self.chain

    def plus(self, factor: float, other: "Prices") -> "Prices":
        """The sum with a multiple of others."""
        return Prices(*(x + factor * y for x, y in zip(self.arrays(), other.arrays(), strict=True)))

    def times(self, other: "Prices") -> float:
        """The scalar product."""
        return sum(float((x * y).sum()) for x, y in zip(self.arrays(), other.arrays(), strict=True))

    def of_walk(self, parts: Parts) -> Array:
        """(P, F) what a region pays in the walk at each position."""
        paid = np.broadcast_to(self.visit, self.chain.shape) - (0.0 if parts.chain is None else self.chain)
        if parts.boxes is not None and len(paid) > 2:
            paid[:-2] -= np.cumsum(self.member[-2:0:-1], axis=0)[::-1]
        return paid

    def conditioned(self) -> "Prices":
        """A direction in which each kind moves as far as pays off: members pay at every position, pairs mostly together."""
        even = self.bits + EVEN * self.bits.mean(axis=3, keepdims=True)
        return Prices(even, 0.2 * self.member, 3 * self.visit, 0.3 * self.chain)


def no_prices(parts: Parts) -> Prices:
    """Where the search begins."""
    count = len(parts.first)
    return Prices(np.zeros((len(parts.pairs.ends), 2, 2, count)), *(np.zeros(s) for s in ((count, count), count, (count, count))))


@dataclass(frozen=True)
class Answer:
    """The bound under given prices, and where the parts disagree: a subgradient."""

    bound: float
    slope: Prices


def evaluate(parts: Parts, walk: Walk, prices: Prices) -> Answer:
    """The bound under some prices: valid whatever they are."""
    slope = no_prices(parts)
    met = np.zeros_like(prices.member)
    bound = parts.pairs.constant - float(prices.visit.sum()) + _walk(parts, walk, prices, slope, met)
    bound += cheapest_pairs(parts.pairs.ends, parts.pairs.change, prices.bits, parts.first, parts.last, slope.bits)
    slope.visit = met.sum(axis=0) - 1
    if parts.boxes is not None:
        value, held = parts.boxes.cheapest(prices.member)
        bound += value
        slope.member[1:] = held[1:] - np.cumsum(met, axis=0)[:-1]
        slope.member[-1] = 0.0
    if parts.chain is not None:
        regions = np.zeros(len(met), np.int64)
        possible = np.where(np.isfinite(parts.steps.fixed), prices.chain, np.inf)
        bound += cheapest_chain(possible, parts.chain.between, parts.chain.start, regions)
        slope.chain = -met
        slope.chain[np.arange(len(met)), regions] += 1
    return Answer(float(bound), slope)


def _walk(parts: Parts, walk: Walk, prices: Prices, slope: Prices, met: Array) -> float:
    """The cheapest walk; fills which region is where and adds its choices to the slope."""
    count, pairs = len(met), parts.pairs
    regions, finished = np.zeros(count, np.int64), np.zeros((count, pairs.near.shape[1]), np.int64)
    value = np.empty((count + 1, walk.one.shape[2], walk.two.shape[2]))
    cost = cheapest_walk(walk, prices.of_walk(parts), prices.bits, value, regions, finished)
    met[np.arange(count), regions] = 1
    here = pairs.near[regions] >= 0
    at = np.broadcast_to(np.arange(count)[:, None], here.shape)[here]
    np.add.at(slope.bits, (pairs.pair[regions][here], pairs.side[regions][here], finished[here], at), 1)
    return cost


def lower_bound(
    problem: SequencingProblem,
    w: Array,
    best: float,
    resolved: Resolved | None = None,
    steps: int = STEPS,
    should_stop: Callable[[], bool] = lambda: False,
    report: Report = lambda _bound: None,
) -> float:
    """A cost that no sequence goes below.

    Args:
        problem: The tool and its features.
        w: Weights, shape (n + m,).
        best: Cost of the best sequence known, finished regions included: what the steps aim at.
        resolved: Constraints.
        steps: Subgradient steps, each a new set of prices.
        should_stop: Asked after every step.
        report: Told every better bound.

    Returns:
        The best bound met, never above `best`; -inf when a feature declares nothing that could bound it.
    """
    w, r = problem.check_weights(w), resolved or resolve(None, problem.n)
    if _unknown(problem, w):
        return -np.inf
    spent = problem.cost_of(w, r.done)
    if not r.free:
        return min(best, spent)
    ascent = Ascent(split(problem, w, r), best - spent, lambda bound: report(bound + spent))
    for cells, share, far in ((COARSE, 1 - REFINED, 1.0), (MIDDLE, REFINED, STRIDE)):
        ascent.far = far
        if ascent.climb(cells, max(1, round(share * steps)), should_stop):
            break
    ascent.try_out(FINE)
    return min(best, ascent.bound + spent)


def _unknown(problem: SequencingProblem, w: Array) -> bool:
    """Whether something counts of which nothing is known but its values."""
    columns, factors = declare(problem.graph, problem.features), problem.features.factors
    counted = {i for i in range(len(columns)) if w[i]}
    for j, i in enumerate(problem.interactions):
        counted |= {*factors[i.first], *factors[i.second]} if w[len(columns) + j] else set()
    return any(isinstance(columns[i], Undeclared) for i in counted)


class Ascent:
    """The search for good prices.

    A step goes along the averaged subgradient, as far as would close the gap to `best` if the bound were linear, times a
    factor that halves whenever nothing has helped for a while.
    """

    def __init__(self, parts: Parts, best: float, report: Report) -> None:
        self.parts, self.best, self.report = parts, best, report
        self.prices = self.kept = no_prices(parts)
        self.bound, self.far = -np.inf, 1.0

    def climb(self, cells: int, steps: int, should_stop: Callable[[], bool]) -> bool:
        """Take steps with tables of a size; True when there is nothing left to do."""
        walk = self.parts.steps.walk(self.parts.pairs, cells)
        direction: Prices | None = None
        idle, highest = 0, -np.inf
        for _ in range(steps):
            answer = evaluate(self.parts, walk, self.prices)
            idle = 0 if answer.bound > highest + 1e-4 * abs(self.best - highest) else idle + 1
            if answer.bound > highest:
                highest, self.kept = answer.bound, self.prices
                self._met(answer.bound, self.prices)
            if self.bound >= self.best or not np.isfinite(answer.bound) or should_stop():
                return True
            if idle > PATIENCE:
                self.far, idle, self.prices, direction = self.far / 2, 0, self.kept, None
                answer = evaluate(self.parts, walk, self.prices)
            direction = answer.slope if direction is None else answer.slope.plus(KEPT, direction)
            way = direction.conditioned()
            norm = direction.times(way)
            if norm <= 0 or self.far < TINY:
                break
            self.prices = self.prices.plus(self.far * (self.best - answer.bound) / norm, way)
        self.prices = self.kept
        return False

    def try_out(self, cells: int) -> None:
        """The bound of the best prices with tables of a size."""
        if np.isfinite(self.bound) and self.bound < self.best:
            self._met(evaluate(self.parts, self.parts.steps.walk(self.parts.pairs, cells), self.kept).bound, self.kept)

    def _met(self, bound: float, prices: Prices) -> None:
        """Keep a bound, lowered by more than rounding can have raised it."""
        fixed = self.parts.steps.fixed
        size = float(np.abs(fixed[np.isfinite(fixed)]).sum()) + sum(float(np.abs(x).sum()) for x in prices.arrays())
        if bound - ROUNDING * size > self.bound:
            self.bound = bound - ROUNDING * size
            self.report(min(self.bound, self.best))
