"""Reduced coordinates: the directions of the weights that any tool at hand can tell apart.

A feature whose sum is a constant of every tool says nothing; two features whose sums add up to a constant say one thing
together, of which either sign makes sense. Learning in all columns would call "everything ties" a perfect fit.
"""

from collections.abc import Sequence as Ordered
from dataclasses import dataclass

import numpy as np

from app.learning.many_optima import random_orders, sums_of
from app.learning.qp import Array
from app.learning.sampling import feature_scale
from app.sequencing.problem import SequencingProblem

POOL = 60  # random sequences per tool from which dependencies are read
ALIKE = 1e-9  # share of its spread that a column may differ from a multiple of another

Sign = int  # 1: the weight is at least 0, 0: either sign, -1: at most 0


@dataclass(frozen=True)
class Coordinate:
    """One direction the tools can tell apart: a column, or several whose sums are multiples of each other."""

    columns: tuple[int, ...]
    factors: tuple[float, ...]  # scaled feature sum of each column as a multiple of the first one's
    sign: Sign  # of the coordinate; after `Frame.reduce` a signed one is at least 0

    @property
    def free(self) -> bool:
        return self.sign == 0


@dataclass(frozen=True)
class Frame:
    """How weights (k,) and coordinates (r,) hang together."""

    scale: Array  # (k,) unit of each feature sum
    coordinates: tuple[Coordinate, ...]

    @staticmethod
    def of(problems: Ordered[SequencingProblem], signs: Ordered[Sign] | None = None) -> "Frame":
        """Read dependencies and units from random sequences of all tools of interest, demonstrated or not.

        Args:
            problems: Tools with the same columns.
            signs: Declared sign of each weight (k,); all at least 0 if None.
        """
        generator = np.random.default_rng(0)  # fixed: the frame is a property of the tools
        sums = [sums_of(p, random_orders(p, POOL, generator)) for p in problems]
        scale, live = feature_scale(sums)
        spread = np.concatenate([(block - block.mean(axis=0)) / scale for block in sums])
        declared = [1] * len(scale) if signs is None else list(signs)
        groups: list[tuple[list[int], list[float]]] = []
        for j in np.flatnonzero(live):
            for columns, factors in groups:
                first = spread[:, columns[0]]
                factor = float(first @ spread[:, j] / (first @ first))
                if np.abs(spread[:, j] - factor * first).max() < ALIKE * max(np.abs(first).max(), 1.0):
                    columns.append(int(j))
                    factors.append(factor)
                    break
            else:
                groups.append(([int(j)], [1.0]))
        return Frame(scale, tuple(Coordinate(tuple(c), tuple(f), _sign(c, f, declared)) for c, f in groups))

    @property
    def size(self) -> int:
        """r."""
        return len(self.coordinates)

    @property
    def signed(self) -> Array:
        """(r,) 1 where a coordinate is at least 0, 0 where it is free."""
        return np.array([0.0 if c.free else 1.0 for c in self.coordinates])

    @property
    def lift(self) -> Array:
        """(k, r) weights on the features as they are that have the same costs, up to a constant of the tool, as coordinates u."""
        lift = np.zeros((len(self.scale), self.size))
        for q, c in enumerate(self.coordinates):
            lift[c.columns[0], q] = (c.sign or 1) / self.scale[c.columns[0]]
        return lift

    def reduce(self, sums: Array) -> Array:
        """Feature sums (..., k) in coordinates (..., r); only differences of one tool's mean anything."""
        return sums @ self.lift

    def weights(self, u: Array) -> Array:
        """Weights (k,) to show and keep: shared evenly among columns that say the same, with the declared signs.

        Of a done / not-done pair the side that the coordinate's sign asks for has the weight, the other one 0; columns
        that no tool can tell anything about have 0.
        """
        return self.weights_of(np.asarray(u)[None])[0]

    def weights_of(self, samples: Array) -> Array:
        """The same for many, (s, r) -> (s, k)."""
        w = np.zeros((len(samples), len(self.scale)))
        for q, c in enumerate(self.coordinates):
            raw = samples[:, q] * (c.sign or 1)
            for up in (True, False):
                wanted = [(j, f) for j, f in zip(c.columns, c.factors, strict=True) if (f > 0) == up]
                here = np.where(raw > 0, raw, 0.0) if up else np.where(raw < 0, raw, 0.0)
                for j, f in wanted or [(c.columns[0], c.factors[0])]:
                    w[:, j] += here / (max(len(wanted), 1) * f * self.scale[j])
        return w + 0.0  # no -0

    def coordinates_of(self, w: Array) -> Array:
        """Coordinates (r,) of weights (k,) on the features as they are."""
        u = np.zeros(self.size)
        for q, c in enumerate(self.coordinates):
            u[q] = (c.sign or 1) * sum(w[j] * self.scale[j] * f for j, f in zip(c.columns, c.factors, strict=True))
        return u


def _sign(columns: list[int], factors: list[float], declared: list[Sign]) -> Sign:
    """A group can pull both ways when its columns oppose each other or one of them may have either sign."""
    ways = {int(np.sign(f)) * declared[j] for j, f in zip(columns, factors, strict=True)}
    return ways.pop() if len(ways) == 1 else 0
