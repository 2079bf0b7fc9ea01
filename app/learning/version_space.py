"""All weights that agree with what is known: are there any, what is forced, and samples of them.

In coordinates u (see `identifiable`) everything known is a cone: rows . u >= 0, and u >= 0 where signed. Demonstrations on
symmetric tools force equalities (two opposite rows); a margin over all rows is then 0 and a walk that only knows
inequalities never moves, so these are found first and the rest happens inside them.
"""

from dataclasses import dataclass

import numba as nb
import numpy as np
from numpy.typing import NDArray
from scipy.linalg import null_space
from scipy.optimize import linprog

from app.learning.qp import Array

BOX = 1e4  # largest coordinate while looking for the interior; the cone has no scale of its own
FORCED = 1e-6  # a row that can't leave 0 by this much anywhere in the box is an equality
BURN_IN = 150  # steps before the first sample, most of which shape the directions
FLAT = 1e-13  # a direction this flat against a row doesn't move along it
INNER = 1e-9  # a point this far inside every row has room around it


@dataclass(frozen=True)
class Cone:
    """{u : rows u >= 0, u >= 0 where signed} with its forced equalities and a point inside."""

    rows: Array  # (m, r) of length 1
    signed: Array  # (r,) 1 or 0
    equal: NDArray[np.bool_]  # (m,) rows that are 0 everywhere in the cone
    pinned: NDArray[np.bool_]  # (r,) signed coordinates that are 0 everywhere in the cone
    basis: Array  # (r, q) of the subspace the cone has an interior in
    inside: Array  # (r,) of length 1; zeros when no weights but 0 agree

    @property
    def empty(self) -> bool:
        """No weights but 0 agree."""
        return not self.inside.any()

    @property
    def walls(self) -> Array:
        """(m', q) what bounds the cone within its subspace, sign bounds last."""
        live = (self.signed > 0) & ~self.pinned
        return np.vstack([self.rows[~self.equal] @ self.basis, np.eye(len(self.signed))[live] @ self.basis])

    def with_rows(self, fresh: Array, known: Array) -> "Cone":
        """The cone after more is known.

        Args:
            fresh: Rows (f, r) of length 1.
            known: Points of this cone (s, r); if some have room inside the fresh rows, no linear program is needed.
        """
        rows = np.vstack([self.rows, fresh])
        signed = np.eye(len(self.signed))[(self.signed > 0) & ~self.pinned]
        old = np.vstack([self.rows[~self.equal], fresh, signed])
        left = known[(known @ old.T > INNER).all(axis=1)] if len(known) else known
        if len(left):
            equal = np.r_[self.equal, np.zeros(len(fresh), np.bool_)]
            return Cone(rows, self.signed, equal, self.pinned, self.basis, _unit(left.mean(axis=0)))
        return cone_of(rows, self.signed)


def cone_of(rows: Array, signed: Array) -> Cone:
    """Forced equalities and a point inside, by one linear program: how far can each row be from 0, capped at 1?"""
    m, r = rows.shape
    bounded = np.flatnonzero(signed)
    walls = np.vstack([rows, np.eye(r)[bounded]])
    count = len(walls)
    result = linprog(
        np.r_[np.zeros(r), -np.ones(count)],
        A_ub=np.hstack([-walls, np.eye(count)]),
        b_ub=np.zeros(count),
        bounds=[(-BOX, BOX)] * r + [(0, 1)] * count,
        method="highs",
    )
    reached, u = (result.x[r:], result.x[:r]) if result.status == 0 else (np.zeros(count), np.zeros(r))
    equal, pinned = reached[:m] < FORCED, np.zeros(r, np.bool_)
    pinned[bounded[reached[m:] < FORCED]] = True
    held = np.vstack([rows[equal], np.eye(r)[pinned]])
    basis = _tidy(null_space(held, rcond=1e-9)) if len(held) else np.eye(r)
    inside = basis @ (basis.T @ u) if basis.shape[1] and (reached >= FORCED).any() else np.zeros(r)
    return Cone(rows, signed, equal, pinned, basis, _unit(inside))


def _tidy(basis: Array) -> Array:
    """The same subspace with exact zeros where rounding left dust, so that a forced 0 is 0."""
    return np.where(np.abs(basis) < 1e-12, 0.0, basis)


def _unit(u: Array) -> Array:
    size = float(np.linalg.norm(u))
    return u / size if size > 0 else np.zeros_like(u)


def sample(cone: Cone, count: int, generator: np.random.Generator, thin: int = 0) -> Array:
    """Weights drawn evenly over the directions in the cone, (count, r) of length 1; none when it is empty.

    Hit and run in the part of the unit ball inside the cone, in the subspace of the forced equalities. Directions follow
    the shape of the cone as the first steps found it, so that thin cones are crossed too.

    Args:
        cone: What the weights have to agree with.
        count: Samples.
        generator: The only source of randomness.
        thin: Steps between two samples, by default four per dimension.
    """
    q = cone.basis.shape[1]
    if cone.empty or q == 0:
        return np.zeros((0, len(cone.signed)))
    rows, thin = cone.walls, thin or 4 * q
    trail = _walk(rows, cone.basis.T @ cone.inside * 0.5, _directions(np.eye(q), BURN_IN, generator), generator.random(BURN_IN))
    spread = np.asarray(np.cov(trail[BURN_IN // 3 :].T), np.float64).reshape(q, q)
    shape = np.asarray(np.linalg.cholesky(spread + 1e-12 * np.eye(q)), np.float64)
    steps = count * thin
    trail = _walk(rows, trail[-1], _directions(shape, steps, generator), generator.random(steps))
    points = trail[thin - 1 :: thin] @ cone.basis.T
    return points / np.linalg.norm(points, axis=1, keepdims=True)


def _directions(shape: Array, steps: int, generator: np.random.Generator) -> Array:
    drawn = generator.normal(size=(steps, len(shape))) @ shape.T
    return drawn / np.linalg.norm(drawn, axis=1, keepdims=True)


@nb.njit(cache=True)
def _walk(rows: Array, at: Array, directions: Array, chances: Array) -> Array:
    """Points of a hit-and-run walk in {y : rows y >= 0, |y| <= 1} that starts inside, (steps, q)."""
    m, q = rows.shape
    out = np.empty(directions.shape)
    y = at.copy()
    for step in range(len(directions)):
        d = directions[step]
        along, size = 0.0, 0.0
        for k in range(q):
            along += y[k] * d[k]
            size += y[k] * y[k]
        root = np.sqrt(max(along * along + 1.0 - size, 0.0))
        low, high = -along - root, -along + root
        for i in range(m):
            slope, gap = 0.0, 0.0
            for k in range(q):
                slope += rows[i, k] * d[k]
                gap += rows[i, k] * y[k]
            if slope > FLAT:
                low = max(low, -gap / slope)
            elif slope < -FLAT:
                high = min(high, -gap / slope)
        if high > low:
            move = low + (high - low) * chances[step]
            for k in range(q):
                y[k] += move * d[k]
        out[step] = y
    return out


def warm_up() -> None:
    """Compile or load the kernel."""
    _walk(np.ones((1, 2)), np.array([0.1, 0.1]), np.array([[1.0, 0.0]]), np.array([0.5]))
