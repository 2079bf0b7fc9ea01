"""Lines on the part: the borders of its regions, lifted off the surface so that the lines are not swallowed by it."""

import numpy as np
from numpy.typing import NDArray

from app.geometry.tool import Array, Mesh, Tool


def rim(faces: NDArray[np.int32]) -> NDArray[np.int32]:
    """Edges (E, 2) that belong to exactly one of the faces."""
    edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    unique, count = np.unique(edges, axis=0, return_counts=True)
    return unique[count == 1]


def vertex_normals(mesh: Mesh, faces: NDArray[np.int32]) -> Array:
    """Unit normals (V, 3) averaged by area over `faces`; zero at vertices none of them touches."""
    a, b, c = (mesh.vertices[faces[:, k]] for k in range(3))
    doubled = np.cross(b - a, c - a)
    normals = np.zeros_like(mesh.vertices)
    for k in range(3):
        np.add.at(normals, faces[:, k], doubled)
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return normals / np.where(length > 0, length, 1)


def region_rims(tool: Tool, lift: float) -> tuple[Array, ...]:
    """Per region the segments (E, 2, 3) of its border, `lift` metres above the surface."""
    normals = vertex_normals(tool.mesh, tool.mesh.faces[tool.labels >= 0])
    lifted = tool.mesh.vertices + lift * normals
    return tuple(lifted[rim(tool.mesh.faces[tool.labels == region])] for region in range(tool.n))


def all_borders(tool: Tool, lift: float) -> Array:
    """Every border segment once (E, 2, 3), `lift` metres above the surface."""
    normals = vertex_normals(tool.mesh, tool.mesh.faces[tool.labels >= 0])
    lifted = tool.mesh.vertices + lift * normals
    rims = [rim(tool.mesh.faces[tool.labels == region]) for region in range(tool.n)]
    return lifted[np.unique(np.concatenate(rims), axis=0)] if rims else np.empty((0, 2, 3))


def size(tool: Tool) -> float:
    """Diagonal of the part's bounding box, metres."""
    return float(np.linalg.norm(np.ptp(tool.mesh.vertices, axis=0)))


def part_of(mesh: Mesh, faces: NDArray[np.int32]) -> tuple[NDArray[np.float32], NDArray[np.uint32]]:
    """Vertices and faces of a part of the mesh on its own, as the browser wants them."""
    used, index = np.unique(faces, return_inverse=True)
    return mesh.vertices[used].astype(np.float32), index.reshape(-1, 3).astype(np.uint32)
