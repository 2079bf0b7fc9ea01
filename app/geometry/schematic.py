"""A drawn stand-in for a tool that is known only from a region table: patches on a rectangle, lifted to their heights."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from app.geometry.moulds import solid
from app.geometry.tool import Array, Mesh, Region, RegionGraph, Tool

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


def drawn(graph: RegionGraph, names: Sequence[str], low: Array, high: Array, bends: tuple[float, float]) -> Tool:
    """The tool with patches in place of its mesh.

    Args:
        graph: What the table says.
        names: Name of each region.
        low: Lower corners in plan view, shape (N, 2), any unit; x to the right, y towards the viewer.
        high: Upper corners, shape (N, 2).
        bends: Curvatures below the first are called inwards, above the second outwards.
    """
    mesh, labels = patches(low, high, graph.height)
    place = ((low + high) / 2 - low.min(axis=0)) / (high.max(axis=0) - low.min(axis=0))
    words = [_describe(float(k), p, bends) for k, p in zip(graph.curvature, place, strict=True)]
    regions = tuple(_region(names[a], words[a], mesh, labels == a, graph.curvature[a]) for a in range(graph.n))
    return Tool(mesh, labels, regions, graph)


def _describe(curvature: float, place: Array, bends: tuple[float, float]) -> str:
    """'Back left, curved inwards'."""
    along = ("Back", "Middle", "Front")[min(2, int(place[1] * 3))]
    across = ("left", "", "right")[min(2, int(place[0] * 3))]
    bend = "curved inwards" if curvature < bends[0] else "curved outwards" if curvature > bends[1] else "flat"
    return f"{along} {across}".strip() + f", {bend}"


def _region(name: str, description: str, mesh: Mesh, mine: NDArray[np.bool_], curvature: float) -> Region:
    """Centre, normal and area as drawn; a region hidden under others gets the middle of the tool and no area."""
    corners = mesh.vertices[mesh.faces[mine]]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2
    size = np.linalg.norm(across, axis=1)
    area = float(size.sum())
    if area == 0:
        return Region(name, description, mesh.vertices.mean(axis=0), np.array([0.0, 0.0, 1.0]), 0.0, float(curvature), "listed")
    normal = across.sum(axis=0) / np.linalg.norm(across.sum(axis=0))
    return Region(name, description, (corners.mean(axis=1) * size[:, None]).sum(axis=0) / area, normal, area, float(curvature), "listed")
