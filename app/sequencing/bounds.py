"""Lower bounds on the cost of every sequence of a tool, for tools too large for the exact dynamic program.

The cost is split into parts that are easy on their own, and each part is free to choose its own order:

    pairs       what a region pays for each single region before it: each pair is ordered the cheaper way
    walks       one per mean (curvature, height): an exact dynamic program over position and the sum so far, in which a region
                may be met twice
    sets        the gaps: for every number of finished regions the cheapest set in the cheapest pair of boxes

Their optima add up to a bound. Prices (Lagrange multipliers) make the parts agree: a region pays a price for being at a
position in one part and gets it back in another, which changes no sequence's cost. Every choice of prices gives a valid
bound; subgradient steps look for good ones and the best bound met counts. What no part models enters with the least value
it can have at each position. At the end the bound is lowered by more than rounding could have raised it.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.geometry.tool import Array
from app.sequencing.boxes import Boxes, boxes_of
from app.sequencing.constraints import Resolved, resolve
from app.sequencing.features import declare
from app.sequencing.intervals import Interval, interval_of, product, weighted
from app.sequencing.large import between_costs
from app.sequencing.problem import SequencingProblem
from app.sequencing.relaxations import cheapest_pairs
from app.sequencing.structure import MeanStep, Pairwise
from app.sequencing.walks import Walk, walks_of

ROUNDING = 1e-9  # of the largest price or cost involved, per position: far more than float64 can lose
STEPS = 400  # of the subgradient method


@dataclass(frozen=True)
class Parts:
    """The cost of an order of F free regions, split."""

    fixed: Array  # (F, F) [position, region] paid in any case
    change: Array  # (F, F) [a, b] what a pays when b is before it
    before: NDArray[np.bool_]  # (F, F)
    walks: tuple[Walk, ...]
    boxes: Boxes | None
    constant: float


@dataclass
class Prices:
    """Lagrange multipliers: what a region pays in each part, which it gets back in the last walk."""

    place: Array  # (F,) in the pairs, per region before it
    member: Array  # (F,) in the sets, per set that holds it
    visit: Array  # (F,) for being met at all; it is met once
    walk: Array  # (T - 1, F, F) in every walk but the last, per position

    def of_last(self) -> Array:
        """(F, F) what a region gets back at each position."""
        count = len(self.place)
        position = np.arange(count)[:, None]
        return self.visit - self.place * position - self.member * (count - 1 - position) - self.walk.sum(axis=0)


def split(problem: SequencingProblem, w: Array, resolved: Resolved) -> Parts:
    """The parts of w . phi over the orders of the free regions."""
    free, past, n = np.array(resolved.free, np.int64), np.array(resolved.done, np.int64), problem.n
    count, count_columns = len(free), len(problem.features.columns)
    columns, v = declare(problem.graph, problem.features), w[count_columns:]
    known = [interval_of(d, free, past, n) for d in columns]
    fixed, change = np.zeros((count, count)), np.zeros((count, count))
    boxes = boxes_of(columns, w, free, past, n)
    for i, d in enumerate(columns):
        match d:
            case Pairwise():
                change += w[i] * d.change[np.ix_(free, free)]
                start = d.start[free] + d.change[np.ix_(free, past)].sum(axis=1)
                fixed += w[i] * start
                fixed[0] += w[i] * (known[i].low[0] - start)
            case MeanStep():
                pass  # in a walk
            case _ if boxes is not None and i in boxes.columns:
                pass
            case _:
                fixed += weighted(w[i], known[i])
    between, first = between_costs(problem, w)
    way_in = between[np.ix_([*past[-1:], *free], free)]
    np.fill_diagonal(way_in[len(way_in) - count :], np.inf)
    fixed += np.minimum(way_in.min(axis=0), np.inf if len(past) else first[free])
    walks, left = walks_of(problem, columns, w[:count_columns], v, known, free, past)
    for j in left:
        fixed += weighted(float(v[j]), product(*_factors(problem, known, j)))
    before = resolved.before[np.ix_(free, free)]
    return Parts(fixed, change, before, walks, boxes, 0.0)


def _factors(problem: SequencingProblem, known: list[Interval], j: int) -> tuple[Interval, Interval]:
    one, two = (problem.features.factors[key] for key in (problem.interactions[j].first, problem.interactions[j].second))
    return sum_of([known[i] for i in one]), sum_of([known[i] for i in two])


def sum_of(intervals: list[Interval]) -> Interval:
    """The interval of a sum."""
    total = intervals[0]
    for interval in intervals[1:]:
        total = total + interval
    return total


@dataclass(frozen=True)
class Answer:
    """What the parts cost and chose under given prices."""

    bound: float
    place: Array  # (F,) regions before each, in the pairs
    member: Array  # (F,) sets that hold each, in the sets
    visits: Array  # (T, F, F) 1 where a walk meets a region at a position


def evaluate(parts: Parts, prices: Prices) -> Answer:
    """The bound under some prices: valid whatever they are."""
    count = len(parts.fixed)
    place, visits = np.zeros(count), np.zeros((len(parts.walks), count, count))
    bound = parts.constant + cheapest_pairs(parts.change, prices.place, parts.before, place) - prices.visit.sum()
    member = prices.member * 0.0
    if parts.boxes is not None:
        value, member = parts.boxes.cheapest(prices.member)
        bound += value
    paid = prices.of_last() + parts.fixed
    for t, walk in enumerate(parts.walks):
        value, regions = walk.cheapest(paid if t == len(parts.walks) - 1 else prices.walk[t])
        bound += value
        visits[t, np.arange(count), regions] = 1.0
    return Answer(float(bound), place, member, visits)


def lower_bound(
    problem: SequencingProblem,
    w: Array,
    best: float,
    resolved: Resolved | None = None,
    steps: int = STEPS,
    should_stop: Callable[[], bool] = lambda: False,
) -> float:
    """A cost that no sequence goes below.

    Args:
        problem: The tool and its features.
        w: Weights, shape (n + m,).
        best: Cost of the best sequence known: what the steps aim at.
        resolved: Constraints; the bound is for what comes after the finished regions.
        steps: Subgradient steps, each a new set of prices.
        should_stop: Asked after every step.

    Returns:
        The best bound met, never above `best`; -inf when a feature declares nothing that could bound it.
    """
    w = problem.check_weights(w)
    r = resolved or resolve(None, problem.n)
    parts = split(problem, w, r)
    bound, scale = ascend(parts, best, steps, should_stop)
    return min(best, bound - ROUNDING * scale)


def ascend(parts: Parts, best: float, steps: int, should_stop: Callable[[], bool]) -> tuple[float, float]:
    """The best bound met and the size of the numbers it was made of.

    A step goes along the averaged subgradient, as far as would close the gap to `best` if the bound were linear, times a
    factor that halves whenever nothing has helped for a while.
    """
    count = len(parts.fixed)
    prices = Prices(np.zeros(count), np.zeros(count), np.zeros(count), np.zeros((max(len(parts.walks) - 1, 0), count, count)))
    kept, bound, scale, far, idle = prices, -np.inf, 0.0, 1.0, 0
    direction: Prices | None = None
    for _ in range(steps):
        answer = evaluate(parts, prices)
        if answer.bound > bound + 1e-4 * abs(best - bound):
            idle = 0
        else:
            idle += 1
        if answer.bound > bound:
            bound, kept, scale = answer.bound, prices, _size(parts, prices)
        if bound >= best or not np.isfinite(answer.bound) or should_stop():
            break
        if idle > 15:
            far, idle, prices, direction = far / 2, 0, kept, None
            answer = evaluate(parts, prices)
        direction = _blend(direction, slope_of(parts, prices, answer))
        norm = sum(float((x * x).sum()) * f for x, f in zip(_arrays(direction), _reach(count), strict=True))
        if norm == 0 or far < 1e-3:
            break
        step = far * (best - answer.bound) / norm
        prices = Prices(*(x + step * f * y for x, y, f in zip(_arrays(prices), _arrays(direction), _reach(count), strict=True)))
    return bound, scale


def slope_of(parts: Parts, prices: Prices, answer: Answer) -> Prices:
    """A subgradient of the bound: where the parts disagree."""
    last = answer.visits[-1]
    count = len(last)
    position = np.arange(count)[:, None]
    met = last.sum(axis=0)
    held = (last * (count - 1 - position)).sum(axis=0)
    return Prices(
        answer.place - (last * position).sum(axis=0),
        answer.member - held if parts.boxes is not None else np.zeros(count),
        met - 1,
        answer.visits[:-1] - last,
    )


def _blend(old: Prices | None, new: Prices) -> Prices:
    if old is None:
        return new
    return Prices(*(y + 0.7 * x for x, y in zip(_arrays(old), _arrays(new), strict=True)))


def _arrays(prices: Prices) -> tuple[Array, Array, Array, Array]:
    return prices.place, prices.member, prices.visit, prices.walk


def _reach(count: int) -> tuple[float, float, float, float]:
    """How far each kind of price moves along its slope, which is longer where positions or sets are counted."""
    return 0.3 / count**2, 0.3 / count**2, 1.0, 1.0


def _size(parts: Parts, prices: Prices) -> float:
    """What rounding is relative to: the sum of everything that was added."""
    count = len(parts.fixed)
    sums = [float(np.abs(x).sum()) for x in (parts.change, prices.visit, prices.place * count, prices.member * count)]
    return count * float(np.abs(parts.fixed).max(initial=0) + np.abs(prices.walk).max(initial=0)) + sum(sums)
