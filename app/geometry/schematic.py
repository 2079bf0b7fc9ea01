"""A drawn stand-in for a tool that is known only from a region table: patches on a rectangle, lifted to their heights."""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from app.geometry.moulds import solid
from app.geometry.tool import Array, Mesh

SIZE = 0.5  # m, longest side in plan view
RELIEF = 0.035  # m between the lowest and the highest patch
CELL = SIZE / 60  # m, longest edge of a mesh cell
PASSES = 6  # of smoothing, so that steps between patches become slopes


def patches(low: Array, high: Array, height: Array) -> tuple[Mesh, NDArray[np.int32]]:
    """A closed solid whose top is cut into the given rectangles.

    Args:
        low: Lower corners in plan view, shape (N, 2), any unit; x to the right, y towards the viewer.
        high: Upper corners, shape (N, 2).
        height: Height of each patch, shape (N,), any unit.

    Returns:
        The mesh and the patch of each face, -1 on the sides, the bottom and where no rectangle lies. Of overlapping
        rectangles the smallest is seen.
    """
    scale = SIZE / float((high.max(axis=0) - low.min(axis=0)).max())
    flip = np.array([scale, -scale])
    lower, upper = np.minimum(low * flip, high * flip), np.maximum(low * flip, high * flip)
    x, y = (_lines(np.concatenate([lower[:, k], upper[:, k]])) for k in (0, 1))
    cells = _cells(x, y, lower, upper)
    span = float(np.ptp(height))
    lift = (height - height.min()) * (RELIEF / span if span else 0.0)
    grid = np.stack([*np.meshgrid(x - x.mean(), y - y.mean(), indexing="ij"), _surface(cells, lift)], axis=-1)
    return solid(grid, cells)


def rows_of_patches(index: Array, area: Array) -> tuple[Array, Array]:
    """Rectangles of the listed areas for regions known by (row, column): rows from the back, columns from the left."""
    low, high, top = np.zeros((len(area), 2)), np.zeros((len(area), 2)), 0.0
    for row in np.unique(index[:, 0]):
        members = np.flatnonzero(index[:, 0] == row)
        members = members[np.argsort(index[members, 1], kind="stable")]
        depth = area[members].sum() / area.sum()
        right = np.cumsum(area[members]) / area[members].sum()
        high[members] = np.stack([right, np.full(len(right), top + depth)], axis=1)
        low[members] = np.stack([np.concatenate([[0.0], right[:-1]]), np.full(len(right), top)], axis=1)
        top += depth
    return low, high


def _lines(marks: Array) -> Array:
    """Grid lines through all marks, with further ones between where they are far apart."""
    marks = np.unique(marks.round(9))
    parts = [np.linspace(a, b, max(1, int(np.ceil((b - a) / CELL))) + 1)[:-1] for a, b in pairwise(marks)]
    return np.concatenate([*parts, marks[-1:]])


def _cells(x: Array, y: Array, lower: Array, upper: Array) -> NDArray[np.int32]:
    """Patch of each grid cell, (U - 1, V - 1), -1 where there is none."""
    cells = np.full((len(x) - 1, len(y) - 1), -1, np.int32)
    u, v = (x[:-1] + x[1:]) / 2, (y[:-1] + y[1:]) / 2
    for a in np.argsort(-np.prod(upper - lower, axis=1), kind="stable"):
        inside = ((lower[a, 0] < u) & (u < upper[a, 0]))[:, None] & ((lower[a, 1] < v) & (v < upper[a, 1]))[None, :]
        cells[inside] = a
    return cells


def _surface(cells: NDArray[np.int32], lift: Array) -> Array:
    """Height of each grid point: the mean of the cells around it, smoothed."""
    z = np.where(cells >= 0, lift[cells], lift.mean())
    z = _mean_of_neighbours(np.pad(z, 1, mode="edge"))
    for _ in range(PASSES):
        z = _mean_of_neighbours(_mean_of_neighbours(np.pad(z, 1, mode="edge")))
    return z


def _mean_of_neighbours(z: Array) -> Array:
    """Mean of each 2 x 2 block, one smaller in both directions."""
    return (z[:-1, :-1] + z[1:, :-1] + z[:-1, 1:] + z[1:, 1:]) / 4
