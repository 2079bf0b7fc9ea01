"""Put new vertices on the edges and into the faces of a mesh; neighbours are split with them, so a closed mesh stays closed."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.geometry.compiled import kernel
from app.geometry.tool import Array, Mesh

Integers = NDArray[np.int64]
CORNER = 1e-3  # barycentric weight below which a point of a face lies on its edge (two of them: on its corner)


@dataclass(frozen=True)
class Sliced:
    """A mesh with new vertices."""

    mesh: Mesh
    source: Integers  # (F',) face of the mesh before that each face is a part of
    vertices: Integers  # (K,) the vertex at each place that was asked for


def split_edges(mesh: Mesh, ends: Integers, along: Array) -> Sliced:
    """Put vertices on edges.

    Args:
        mesh: The mesh.
        ends: (K, 2) end vertices of each edge, no edge twice.
        along: (K,) position from the first end (0) to the second (1), exclusive.
    """
    total = len(mesh.vertices)
    first, second = mesh.vertices[ends[:, 0]], mesh.vertices[ends[:, 1]]
    vertices = np.concatenate([mesh.vertices, first + along[:, None] * (second - first)])
    low, high = ends.min(axis=1), ends.max(axis=1)
    wanted = low * total + high
    order = np.argsort(wanted)
    faces = mesh.faces.astype(np.int64)
    middle = at_new_vertices(faces, low[order], high[order], total)
    new = middle >= 0
    middle[new] = total + order[middle[new] - total]
    result, source = subdivide(faces, middle, vertices)
    return Sliced(Mesh(vertices, result.astype(np.int32)), source, total + np.arange(len(ends)))


def at_new_vertices(faces: Integers, low: Integers, high: Integers, total: int) -> Integers:
    """New vertex on each side of each face (F, 3), -1 without; new vertex k lies on the edge from low[k] to high[k]."""
    mark = np.zeros(total, bool)
    mark[low] = mark[high] = True
    return _at_sides(faces, low * total + high, mark)


@kernel
def _at_sides(faces, crossed, mark):  # pragma: no cover - compiled
    middle, total = np.full(faces.shape, -1, np.int64), len(mark)
    for f in range(len(faces)):
        for k in range(3):
            a, b = faces[f, k], faces[f, (k + 1) % 3]
            if mark[a] and mark[b]:
                key = min(a, b) * total + max(a, b)
                at = np.searchsorted(crossed, key)
                if at < len(crossed) and crossed[at] == key:
                    middle[f, k] = total + at
    return middle


@kernel
def subdivide(faces, middle, vertices):  # pragma: no cover - compiled
    """Triangles (F', 3) after new vertices `middle` (F, 3; -1 none) on their edges, and the old face of each (F',).

    Whole ones come first, then all first pieces of those with one new vertex, their second pieces, and so on.
    """
    count = np.zeros(4, np.int64)
    for f in range(len(faces)):
        count[(middle[f, 0] >= 0) + (middle[f, 1] >= 0) + (middle[f, 2] >= 0)] += 1
    at = np.array([0, count[0], count[0] + 2 * count[1], count[0] + 2 * count[1] + 3 * count[2]])
    total = at[3] + 4 * count[3]
    result, source = np.empty((total, 3), np.int64), np.empty(total, np.int64)
    for f in range(len(faces)):
        new = (middle[f, 0] >= 0) + (middle[f, 1] >= 0) + (middle[f, 2] >= 0)
        here = at[new]
        at[new] += 1
        if new == 0:
            result[here], source[here] = faces[f], f
            continue
        first = 0  # corner from which on it is looked at: the new vertices lie on ab, on ab and ca, or on all sides
        while new < 3 and ((middle[f, first] < 0) if new == 1 else (middle[f, (first + 1) % 3] >= 0)):
            first += 1
        a, b, c = faces[f, first], faces[f, (first + 1) % 3], faces[f, (first + 2) % 3]
        m, n = middle[f, first], middle[f, (first + 2) % 3]
        if new == 1:
            _put(result, here, a, m, c)
            _put(result, here + count[1], m, b, c)
        elif new == 2:
            across = np.linalg.norm(vertices[m] - vertices[c]) < np.linalg.norm(vertices[b] - vertices[n])
            _put(result, here, a, m, n)
            _put(result, here + count[2], m, b, c if across else n)
            _put(result, here + 2 * count[2], m if across else b, c, n)
        else:
            middle_bc = middle[f, 1]
            _put(result, here, a, m, n)
            _put(result, here + count[3], m, b, middle_bc)
            _put(result, here + 2 * count[3], middle_bc, c, n)
            _put(result, here + 3 * count[3], m, middle_bc, n)
        for piece in range(new + 1):
            source[here + piece * count[new]] = f
    return result, source


@kernel
def _put(rows, at, a, b, c):  # pragma: no cover - compiled
    rows[at, 0], rows[at, 1], rows[at, 2] = a, b, c


def insert_point(mesh: Mesh, face: int, point: Array) -> Sliced:
    """Make a point of a face a vertex; close to an edge or a corner it is put there."""
    corners = mesh.faces[face].astype(np.int64)
    weights = np.clip(barycentric(mesh.vertices[corners], point), 0, 1)
    weights /= weights.sum()
    small = np.flatnonzero(weights < CORNER)
    if len(small) == 2:
        at = int(corners[np.argmax(weights)])
        return Sliced(mesh, np.arange(len(mesh.faces)), np.array([at]))
    if len(small) == 1:
        i, j = (small[0] + 1) % 3, (small[0] + 2) % 3
        return split_edges(mesh, np.array([[corners[i], corners[j]]]), np.array([weights[j] / (weights[i] + weights[j])]))
    new = len(mesh.vertices)
    vertices = np.concatenate([mesh.vertices, [weights @ mesh.vertices[corners]]])
    a, b, c = corners
    faces = np.concatenate([mesh.faces, [[b, c, new], [c, a, new]]]).astype(np.int32)
    faces[face] = (a, b, new)
    source = np.concatenate([np.arange(len(mesh.faces)), [face, face]])
    return Sliced(Mesh(vertices, faces), source, np.array([new]))


def barycentric(corners: Array, point: Array) -> Array:
    """Weights (3,) of the corners (3, 3) for the foot of `point` in their plane."""
    sides = np.stack([corners[1] - corners[0], corners[2] - corners[0]], axis=1)
    (u, v), *_ = np.linalg.lstsq(sides, point - corners[0], rcond=None)
    return np.array([1 - u - v, u, v])


def nearest_face(mesh: Mesh, point: Array, among: Integers | None = None) -> tuple[int, float]:
    """The face closest to a point and its distance, of all or of those listed."""
    chosen = np.arange(len(mesh.faces)) if among is None else among
    foot = closest_points(mesh.vertices[mesh.faces[chosen]], np.broadcast_to(point, (len(chosen), 3)))
    distance = np.linalg.norm(foot - point, axis=1)
    best = int(np.argmin(distance))
    return int(chosen[best]), float(distance[best])


def closest_points(triangles: Array, points: Array) -> Array:
    """The point of each triangle (K, 3, 3) that is nearest to its point (K, 3)."""
    a = triangles[:, 0]
    sides = triangles[:, [1, 2, 0]] - triangles  # (K, 3, 3)
    normal = np.cross(sides[:, 0], -sides[:, 2])
    twice = np.einsum("ki,ki->k", normal, normal)
    height = np.einsum("ki,ki->k", points - a, normal) / np.maximum(twice, 1e-300)
    foot = points - height[:, None] * normal
    outward = np.cross(sides, normal[:, None, :])
    inside = (np.einsum("kji,kji->kj", foot[:, None, :] - triangles, outward) <= 0).all(axis=1)
    along = np.einsum("kji,kji->kj", points[:, None, :] - triangles, sides) / np.maximum(np.einsum("kji,kji->kj", sides, sides), 1e-300)
    on_side = triangles + np.clip(along, 0, 1)[..., None] * sides
    best = np.argmin(np.linalg.norm(on_side - points[:, None, :], axis=2), axis=1)
    return np.where(inside[:, None], foot, on_side[np.arange(len(points)), best])
