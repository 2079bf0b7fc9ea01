"""Put new vertices on the edges and into the faces of a mesh; neighbours are split with them, so a closed mesh stays closed."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

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
    following = np.roll(faces, -1, axis=1)
    keys = np.minimum(faces, following) * total + np.maximum(faces, following)  # (F, 3) edges ab, bc, ca
    at = np.minimum(np.searchsorted(wanted, keys, sorter=order), max(len(wanted) - 1, 0))
    middle = np.where(wanted[order][at] == keys, total + order[at], -1) if len(wanted) else np.full_like(faces, -1)
    result, source = _subdivide(faces, middle, vertices)
    return Sliced(Mesh(vertices, result.astype(np.int32)), source, total + np.arange(len(ends)))


def _subdivide(faces: Integers, middle: Integers, vertices: Array) -> tuple[Integers, Integers]:
    """Faces after new vertices `middle` (F, 3; -1 none) on their edges, and the old face of each. Whole faces stay in front."""
    count = (middle >= 0).sum(axis=1)
    whole, one, two, three = (np.flatnonzero(count == n) for n in range(4))
    a, b, c, m, _ = _turned(faces, middle, one, np.argmax(middle[one] >= 0, axis=1))
    pieces = [faces[whole], np.stack([a, m, c], axis=1), np.stack([m, b, c], axis=1)]
    a, b, c, m, n = _turned(faces, middle, two, (np.argmin(middle[two] >= 0, axis=1) + 2) % 3)
    across = np.linalg.norm(vertices[m] - vertices[c], axis=1) < np.linalg.norm(vertices[b] - vertices[n], axis=1)
    pieces += [np.stack([a, m, n], axis=1), np.stack([m, b, np.where(across, c, n)], axis=1)]
    pieces.append(np.stack([np.where(across, m, b), c, n], axis=1))
    (a, b, c), (m, n, o) = faces[three].T, middle[three].T
    pieces += [np.stack(corners, axis=1) for corners in ((a, m, o), (m, b, n), (n, c, o), (m, n, o))]
    return np.concatenate(pieces), np.concatenate([whole, one, one, two, two, two, three, three, three, three])


def _turned(faces: Integers, middle: Integers, chosen: Integers, first: Integers) -> tuple[Integers, ...]:
    """Corners a, b, c of the chosen faces from corner `first` on, and the new vertices on ab and ca."""
    turn = (first[:, None] + np.arange(3)) % 3
    corners = np.take_along_axis(faces[chosen], turn, axis=1)
    new = np.take_along_axis(middle[chosen], turn, axis=1)
    return corners[:, 0], corners[:, 1], corners[:, 2], new[:, 0], new[:, 2]


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
