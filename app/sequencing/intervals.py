"""Between which values a declared feature lies when only the number of finished regions is known."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.geometry.tool import Array
from app.sequencing.structure import Between, Declaration, FirstTouch, Gap, MeanStep, Pairwise, Rank


@dataclass(frozen=True)
class Interval:
    """Lowest and highest value, arrays of one shape or ones that broadcast."""

    low: Array
    high: Array

    def __add__(self, other: "Interval") -> "Interval":
        return Interval(self.low + other.low, self.high + other.high)


def exactly(values: Array) -> Interval:
    """A value that is known."""
    return Interval(values, values)


def weighted(weight: float, interval: Interval) -> Array:
    """The least of weight times a value in the interval."""
    if weight == 0:
        return np.zeros_like(interval.low)
    return weight * (interval.low if weight > 0 else interval.high)


def product(one: Interval, two: Interval) -> Interval:
    """Between which values the product lies."""
    corners = [_times(x, y) for x in (one.low, one.high) for y in (two.low, two.high)]
    return Interval(np.minimum.reduce(corners), np.maximum.reduce(corners))


def _times(x: Array, y: Array) -> Array:
    with np.errstate(invalid="ignore"):
        out = x * y
    return np.where(np.isnan(out), 0.0, out)  # 0 times infinite: what is 0 stays 0


def sum_of(intervals: list[Interval]) -> Interval:
    """The interval of a sum."""
    total = intervals[0]
    for interval in intervals[1:]:
        total = total + interval
    return total


def mean_step(d: MeanStep, own: Array, static: Array, mean: Interval) -> Interval:
    """Values of a mean step when the mean lies in an interval."""
    near, far = own - mean.high, own - mean.low
    ends = [np.where(x > 0, d.rise * x, -d.fall * x) for x in (near, far)]
    turn = np.where((near < 0) & (far > 0), 0.0, ends[0])
    return Interval(np.minimum.reduce([*ends, turn]) + static, np.maximum.reduce([*ends, turn]) + static)


def chosen_sums(values: Array) -> Interval:
    """Least and largest sum of p of the values along the last axis, p = 0 .. length, (..., length + 1)."""
    ranked = np.sort(values, axis=-1)
    none = np.zeros((*values.shape[:-1], 1))
    low = np.concatenate([none, np.cumsum(ranked, axis=-1)], axis=-1)
    high = np.concatenate([none, np.cumsum(ranked[..., ::-1], axis=-1)], axis=-1)
    return Interval(low, high)


def interval_of(d: Declaration, free: NDArray[np.int64], past: NDArray[np.int64], n: int) -> Interval:
    """Values of a column for each number p of free regions finished and each free region, (F, F).

    `past` are the regions finished before; of n regions those in neither are never finished. Exact for p = 0.
    """
    count = len(free)
    wide = _widest(d, free, past, n)
    low, high = (np.array(np.broadcast_to(x, (count, count))) for x in (wide.low, wide.high))
    done = np.zeros((1, n), np.bool_)
    done[0, past] = True
    first = d.values(done)[0, free] if d.empty is None or len(past) else d.empty[free]
    low[0], high[0] = first, first
    return Interval(low, high)


def _widest(d: Declaration, free: NDArray[np.int64], past: NDArray[np.int64], n: int) -> Interval:
    count = len(free)
    match d:
        case Pairwise():
            base = d.start[free] + d.change[np.ix_(free, past)].sum(axis=1)
            sums = chosen_sums(others(d.change[np.ix_(free, free)]))
            return Interval(base + sums.low.T, base + sums.high.T)
        case MeanStep():
            return mean_step(d, d.own[free], d.static[free], mean_interval(d.averaged, free, past))
        case FirstTouch():
            values = [*(value for _, value in d.tests), d.otherwise]
            return Interval(np.array(min(values)), np.array(max(values)))
        case Rank():
            return exactly(d.table[len(past) : len(past) + count][:, free])
        case Between():
            return _cuts(d.matrix, np.arange(count) + len(past), n)
        case Gap():
            return gap_interval(d)
        case _:
            return Interval(np.array(-np.inf), np.array(np.inf))


def others(square: Array) -> Array:
    """A square matrix without its diagonal, (F, F - 1)."""
    count = len(square)
    return square[~np.eye(count, dtype=np.bool_)].reshape(count, max(count - 1, 0))


def mean_interval(averaged: Array, free: NDArray[np.int64], past: NDArray[np.int64]) -> Interval:
    """Where the mean of the finished regions can lie for each number of free ones among them, (F, 1)."""
    sums, count = chosen_sums(averaged[free]), len(free)
    size = np.maximum(np.arange(count) + len(past), 1)
    base = averaged[past].sum()
    return Interval(((base + sums.low[:count]) / size)[:, None], ((base + sums.high[:count]) / size)[:, None])


def gap_interval(d: Gap) -> Interval:
    """A gap is at most 1; at least 0 within the outline, elsewhere at least what the smallest box leaves."""
    if d.shape == "within":
        return Interval(np.array(0.0), np.array(1.0))
    smallest = float(np.prod(d.high - d.low, axis=1).min())  # a box or hull of more holds the box of each
    least = 1 - float(d.area.sum()) / smallest if smallest > 0 else -np.inf
    return Interval(np.array(min(0.0, least)), np.array(1.0))


def _cuts(matrix: Array, size: NDArray[np.int64], n: int) -> Interval:
    """Cuts of every size, (F, 1): by the second eigenvalue of the Laplacian where weights are symmetric and none is negative."""
    positive, negative = float(np.maximum(matrix, 0).sum()), float(np.minimum(matrix, 0).sum())
    low = np.full((len(size), 1), negative)
    if negative == 0 and np.array_equal(matrix, matrix.T) and n > 1:
        laplacian = np.diag(matrix.sum(axis=1)) - matrix
        second = max(0.0, float(np.linalg.eigvalsh(laplacian)[1]) - 1e-9 * positive)
        low[:, 0] = second * size * (n - size) / n
    return Interval(low, np.full((len(size), 1), positive))
