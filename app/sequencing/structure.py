"""How features depend on the set of finished regions, said in a way that a kernel can be composed from.

A feature declares one of the forms below; `values` computes it for many sets at once, and `forms` turns the declarations of
all features and their weights into the arrays of the compiled kernels. What declares nothing falls back to a table.
Every form takes `empty`: what the feature is while nothing is finished, where the definition makes an exception of it.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from app.geometry.tool import Array, RegionGraph
from app.sequencing.gaps import box_gaps, hull_gaps

Sets = NDArray[np.bool_]  # (M, N) one set of finished regions per row
Plugin = Callable[[RegionGraph, Sets], Array]  # (M, N) values of an undeclared feature


@dataclass(frozen=True, eq=False)
class Pairwise:
    """start[a] + the sum over finished b of change[a, b]; a static feature has no change."""

    start: Array  # (N,)
    change: Array  # (N, N)
    empty: Array | None = None  # (N,)

    def values(self, done: Sets) -> Array:
        return self.start + done.astype(np.float64) @ self.change.T


@dataclass(frozen=True, eq=False)
class MeanStep:
    """The distance of a region from the mean of the finished ones, with a slope for either direction, plus a static part."""

    averaged: Array  # (N,) what the mean is taken of
    own: Array  # (N,) what is compared with the mean
    rise: float  # slope where the region lies above the mean
    fall: float  # slope where it lies below
    static: Array  # (N,)
    empty: Array | None = None

    def values(self, done: Sets) -> Array:
        member = done.astype(np.float64)
        step = self.own - (member @ self.averaged)[:, None] / np.maximum(member.sum(axis=1, keepdims=True), 1)
        return np.where(step > 0, self.rise * step, -self.fall * step) + self.static


@dataclass(frozen=True, eq=False)
class FirstTouch:
    """The value of the first test that some finished region passes, else `otherwise`."""

    tests: tuple[tuple[NDArray[np.bool_], float], ...]  # (N, N) [a, b]: finished b passes for region a; the value then
    otherwise: float
    empty: Array | None = None

    def values(self, done: Sets) -> Array:
        out = np.full(done.shape, self.otherwise)
        for touching, value in reversed(self.tests):
            out[(done.astype(np.float64) @ touching.T.astype(np.float64)) > 0.5] = value
        return out


@dataclass(frozen=True, eq=False)
class Gap:
    """1 - area of a set / area of its bounding box or hull, of the finished or the unfinished regions; 0 for at most one.

    The box's area is its width by height if `plain`, else the areas of the regions times the share of each one's own box that
    lies in it: within the tool's outline. A hull's area is that of the convex hull of the corners.
    """

    low: Array  # (N, 2)
    high: Array  # (N, 2)
    area: Array  # (N,)
    of: Literal["done", "left"] = "done"
    shape: Literal["within", "plain", "hull"] = "within"
    empty: Array | None = None

    def of_sets(self, done: Sets) -> Array:
        """(M,) one value per set."""
        inside = np.require(done if self.of == "done" else ~done, np.bool_, ["C", "W"])
        # stored arrays may be read-only, which the kernel would be compiled for once more
        low, high, area = (np.require(x, np.float64, ["C", "W"]) for x in (self.low, self.high, self.area))
        return hull_gaps(inside, low, high, area) if self.shape == "hull" else box_gaps(inside, low, high, area, self.shape == "plain")

    def values(self, done: Sets) -> Array:
        return np.broadcast_to(self.of_sets(done)[:, None], done.shape)


@dataclass(frozen=True, eq=False)
class Between:
    """The sum of matrix[b, c] over finished b and unfinished c: borders that lie open."""

    matrix: Array  # (N, N)
    empty: Array | None = None

    def of_sets(self, done: Sets) -> Array:
        """(M,) one value per set."""
        member = done.astype(np.float64)
        return (member @ self.matrix * (1 - member)).sum(axis=1)

    def values(self, done: Sets) -> Array:
        return np.broadcast_to(self.of_sets(done)[:, None], done.shape)


@dataclass(frozen=True, eq=False)
class Rank:
    """A value by how many regions are finished and which comes next."""

    table: Array  # (N, N) [number finished, a]
    empty: Array | None = None

    def values(self, done: Sets) -> Array:
        return self.table[np.minimum(done.sum(axis=1), done.shape[1] - 1)]


@dataclass(frozen=True, eq=False)
class Undeclared:
    """A feature known only by its values."""

    plugin: Plugin
    graph: RegionGraph
    empty: Array | None = None

    def values(self, done: Sets) -> Array:
        return np.asarray(self.plugin(self.graph, done), np.float64)


Declaration = Pairwise | MeanStep | FirstTouch | Gap | Between | Rank | Undeclared
OfSet = (Gap, Between)  # forms that don't depend on the next region


def evaluate(declarations: tuple[Declaration, ...], done: Sets) -> Array:
    """Values of all columns, (M, N, n)."""
    nothing = ~done.any(axis=1)
    out = np.empty((*done.shape, len(declarations)))
    for i, d in enumerate(declarations):
        out[..., i] = d.values(done)
        if d.empty is not None:
            out[nothing, :, i] = d.empty
    return out
