"""Where regions meet: shared lengths, free borders, corners, and which neighbour lies opposite a free side."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.spatial import ConvexHull, QhullError

from app.geometry.cleaning import edge_table, joined
from app.geometry.compiled import kernel
from app.geometry.tool import Array, Mesh

Integers = NDArray[np.int64]
MANY = 1000  # points from which it pays to drop those inside before their hull is found
FREE = -1  # beyond a free border
FACING, ASIDE = np.cos(np.radians(30)), np.cos(np.radians(60))  # two edges lie opposite within 30 degrees, not at all beyond 60


@dataclass(frozen=True)
class Borders:
    """Border edges of all regions; an edge between two regions is listed once from each side."""

    region: Integers  # (B,) whose border it is
    beyond: Integers  # (B,) region on the other side, FREE without one
    ends: Integers  # (B, 2) vertices, as the region's own triangle lists them: the region lies to the left
    length: Array  # (B,) metres
    face: Integers  # (B,) the region's own triangle
    beyond_face: Integers  # (B,) the triangle on the other side, FREE without one

    def shared(self, n: int) -> Array:
        """Length of the border between regions (n, n), metres."""
        inner = self.beyond != FREE
        matrix = np.zeros((n, n))
        np.add.at(matrix, (self.region[inner], self.beyond[inner]), self.length[inner])
        return matrix

    def perimeter(self, n: int) -> Array:
        """Whole border of each region, free parts included (n,), metres."""
        return np.bincount(self.region, weights=self.length, minlength=n).astype(float, copy=False)


def find_borders(mesh: Mesh, labels: NDArray[np.int32]) -> Borders:
    """Edges where the region changes, the working surface ends, or the mesh isn't a surface (1 or more than 2 faces)."""
    _, side_edge, count = edge_table(mesh.faces)
    sides, beyond_face = _border_sides(side_edge, count, labels.astype(np.int64))
    face, side = np.divmod(sides, 3)
    ends = np.stack([mesh.faces[face, side], mesh.faces[face, (side + 1) % 3]], axis=1).astype(np.int64)
    length = np.linalg.norm(mesh.vertices[ends[:, 0]] - mesh.vertices[ends[:, 1]], axis=1)
    beyond = np.where(beyond_face == FREE, FREE, labels[beyond_face]).astype(np.int64)
    return Borders(labels[face].astype(np.int64), beyond, ends, length, face, beyond_face)


@kernel
def _border_sides(side_edge, count, labels):  # pragma: no cover - compiled
    """Sides (3 face + k) that are a border, in their order, and the face beyond each: FREE where there isn't exactly one other.

    An edge with more than two faces is no border where all of them belong to one region.
    """
    first, last = np.full(len(count), FREE), np.full(len(count), FREE)
    alike = np.ones(len(count), np.bool_)
    for f in range(len(side_edge)):
        for edge in side_edge[f]:
            if first[edge] < 0:
                first[edge] = f
            alike[edge] &= labels[f] == labels[first[edge]]
            last[edge] = f
    sides, beyond, found = np.empty(side_edge.size, np.int64), np.empty(side_edge.size, np.int64), 0
    for f in range(len(side_edge)):
        for k in range(3):
            edge = side_edge[f, k]
            if labels[f] >= 0 and not (alike[edge] and count[edge] > 1):
                sides[found] = 3 * f + k
                beyond[found] = first[edge] + last[edge] - f if count[edge] == 2 else FREE
                found += 1
    return sides[:found], beyond[:found]


def corner_neighbours(mesh: Mesh, labels: NDArray[np.int32], shared: Array) -> NDArray[np.bool_]:
    """Pairs of regions (n, n) that have a vertex but no border in common."""
    n = len(shared)
    inside = labels >= 0
    vertex, region = mesh.faces[inside].ravel(), np.repeat(labels[inside], 3)
    incidence = coo_matrix((np.ones(len(vertex)), (region, vertex)), shape=(n, len(mesh.vertices))).tocsr()
    touching = (incidence @ incidence.T).toarray() > 0
    np.fill_diagonal(touching, False)
    return touching & ~(shared > 0)


def opposite_lengths(mesh: Mesh, borders: Borders, normals: Array) -> Array:
    """Length of b on the side opposite to a free side of a (n, n), metres.

    Seen along the region's mean normal, two border edges lie opposite when they look in opposite directions: fully within
    FACING, not at all beyond ASIDE, partly in between. An edge counts with the free share of all the border opposite to it, so a
    rectangle's side counts whole, half when the side across is half free, and any polygon or arc has an answer that changes
    smoothly with its shape.

    Paper: the boundary-edge features (3, 4) count, per free side of a region, the neighbours across from it.
    """
    n = len(normals)
    result = np.zeros((n, n))
    for a in range(n):
        mine = borders.region == a
        ends, beyond, length = borders.ends[mine], borders.beyond[mine], borders.length[mine]
        if not (beyond == FREE).any() or (beyond == FREE).all():
            continue
        outer = _outer_loop(ends, length)
        ends, beyond, length = ends[outer], beyond[outer], length[outer]
        flat = mesh.vertices[ends] @ tangent_frame(normals[a]).T  # (B, 2, 2)
        way = flat[:, 1] - flat[:, 0]
        way /= np.maximum(np.linalg.norm(way, axis=1), 1e-300)[:, None]
        _add_opposite(way, beyond, length, 1e-9 * length.sum(), result[a])
    return result


@kernel
def _add_opposite(way, beyond, length, least, result):  # pragma: no cover - compiled
    """Add the length of every edge with a neighbour beyond it, times the free share of the edges opposite to it."""
    for i in range(len(way)):
        if beyond[i] == FREE:
            continue
        across, free = 0.0, 0.0
        for k in range(len(way)):
            facing = -way[i, 0] * way[k, 0] - way[i, 1] * way[k, 1]
            if facing > ASIDE:
                weight = min((facing - ASIDE) / (FACING - ASIDE), 1.0) * length[k]
                across += weight
                if beyond[k] == FREE:
                    free += weight
        if across > least:
            result[beyond[i]] += length[i] * free / across


def tangent_frame(normal: Array) -> Array:
    """Two unit vectors (2, 3) across `normal`; the first is horizontal, along x for a level region."""
    right = np.array([1.0, 0.0, 0.0]) if abs(normal[2]) > 0.999 else np.cross([0.0, 0.0, 1.0], normal)
    right = right - (right @ normal) * normal
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(normal, right)])


def _outer_loop(ends: Integers, length: Array) -> NDArray[np.bool_]:
    """Edges of the longest connected loop; the others bound holes."""
    loop = joined(ends, int(ends.max()) + 1)[ends[:, 0]]
    return loop == np.argmax(np.bincount(loop, weights=length))


def _outside(points: Array) -> Array:
    """Points that may lie on the convex hull: not inside the polygon of those that are farthest out in some directions."""
    at = np.linspace(0, 2 * np.pi, 16, endpoint=False)
    x, y = np.ascontiguousarray(points[:, 0]), np.ascontiguousarray(points[:, 1])
    farthest = [int(np.argmax(c * x + s * y)) for c, s in zip(np.cos(at), np.sin(at), strict=True)]
    inside = np.ones(len(points), bool)
    for i, k in zip(farthest, farthest[1:] + farthest[:1], strict=True):
        way = points[k] - points[i]
        if way.any():
            inside &= way[0] * (y - y[i]) - way[1] * (x - x[i]) > 1e-9 * (way @ way)
    return points[~inside]


def smallest_rectangle(points: Array) -> Array:
    """Axes (2, 2) of the rectangle with the smallest area around the points; one side lies on the hull."""
    points = _outside(points) if len(points) > MANY else points
    try:
        hull = points[ConvexHull(points).vertices]
    except QhullError:  # all points on one line
        along = points[np.argmax(np.linalg.norm(points - points[0], axis=1))] - points[0]
        size = np.linalg.norm(along)
        u = along / size if size > 0 else np.array([1.0, 0.0])
        return np.stack([u, [-u[1], u[0]]])
    edge = np.roll(hull, -1, axis=0) - hull
    u = edge / np.linalg.norm(edge, axis=1)[:, None]
    along, across = hull @ u.T, hull @ np.stack([-u[:, 1], u[:, 0]])
    best = u[np.argmin(np.ptp(along, axis=0) * np.ptp(across, axis=0))]
    return np.stack([best, [-best[1], best[0]]])
