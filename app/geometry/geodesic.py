"""Shortest lines on a part of a mesh, as the edges they cross, so that the mesh can be split along them.

First the shortest path over a few points on every edge, then the exact place on each crossed edge: the length of a chain of
crossings is convex in them. The result is the shortest line through those triangles.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import dijkstra

from app.geometry.slicing import Integers
from app.geometry.tool import Array, Mesh

FEW = 1_500  # faces up to which the fine search covers them all
FINE, COARSE = 5, 2  # points on every edge
BAND, ROUNDS = 5, 3  # rings of faces around a line in which it is searched again more finely, and how often
SWEEPS, SETTLED = 400, 1e-6  # rounds of pulling tight; relative gain of ten rounds at which it ends
AT_END = 0.02  # closer to an end of an edge, the line goes through the vertex: no slivers


@dataclass(frozen=True)
class SurfaceLine:
    """A line on the mesh from crossing to crossing; a crossing at a vertex has that vertex as both ends."""

    ends: Integers  # (K, 2) vertices of the crossed edges
    along: Array  # (K,) 0 at the first, 1 at the second
    points: Array  # (K, 3) metres

    @property
    def length(self) -> float:
        return _length(self.points)


def shortest_line(mesh: Mesh, faces: Integers, start: int, goal: int | None) -> SurfaceLine | None:
    """The shortest line over the listed faces between two vertices of theirs; None when they don't hang together.

    Args:
        mesh: The mesh.
        faces: (K,) the faces it may use.
        start: The vertex it starts at.
        goal: The vertex it ends at; None: wherever on the border of those faces it gets first.
    """
    borders = border_edges(mesh.faces[faces])
    chain = _chain(mesh, faces, start, goal, FINE if len(faces) <= FEW else COARSE, borders)
    if chain is None:
        return None
    line = _tight(mesh, chain)
    for _ in range(ROUNDS if len(faces) > FEW else 0):
        again = _chain(mesh, _around(mesh, faces, line), start, goal, FINE, borders)
        finer = _tight(mesh, again) if again is not None else line
        if finer.length >= line.length * (1 - 1e-3):
            return min(line, finer, key=lambda each: each.length)
        line = finer
    return line


def border_edges(faces: NDArray[np.integer]) -> set[tuple[int, int]]:
    """Edges (low, high) that belong to exactly one of the faces."""
    sides = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
    edges, count = np.unique(sides, axis=0, return_counts=True)
    return {(int(a), int(b)) for a, b in edges[count == 1]}


Chain = list[tuple[int, int, float]]  # crossed edges (low, high, along); (v, v, 0) for a vertex


def _chain(mesh: Mesh, faces: Integers, start: int, goal: int | None, count: int, borders: set[tuple[int, int]]) -> Chain | None:
    """The shortest path over `count` points on every edge."""
    corners = mesh.faces[faces].astype(np.int64)
    following = np.roll(corners, -1, axis=1)
    sides = np.stack([np.minimum(corners, following), np.maximum(corners, following)], axis=-1)
    edges, edge = np.unique(sides.reshape(-1, 2), axis=0, return_inverse=True)
    edge = edge.reshape(-1, 3)
    along = (np.arange(count) + 0.5) / count
    low, high = mesh.vertices[edges[:, 0]], mesh.vertices[edges[:, 1]]
    places = (low[:, None] + along[:, None] * (high - low)[:, None]).reshape(-1, 3)  # edge e's points are e * count + k
    special = [start] if goal is None else [start, goal]
    places = np.concatenate([places, mesh.vertices[special]])
    graph = _graph(corners, edge, count, places, special, len(edges) * count)
    distance, before = dijkstra(graph, directed=False, indices=len(edges) * count, return_predecessors=True)
    if goal is not None:
        last = len(places) - 1
    else:
        free = np.array([(int(a), int(b)) in borders for a, b in edges])
        on_border = np.flatnonzero(np.repeat(free, count))
        if len(on_border) == 0:
            return None
        last = int(on_border[np.argmin(distance[on_border])])
    if not np.isfinite(distance[last]):
        return None
    nodes = [last]
    while before[nodes[-1]] >= 0:
        nodes.append(int(before[nodes[-1]]))
    result: Chain = []
    for node in reversed(nodes):
        if node >= len(edges) * count:
            vertex = special[node - len(edges) * count]
            result.append((vertex, vertex, 0.0))
        else:
            result.append((int(edges[node // count, 0]), int(edges[node // count, 1]), float(along[node % count])))
    return result


def _graph(corners: Integers, edge: Integers, count: int, places: Array, special: list[int], first: int) -> csr_array:
    """Which points see each other across a triangle, and how far they are apart."""
    k = np.arange(count)
    rows, cols = [], []
    for i, j in ((0, 1), (1, 2), (2, 0)):
        a = (edge[:, i, None] * count + k)[:, :, None]
        b = (edge[:, j, None] * count + k)[:, None, :]
        a, b = np.broadcast_arrays(a, b)
        rows.append(a.ravel())
        cols.append(b.ravel())
    for number, vertex in enumerate(special):
        face, corner = np.nonzero(corners == vertex)
        opposite = edge[face, (corner + 1) % 3]
        seen = (opposite[:, None] * count + k).ravel()
        rows.append(np.full(len(seen), first + number))
        cols.append(seen)
    if len(special) == 2 and ((corners == special[0]).any(axis=1) & (corners == special[1]).any(axis=1)).any():
        rows.append(np.array([first]))
        cols.append(np.array([first + 1]))
    row, col = np.concatenate(rows), np.concatenate(cols)
    weight = np.linalg.norm(places[row] - places[col], axis=1)
    return csr_array(coo_array((np.maximum(weight, 1e-15), (row, col)), shape=(len(places), len(places))))


def _around(mesh: Mesh, faces: Integers, line: SurfaceLine) -> Integers:
    """The faces within BAND rings of a line."""
    touched = np.zeros(len(mesh.vertices), bool)
    touched[line.ends.ravel()] = True
    corners = mesh.faces[faces]
    for _ in range(BAND):
        near = touched[corners].any(axis=1)
        touched[corners[near]] = True
    return faces[touched[corners].all(axis=1)]


def _tight(mesh: Mesh, chain: Chain) -> SurfaceLine:
    """Pull the line tight; its vertices stay where they are.

    Every second crossing at a time moves to where the line between its neighbours, unfolded into one plane, crosses its edge.
    """
    ends = np.array([(low, high) for low, high, _ in chain])
    along = np.array([t for _, _, t in chain])
    base, reach = mesh.vertices[ends[:, 0]], mesh.vertices[ends[:, 1]] - mesh.vertices[ends[:, 0]]
    loose = ends[:, 0] != ends[:, 1]
    inner = np.flatnonzero(loose[1:-1]) + 1
    last = len(ends) - 1 if loose[-1] else None  # ends on a border, wherever that is nearest
    points = base + along[:, None] * reach
    length = _length(points)
    for sweep in range(SWEEPS):
        for odd in (0, 1):
            at = inner[inner % 2 == odd]
            along[at] = _crossing(points[at - 1], points[at + 1], base[at], reach[at])
            points[at] = base[at] + along[at, None] * reach[at]
        if last is not None:
            along[last] = np.clip((points[-2] - base[last]) @ reach[last] / (reach[last] @ reach[last]), 0, 1)
            points[last] = base[last] + along[last] * reach[last]
        if sweep % 10 == 9:
            before, length = length, _length(points)
            if before - length <= SETTLED * length:
                break
    return _through_vertices(mesh, ends, along)


def _length(points: Array) -> float:
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())


def _crossing(left: Array, right: Array, base: Array, reach: Array) -> Array:
    """Where on each edge (0 to 1) the way from `left` to `right` over it is shortest."""
    size = np.linalg.norm(reach, axis=1)
    axis = reach / size[:, None]
    u, v = np.einsum("ki,ki->k", left - base, axis), np.einsum("ki,ki->k", right - base, axis)
    a = np.linalg.norm(left - base - u[:, None] * axis, axis=1)
    b = np.linalg.norm(right - base - v[:, None] * axis, axis=1)
    return np.clip((u + (v - u) * a / np.maximum(a + b, 1e-300)) / size, 0, 1)


def _through_vertices(mesh: Mesh, ends: Integers, along: Array) -> SurfaceLine:
    """Crossings close to a vertex become that vertex, and each vertex comes once in a row."""
    ends = ends.copy()
    ends[along < AT_END] = ends[along < AT_END][:, :1]
    ends[along > 1 - AT_END] = ends[along > 1 - AT_END][:, 1:]
    corner = ends[:, 0] == ends[:, 1]
    along = np.where(corner, 0.0, along)
    same = np.concatenate([[False], (ends[1:] == ends[:-1]).all(axis=1)])
    ends, along = ends[~same], along[~same]
    points = mesh.vertices[ends[:, 0]] + along[:, None] * (mesh.vertices[ends[:, 1]] - mesh.vertices[ends[:, 0]])
    return SurfaceLine(ends, along, points)
