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
    faces, owner = np.ascontiguousarray(mesh.faces, np.int64), labels.astype(np.int64)
    mixed, ends_here = _meeting(faces, owner, len(mesh.vertices))
    meeting = mixed | ends_here
    near = _beside(faces, meeting)
    edges, side_edge, count = edge_table(faces[near])
    sides, beyond_face = _border_sides(side_edge, count, meeting[edges].all(axis=1), owner[near])
    face, side = near[sides // 3], sides % 3
    ends = np.stack([faces[face, side], faces[face, (side + 1) % 3]], axis=1)
    length = np.linalg.norm(mesh.vertices[ends[:, 0]] - mesh.vertices[ends[:, 1]], axis=1)
    free = beyond_face == FREE
    beyond_face = np.where(free, FREE, near[beyond_face])
    return Borders(owner[face], np.where(free, FREE, owner[beyond_face]), ends, length, face, beyond_face)


@kernel
def _meeting(faces, labels, n):  # pragma: no cover - compiled
    """Vertices (n,) at which labels differ, and those at which the surface ends: both ends of every border edge are among them.

    Around a vertex inside a surface every neighbour comes once before and once behind it. Where the surface ends some neighbour
    doesn't, and the sum over the faces of what stands for the one before less what stands for the one behind isn't 0.
    """
    name, turn = np.empty(n, np.int64), np.zeros(n, np.int64)
    for v in range(n):  # numbers that don't add up by chance
        x = (v + 1) * 0x1E3779B97F4A7C15
        x = (x ^ (x >> 30)) * 0x3F58476D1CE4E5B9
        name[v] = x ^ (x >> 27)
    first, mixed = np.full(n, -2), np.zeros(n, np.bool_)
    for f in range(len(faces)):
        for k in range(3):
            v = faces[f, k]
            if first[v] == -2:
                first[v] = labels[f]
            elif first[v] != labels[f]:
                mixed[v] = True
            turn[v] += name[faces[f, (k + 1) % 3]] - name[faces[f, (k + 2) % 3]]
    return mixed, turn != 0


@kernel
def _beside(faces, marked):  # pragma: no cover - compiled
    """Faces with two or more of the marked vertices."""
    found, count = np.empty(len(faces), np.int64), 0
    for f in range(len(faces)):
        if int(marked[faces[f, 0]]) + int(marked[faces[f, 1]]) + int(marked[faces[f, 2]]) > 1:
            found[count] = f
            count += 1
    return found[:count]


@kernel
def _border_sides(side_edge, count, listed, labels):  # pragma: no cover - compiled
    """Sides (3 face + k) that are a border, in their order, and the face beyond each: FREE where there isn't exactly one other.

    Only edges that are `listed` count, and one with more than two faces is no border where all of them belong to one region.
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
            if listed[edge] and labels[f] >= 0 and not (alike[edge] and count[edge] > 1):
                sides[found] = 3 * f + k
                beyond[found] = first[edge] + last[edge] - f if count[edge] == 2 else FREE
                found += 1
    return sides[:found], beyond[:found]


def corner_neighbours(mesh: Mesh, labels: NDArray[np.int32], shared: Array) -> NDArray[np.bool_]:
    """Pairs of regions (n, n) that have a vertex but no border in common."""
    n = len(shared)
    mixed, _ = _meeting(np.ascontiguousarray(mesh.faces, np.int64), labels.astype(np.int64), len(mesh.vertices))
    inside = (labels >= 0)[:, None] & mixed[mesh.faces]
    vertex, region = mesh.faces[inside], np.broadcast_to(labels[:, None], mesh.faces.shape)[inside]
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
    x, y, z = (float(v) for v in normal)
    right = np.array([1.0 - x * x, -x * y, -x * z] if abs(z) > 0.999 else [-y, x, 0.0])
    u, v, w = (float(c) for c in right / np.sqrt(right @ right))
    return np.array([[u, v, w], [y * w - z * v, z * u - x * w, x * v - y * u]])


def _outer_loop(ends: Integers, length: Array) -> NDArray[np.bool_]:
    """Edges of the longest connected loop; the others bound holes."""
    loop = joined(ends, int(ends.max()) + 1)[ends[:, 0]]
    return loop == np.argmax(np.bincount(loop, weights=length))


@kernel
def outer_points(points):  # pragma: no cover - compiled
    """Points that may lie on the convex hull: not inside the polygon of those that are farthest out in some directions."""
    ways = 16
    corner, reach = np.zeros(ways, np.int64), np.full(ways, -np.inf)
    c, s = np.cos(2 * np.pi * np.arange(ways) / ways), np.sin(2 * np.pi * np.arange(ways) / ways)
    for i in range(len(points)):
        for k in range(ways):
            far = c[k] * points[i, 0] + s[k] * points[i, 1]
            if far > reach[k]:
                corner[k], reach[k] = i, far
    outside = np.zeros(len(points), np.bool_)
    for k in range(ways):
        a, b = points[corner[k]], points[corner[(k + 1) % ways]]
        x, y = b[0] - a[0], b[1] - a[1]
        if x == 0 and y == 0:
            continue
        for i in range(len(points)):
            if x * (points[i, 1] - a[1]) - y * (points[i, 0] - a[0]) <= 1e-9 * (x * x + y * y):
                outside[i] = True
    return points[outside]


def smallest_rectangle(points: Array) -> tuple[Array, Array]:
    """Axes (2, 2) of the rectangle with the smallest area around the points, one side lies on the hull, and its sides (2,)."""
    points = outer_points(np.ascontiguousarray(points)) if len(points) > MANY else points
    try:
        hull = points[ConvexHull(points).vertices]
    except QhullError:  # all points on one line
        along = points[np.argmax(np.linalg.norm(points - points[0], axis=1))] - points[0]
        size = np.linalg.norm(along)
        u = along / size if size > 0 else np.array([1.0, 0.0])
        axes = np.stack([u, [-u[1], u[0]]])
        return axes, np.ptp(axes @ points.T, axis=1)
    edge = np.roll(hull, -1, axis=0) - hull
    u = edge / np.linalg.norm(edge, axis=1)[:, None]
    along, across = np.ptp(u @ hull.T, axis=1), np.ptp(np.stack([-u[:, 1], u[:, 0]], axis=1) @ hull.T, axis=1)
    best = int(np.argmin(along * across))
    return np.stack([u[best], [-u[best, 1], u[best, 0]]]), np.array([along[best], across[best]])
