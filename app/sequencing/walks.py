"""The tables of the relaxed sequence (`relaxed_walk`): what is known of a step from its position and two rounded sums."""

from dataclasses import dataclass

import numpy as np

from app.geometry.tool import Array
from app.sequencing.intervals import Interval, chosen_sums, mean_step, product, sum_of, weighted
from app.sequencing.pairs import Pairs
from app.sequencing.relaxations import Ints
from app.sequencing.relaxed_walk import Walk
from app.sequencing.structure import MeanStep

TRACKED = 2  # means
UNITS = 120  # roundings that are tried
LOCAL = 10  # levels of the second sum that one level of the first costs as much as


@dataclass(frozen=True)
class Tracked:
    """A mean over the finished regions, and the columns that compare regions with it."""

    averaged: Array  # (F,)
    total: float  # over the regions finished before
    steps: dict[int, tuple[float, MeanStep]]  # column -> weight and declaration, for the free regions

    @property
    def importance(self) -> float:
        """How much a wrong mean costs, per unit."""
        return sum(abs(w) * (abs(d.rise) + abs(d.fall)) for w, d in self.steps.values()) + 1e-9


@dataclass(frozen=True)
class Product:
    """Weight times the product of two sums of columns."""

    weight: float
    one: tuple[int, ...]
    two: tuple[int, ...]


@dataclass(frozen=True)
class Steps:
    """What the steps of F free regions cost besides what other relaxed problems pay."""

    fixed: Array  # (F, F) [position, region]
    count: int  # regions finished before
    tracked: tuple[Tracked, Tracked]
    known: list[Interval]  # of every column, (F, F)
    products: tuple[Product, ...]  # between and within the tracked means
    local: Product | None  # of the first mean's columns and columns linear in what is finished
    start: Array  # (F,) those columns with nothing finished
    pull: Array  # (F, F) [a, b] and what b adds to them for a

    def walk(self, pairs: Pairs, cells: int) -> Walk:
        """The tables with about `cells` pairs of levels."""
        return _Tables(self, cells).walk(pairs)


@dataclass(frozen=True)
class Grid:
    """A sum as whole steps of a unit: sum = middle * p + unit * level + error."""

    unit: float
    middle: float
    step: Ints  # (F,)
    error: Interval  # (F + 1,) of the sum of p regions

    @property
    def reach(self) -> Interval:
        """Lowest and highest level after p regions, (F + 1,)."""
        return chosen_sums(self.step.astype(np.float64))

    @property
    def levels(self) -> int:
        reach = self.reach
        return int(reach.high.max() - reach.low.min()) + 1


@dataclass(frozen=True)
class Roundings:
    """Ways to round a sum: units and middles, how many levels they make and how far the sum may be off."""

    unit: Array  # (C,)
    middle: Array  # (C,)
    levels: Ints  # (C,)
    off: Array  # (C,)

    def grid(self, i: int, values: Array) -> Grid:
        """The i-th way, carried out."""
        apart = values - self.middle[i]
        step = np.round(apart / self.unit[i]).astype(np.int64)
        return Grid(float(self.unit[i]), float(self.middle[i]), step, chosen_sums(apart - self.unit[i] * step))


def roundings_of(values: Array, most: int) -> Roundings:
    """Roundings with up to about `most` levels, coarse to fine; the first has one level."""
    middles = np.unique([values.mean(), np.median(values), values.min()])
    size = np.abs(values - middles[:, None]).sum(axis=1)
    parts = np.unique(np.round(np.geomspace(2, max(2 * most, 3), UNITS), 1))
    unit = np.maximum(size[:, None] / parts, 1e-300)
    unit[:, 0] = 4 * (np.ptp(values) + 1e-300)
    unit, middle = unit.ravel(), np.repeat(middles, len(parts))
    apart = values - middle[:, None]
    step = np.round(apart / unit[:, None])
    off, reach = chosen_sums(apart - unit[:, None] * step), chosen_sums(step)
    levels = (reach.high.max(axis=1) - reach.low.min(axis=1)).astype(np.int64) + 1
    return Roundings(unit, middle, levels, (off.high - off.low).max(axis=1))


def best_grids(tracked: tuple[Tracked, Tracked], cells: int) -> tuple[Grid, Grid]:
    """The two roundings that hurt least together."""
    one, two = (roundings_of(t.averaged, cells) for t in tracked)
    size = one.levels[:, None] * (two.levels + LOCAL)
    harm = tracked[0].importance * one.off[:, None] + tracked[1].importance * two.off
    loss = np.where(size <= max(cells, size.min()), harm + 1e-12 * size, np.inf)
    i, j = np.unravel_index(int(loss.argmin()), loss.shape)
    return one.grid(int(i), tracked[0].averaged), two.grid(int(j), tracked[1].averaged)


class _Tables:
    """One rounding of the two sums, and the columns as far as it knows them."""

    def __init__(self, steps: Steps, cells: int) -> None:
        self.steps, self.count = steps, len(steps.fixed)
        self.grids = best_grids(steps.tracked, cells)
        self.wide: dict[int, Interval] = {}
        for t, grid in zip(steps.tracked, self.grids, strict=True):
            mean = self._mean(t, grid)
            for i, (_, d) in t.steps.items():
                self.wide[i] = mean_step(d, d.own[:, None], d.static[:, None], mean)

    def _mean(self, t: Tracked, grid: Grid) -> Interval:
        position = np.arange(self.count)[:, None, None]
        level = np.arange(grid.levels) + int(grid.reach.low.min())
        exact = t.total + grid.middle * position + grid.unit * level
        low, high = (x[: self.count, None, None] for x in (grid.error.low, grid.error.high))
        size = np.maximum(position + self.steps.count, 1)
        return Interval((exact + low) / size, (exact + high) / size)

    def walk(self, pairs: Pairs) -> Walk:
        steps, count = self.steps, self.count
        tables = [np.zeros((count, count, g.levels)) for g in self.grids]
        for t, table in zip(steps.tracked, tables, strict=True):
            for i, (weight, _) in t.steps.items():
                table += weighted(weight, self.wide[i])
        terms: list[list[tuple[Array, Array]]] = []
        for p in steps.products:
            at = self._means(p)
            if at == {0, 1}:
                terms.append(self._term(p))
            else:
                tables[at.pop()] += weighted(p.weight, product(self._factor(p.one), self._factor(p.two)))
        left, right = self._terms(terms)
        weight, pull = self._around(pairs)
        reach = [g.reach for g in self.grids]
        return Walk(
            steps.fixed, tables[0], tables[1], left, right, self._ends(), weight, pull, pairs.near, pairs.pair, pairs.side, pairs.kind,
            pairs.touch, pairs.reached, np.stack([g.step for g in self.grids]),
            np.stack([np.round(r.low).astype(np.int64) for r in reach]), np.stack([np.round(r.high).astype(np.int64) for r in reach]),
        )  # fmt: skip

    def _means(self, p: Product) -> set[int]:
        return {t for t in range(TRACKED) for i in (*p.one, *p.two) if i in self.steps.tracked[t].steps}

    def _factor(self, columns: tuple[int, ...]) -> Interval:
        known = self.steps.known
        return sum_of([self.wide[i] if i in self.wide else Interval(known[i].low[..., None], known[i].high[..., None]) for i in columns])

    def _term(self, p: Product) -> list[tuple[Array, Array]]:
        """Products of which the least is a lower bound: one where no factor is negative, else all corners."""
        first = p.one if p.one[0] in self.steps.tracked[0].steps else p.two
        one, two = self._factor(first), self._factor(p.two if first is p.one else p.one)
        corners = [(p.weight * x, y) for x in (one.low, one.high) for y in (two.low, two.high)]
        if one.low[1:].min(initial=0) >= 0 and two.low[1:].min(initial=0) >= 0:
            return [corners[0 if p.weight > 0 else 3]] * len(corners)
        return corners

    def _terms(self, terms: list[list[tuple[Array, Array]]]) -> tuple[Array, Array]:
        if not terms:
            nothing = [np.zeros((1, 1, self.count, self.count, g.levels)) for g in self.grids]
            return nothing[0], nothing[1]
        kept = 1 if all(x is term[0] for term in terms for x in term) else len(terms[0])
        return np.array([[x for x, _ in term[:kept]] for term in terms]), np.array([[y for _, y in term[:kept]] for term in terms])

    def _ends(self) -> Array:
        """Values of the local product's first factor that bound it from below."""
        p = self.steps.local
        if p is None:
            return np.zeros((1, self.count, self.count, self.grids[0].levels))
        factor, other = self._factor(p.one), sum_of([self.steps.known[i] for i in p.two])
        paid = Interval(*sorted((p.weight * other.low, p.weight * other.high), key=lambda x: x.sum()))
        if paid.low.min() >= 0:
            return factor.low[None].copy()
        if paid.high.max() <= 0:
            return factor.high[None].copy()
        return np.stack([factor.low, factor.high])

    def _around(self, pairs: Pairs) -> tuple[Array, Array]:
        weight = 0.0 if self.steps.local is None else self.steps.local.weight
        rows = np.arange(self.count)[:, None]
        return weight * self.steps.start, np.where(pairs.near >= 0, weight * self.steps.pull[rows, pairs.near], 0.0)
