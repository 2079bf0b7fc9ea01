"""Lines on the part: the borders of its regions, lifted off the surface so that the lines are not swallowed by it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.geometry.borders import find_borders
from app.geometry.cleaning import edge_table
from app.geometry.tool import Array, Mesh, Tool


@dataclass(frozen=True)
class Lines:
    """Border segments, points above the surface in metres."""

    every: Array  # (E, 2, 3) each segment once
    rims: tuple[Array, ...]  # per region (E_r, 2, 3) the segments of its border


def rim(faces: NDArray[np.int32]) -> NDArray[np.int32]:
    """Edges (E, 2) that belong to exactly one of the faces."""
    edges, _, count = edge_table(faces)
    return edges[count == 1].astype(np.int32)


def vertex_normals(mesh: Mesh, faces: NDArray[np.int32]) -> Array:
    """Unit normals (V, 3) averaged by area over `faces`; zero at vertices none of them touches."""
    a, b, c = (mesh.vertices[faces[:, k]] for k in range(3))
    doubled = np.cross(b - a, c - a)
    corners = faces.T.ravel()
    summed = [np.bincount(corners, np.tile(doubled[:, k], 3), len(mesh.vertices)) for k in range(3)]
    normals = np.stack(summed, axis=1)
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return normals / np.where(length > 0, length, 1)


def find_lines(tool: Tool, lift: float) -> Lines:
    """The borders of all regions, `lift` metres above the surface."""
    borders = find_borders(tool.mesh, tool.labels)
    at_border = np.zeros(len(tool.mesh.vertices), bool)
    at_border[borders.ends] = True
    a, b, c = at_border[tool.mesh.faces].T
    lifted = tool.mesh.vertices + lift * vertex_normals(tool.mesh, tool.mesh.faces[(tool.labels >= 0) & (a | b | c)])
    low, high, total = borders.ends.min(axis=1), borders.ends.max(axis=1), len(lifted)
    every = np.stack(np.divmod(np.unique(low * total + high), total), axis=1)
    return Lines(lifted[every], tuple(lifted[borders.ends[borders.region == r]] for r in range(tool.n)))


def size(tool: Tool) -> float:
    """Diagonal of the part's bounding box, metres."""
    return float(np.linalg.norm(np.ptp(tool.mesh.vertices, axis=0)))


def part_of(mesh: Mesh, faces: NDArray[np.int32]) -> tuple[NDArray[np.float32], NDArray[np.uint32]]:
    """Vertices and faces of a part of the mesh on its own, as the browser wants them."""
    used = np.zeros(len(mesh.vertices), bool)
    used[faces] = True
    number = np.cumsum(used, dtype=np.uint32) - np.uint32(1)
    return mesh.vertices[used].astype(np.float32), number[faces]
