"""Small tools whose surface is known in closed form."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from app.geometry.moulds import solid
from app.geometry.tool import Array, Mesh, Region, RegionGraph, Tool, region_letters

Height = Callable[[Array, Array], Array]


def flat(x: Array, y: Array) -> Array:
    return 0 * x * y


def wavy(x: Array, y: Array) -> Array:
    """Crown, twist and wave within 4 cm; at its most curved 2.6 / m."""
    return 0.04 * np.cos(7 * x) * np.cos(5 * y) + 0.06 * x * y


def graph_of(n: int) -> RegionGraph:
    """Placeholder features: the robot reads none of them."""
    square, row, pair = np.zeros((n, n)), np.zeros(n), np.zeros((n, 2))
    return RegionGraph("mesh", square, square, square, square > 0, square > 0, np.full(n, -1), row, row, row, pair, pair)


def tool_from(mesh: Mesh, labels: NDArray[np.int32]) -> Tool:
    """A tool with measured centroids, normals and areas."""
    n, regions = int(labels.max()) + 1, []
    for k in range(n):
        t = mesh.vertices[mesh.faces[labels == k]]
        cross = np.cross(t[:, 1] - t[:, 0], t[:, 2] - t[:, 0])
        area = np.linalg.norm(cross, axis=1).sum() / 2
        normal = cross.sum(axis=0)
        regions.append(Region(region_letters(n)[k], "", t.mean(axis=(0, 1)), normal / np.linalg.norm(normal), area, 0.0, "freeform"))
    return Tool(mesh, labels, tuple(regions), graph_of(n))


def block(height: Height = wavy, size: tuple[float, float] = (0.2, 0.2), columns: int = 2, rows: int = 1, cell: float = 0.005) -> Tool:
    """A solid whose top is z = height(x, y), cut into columns x rows regions."""
    counts = [max(k, round(s / cell / k) * k) for s, k in zip(size, (columns, rows), strict=True)]
    x, y = (np.linspace(-s / 2, s / 2, c + 1) for s, c in zip(size, counts, strict=True))
    gx, gy = np.meshgrid(x, y, indexing="ij")
    u = np.arange(counts[0]) * columns // counts[0]
    v = np.arange(counts[1]) * rows // counts[1]
    mesh, labels = solid(np.stack([gx, gy, height(gx, gy)], axis=-1), (u[:, None] * rows + v[None, :]).astype(np.int32))
    return tool_from(mesh, labels)


def with_hole(tool: Tool, radius: float) -> Tool:
    """The same tool with the faces around the middle taken out of their regions."""
    middle = tool.mesh.vertices[tool.mesh.faces].mean(axis=1)[:, :2]
    inside = (np.linalg.norm(middle, axis=1) < radius) & (tool.labels >= 0)
    return tool_from(tool.mesh, np.where(inside, -1, tool.labels).astype(np.int32))
