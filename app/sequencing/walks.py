"""Relaxed sequences that know the sum behind one mean exactly (up to a rounding that is accounted for) and the rest roughly."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.geometry.tool import Array
from app.sequencing.intervals import Interval, chosen_sums, mean_step, product, weighted
from app.sequencing.problem import SequencingProblem
from app.sequencing.relaxations import cheapest_walk
from app.sequencing.structure import Declaration, MeanStep

LEVELS = 320  # values of the tracked sum, about


@dataclass(frozen=True)
class Walk:
    """A dynamic program over position and the level of a sum."""

    table: Array  # (F, F, L) least cost of region a at position p with the sum at a level
    step: NDArray[np.int64]  # (F,) what region a adds to the level
    start: int
    end: int

    def cheapest(self, price: Array) -> tuple[float, NDArray[np.int64]]:
        """The cheapest walk under prices (F, F), and the region at each position."""
        return cheapest_walk(self.table, np.ascontiguousarray(price), self.step, self.start, self.end)


@dataclass(frozen=True)
class Grid:
    """The tracked sum as whole steps of a unit: sum = middle * p + unit * level + error."""

    unit: float
    middle: float
    step: NDArray[np.int64]  # (F,)
    error: Interval  # (F + 1,) of the sum of p regions

    @property
    def start(self) -> int:
        """Levels start here, so that none is negative."""
        return int(-np.minimum(self.step, 0).sum())

    @property
    def levels(self) -> int:
        return int(np.abs(self.step).sum()) + 1


def grid_of(values: Array) -> Grid:
    """Units so that there are about LEVELS levels and rounding hurts least."""
    middle = float(values.mean())
    off = values - middle
    spread = float(np.abs(off).sum())
    if spread <= 1e-12 * max(1.0, float(np.abs(values).sum())):
        return Grid(1.0, middle, np.zeros(len(values), np.int64), chosen_sums(off))
    units = spread / LEVELS * np.linspace(1.0, 1.6, 61)
    errors = [float(np.abs(off - u * np.round(off / u)).sum()) for u in units]
    unit = float(units[int(np.argmin(errors))])
    step = np.round(off / unit).astype(np.int64)
    return Grid(unit, middle, step, chosen_sums(off - unit * step))


def walks_of(
    problem: SequencingProblem,
    columns: tuple[Declaration, ...],
    w: Array,
    v: Array,
    known: list[Interval],
    free: NDArray[np.int64],
    past: NDArray[np.int64],
) -> tuple[tuple[Walk, ...], list[int]]:
    """One walk per mean that costs anything (at least one), and the interactions that no walk holds."""
    factors = [[problem.features.factors[key] for key in (i.first, i.second)] for i in problem.interactions]
    means: list[Array] = []
    of: dict[int, int] = {}  # column -> mean
    for i, d in enumerate(columns):
        if isinstance(d, MeanStep):
            at = next((t for t, m in enumerate(means) if np.array_equal(m, d.averaged)), len(means))
            means += [d.averaged] * (at == len(means))
            of[i] = at
    held: dict[int, list[int]] = {t: [] for t in range(len(means))}
    left: list[int] = []
    for j, pair in enumerate(factors):
        within = [of[i] for side in pair for i in side if i in of]
        (held[min(within)] if within else left).append(j)
    walks = [
        _walk(columns, {i: w[i] for i in of if of[i] == t}, [(v[j], factors[j]) for j in held[t]], known, mean, free, past)
        for t, mean in enumerate(means)
    ]
    count = len(free)
    plain = Walk(np.zeros((count, count, 1)), np.zeros(count, np.int64), 0, 0)
    return tuple(walks) or (plain,), left


def _walk(
    columns: tuple[Declaration, ...],
    weights: dict[int, float],
    products: list[tuple[float, list[tuple[int, ...]]]],
    known: list[Interval],
    averaged: Array,
    free: NDArray[np.int64],
    past: NDArray[np.int64],
) -> Walk:
    grid, count = grid_of(averaged[free]), len(free)
    level = np.arange(grid.levels) - grid.start
    position = np.arange(count)
    size = np.maximum(position + len(past), 1)[:, None, None]
    exact = averaged[past].sum() + grid.middle * position[:, None, None] + grid.unit * level
    error = [x[:count, None, None] for x in (grid.error.low, grid.error.high)]
    mean = Interval((exact + error[0]) / size, (exact + error[1]) / size)
    wide = {i: Interval(x.low[..., None], x.high[..., None]) for i, x in enumerate(known)}
    for i in weights:
        d = columns[i]
        assert isinstance(d, MeanStep)
        narrow = mean_step(d, d.own[free][:, None], d.static[free][:, None], mean)
        low, high = np.array(narrow.low), np.array(narrow.high)
        low[0], high[0] = wide[i].low[0], wide[i].high[0]
        wide[i] = Interval(low, high)
    table = np.zeros((count, count, grid.levels))
    for i, weight in weights.items():
        table += weighted(weight, wide[i])
    for weight, sides in products:
        one, two = (_total([wide[i] for i in side]) for side in sides)
        table += weighted(weight, product(one, two))
    return Walk(table, grid.step, grid.start, grid.start + int(grid.step.sum()))


def _total(intervals: list[Interval]) -> Interval:
    total = intervals[0]
    for interval in intervals[1:]:
        total = total + interval
    return total
