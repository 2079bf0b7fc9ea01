"""Turn the triangles of one body into a welded, consistently wound surface, and count what was done to it."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from app.errors import UnreadableMesh
from app.geometry.compiled import kernel
from app.geometry.tool import Array

Level = Literal["info", "repaired", "refused", "warning"]
Integers = NDArray[np.int64]

WELD = 1e-6  # share of the diagonal within which two vertices are one
FLAT = 1e-12  # share of the squared diagonal below which a triangle has no area
FEW = 64  # sides in a bucket up to which they are sorted by insertion


@dataclass(frozen=True)
class CleaningReport:
    """What was found and done, in plain sentences."""

    lines: tuple[tuple[str, str], ...]  # (level, sentence)


@dataclass(frozen=True)
class RawSurface:
    """Triangles as the parser gave them."""

    vertices: Array  # (V, 3) file units
    faces: Integers  # (F, 3)
    cad_face: Integers  # (F,) id of the CAD face, -1 without


@dataclass(frozen=True)
class Findings:
    """What was wrong with a body's triangles."""

    joined: int  # corner points that were doubled and are now one
    flat: int  # triangles without area, removed
    doubled: int  # second copies of triangles, removed
    turned: int  # triangles that faced the other way than their neighbours, turned
    inside_out: bool  # all triangles of a closed body faced inward, turned
    one_sided: bool  # like a Moebius strip
    crowded: int  # edges shared by more than two triangles
    borders: tuple[float, ...]  # length of each open border, file units

    @property
    def closed(self) -> bool:
        """No triangle side is without a neighbour."""
        return not self.borders


@dataclass(frozen=True)
class CleanSurface:
    """A welded surface."""

    vertices: Array  # (V, 3) file units
    faces: Integers  # (F, 3)
    cad_face: Integers  # (F,)
    findings: Findings


def clean(raw: RawSurface) -> CleanSurface:
    """Weld, drop useless triangles, and make all triangles face the same way.

    Raises:
        UnreadableMesh: No triangle has an area.
    """
    vertices, faces = weld(raw.vertices, raw.faces)
    joined = len(np.unique(raw.faces)) - len(vertices)
    faces, cad_face, flat, doubled = _drop_useless(vertices, faces, raw.cad_face)
    used, inverse = np.unique(faces, return_inverse=True)
    vertices, faces = vertices[used], inverse.reshape(-1, 3)
    flip = _disagreeing(faces)
    faces, turned = _turn(faces, flip)
    edges, _, count = edge_table(faces)
    borders = _border_lengths(vertices, edges[count == 1])
    inside_out = not borders and flip is not None and _volume(vertices, faces) < 0
    if inside_out:
        faces = np.ascontiguousarray(faces[:, ::-1])
    crowded = int((count > 2).sum())
    return CleanSurface(vertices, faces, cad_face, Findings(joined, flat, doubled, turned, inside_out, flip is None, crowded, borders))


def weld(vertices: Array, faces: Integers) -> tuple[Array, Integers]:
    """Join vertices closer than WELD times the diagonal; the first of each group stays where it is, unused ones go."""
    used, corner = np.unique(faces, return_inverse=True)
    vertices = vertices[used]
    diagonal = float(np.linalg.norm(np.ptp(vertices, axis=0)))
    exact, first, inverse = np.unique(vertices, axis=0, return_index=True, return_inverse=True)
    pairs = KDTree(exact).query_pairs(WELD * diagonal, output_type="ndarray")
    graph = coo_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(exact), len(exact)))
    _, group = connected_components(graph, directed=False)
    _, representative = np.unique(group, return_index=True)
    return vertices[first[representative]], group[inverse.ravel()][corner].reshape(-1, 3).astype(np.int64)


def _drop_useless(vertices: Array, faces: Integers, cad_face: Integers) -> tuple[Integers, Integers, int, int]:
    """Remove triangles without area and second copies; how many of each."""
    collapsed = (faces == np.roll(faces, 1, axis=1)).any(axis=1)
    diagonal2 = float(np.sum(np.ptp(vertices, axis=0) ** 2))
    keep = ~collapsed & (2 * areas(vertices, faces) > FLAT * diagonal2)
    flat = int((~keep).sum())
    faces, cad_face = faces[keep], cad_face[keep]
    if len(faces) == 0:
        raise UnreadableMesh("No triangle in the file has an area. Export a solid or a surface.")
    _, first = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)
    doubled = len(faces) - len(first)
    first.sort()
    return faces[first], cad_face[first], flat, doubled


def edge_table(faces: NDArray[np.integer]) -> tuple[Integers, Integers, Integers]:
    """Edges (E, 2) sorted, the edge of each face side (F, 3), and the number of faces at each edge (E,)."""
    compact = np.ascontiguousarray(faces, np.int64)
    return _edges_of(compact, int(compact.max(initial=-1)) + 1)


@kernel
def _edges_of(faces, n):  # pragma: no cover - compiled
    """Sides are put into one bucket per smaller vertex; within a bucket, which holds about three, they are sorted by the other one."""
    total = 3 * len(faces)
    start, other, side = np.zeros(n + 1, np.int64), np.empty(total, np.int64), np.empty(total, np.int64)
    for f in range(len(faces)):
        for k in range(3):
            start[min(faces[f, k], faces[f, (k + 1) % 3]) + 1] += 1
    start = np.cumsum(start)
    free = start[:-1].copy()
    for f in range(len(faces)):
        for k in range(3):
            low, high = min(faces[f, k], faces[f, (k + 1) % 3]), max(faces[f, k], faces[f, (k + 1) % 3])
            other[free[low]], side[free[low]] = high, 3 * f + k
            free[low] += 1
    edges, side_edge, count = np.empty((total, 2), np.int64), np.empty((len(faces), 3), np.int64), np.zeros(total, np.int64)
    edge = -1
    for low in range(n):
        first, last = start[low], start[low + 1]
        if last == first:
            continue
        if last - first > FEW:
            order = np.argsort(other[first:last], kind="mergesort")
            other[first:last], side[first:last] = other[first:last][order], side[first:last][order]
        else:
            for at in range(first + 1, last):
                high, its, to = other[at], side[at], at
                while to > first and other[to - 1] > high:
                    other[to], side[to] = other[to - 1], side[to - 1]
                    to -= 1
                other[to], side[to] = high, its
        for here in range(first, last):
            if here == first or other[here] != edges[edge, 1]:
                edge += 1
                edges[edge, 0], edges[edge, 1] = low, other[here]
            side_edge[side[here] // 3, side[here] % 3] = edge
            count[edge] += 1
    return edges[: edge + 1], side_edge, count[: edge + 1]


def face_pairs(faces: NDArray[np.integer]) -> Integers:
    """Pairs of faces (P, 2) that share an edge with exactly two faces."""
    _, side_edge, count = edge_table(faces)
    return _pairs_at(side_edge, count)


@kernel
def _pairs_at(side_edge, count):  # pragma: no cover - compiled
    pairs = np.full((len(count), 2), -1, np.int64)
    for f in range(len(side_edge)):
        for k in range(3):
            edge = side_edge[f, k]
            if count[edge] == 2:
                pairs[edge, 1 if pairs[edge, 0] >= 0 else 0] = f
    return pairs[count == 2]


def shared_length(vertices: Array, faces: NDArray[np.integer], pairs: Integers) -> Array:
    """Length of the edge that each pair of faces (P, 2) shares (P,)."""
    return _lengths_of(np.ascontiguousarray(vertices, np.float64), np.ascontiguousarray(faces, np.int64), pairs)


@kernel
def _lengths_of(vertices, faces, pairs):  # pragma: no cover - compiled
    length = np.empty(len(pairs))
    for p in range(len(pairs)):
        f, g = faces[pairs[p, 0]], faces[pairs[p, 1]]
        odd = 0  # the corner of the first face that the second doesn't have; the edge lies across from it
        while odd < 2 and (f[odd] == g[0] or f[odd] == g[1] or f[odd] == g[2]):
            odd += 1
        side = vertices[f[(odd + 1) % 3]] - vertices[f[(odd + 2) % 3]]
        length[p] = np.sqrt(side[0] ** 2 + side[1] ** 2 + side[2] ** 2)
    return length


def components(faces: Integers) -> Integers:
    """Connected piece of each face (any shared edge counts), numbered from 0."""
    _, side_edge, count = edge_table(faces)
    links = np.stack([np.repeat(np.arange(len(faces)), 3), len(faces) + side_edge.ravel()], axis=1)
    return joined(links, len(faces) + len(count))[: len(faces)]


@kernel
def joined(links, n):  # pragma: no cover - compiled
    """Connected piece of each of n things (n,) that are linked in pairs (L, 2); pieces are counted from 0 in the order of their first."""
    above = np.arange(n)
    for link in links:
        a, b = link[0], link[1]
        while above[a] != a:
            above[a] = above[above[a]]
            a = above[a]
        while above[b] != b:
            above[b] = above[above[b]]
            b = above[b]
        above[max(a, b)] = min(a, b)
    piece, found = np.empty(n, np.int64), 0
    for i in range(n):
        if above[i] == i:
            piece[i] = found
            found += 1
        else:
            piece[i] = piece[above[i]]
    return piece


@kernel
def diagonal(points):  # pragma: no cover - compiled
    """Diagonal of the box around points (P, 3)."""
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for point in points:
        for c in range(3):
            low[c], high[c] = min(low[c], point[c]), max(high[c], point[c])
    return np.sqrt(np.sum((high - low) ** 2))


def areas(vertices: Array, faces: NDArray[np.integer]) -> Array:
    """Area of each face (F,)."""
    return _areas_of(np.ascontiguousarray(vertices, np.float64), np.ascontiguousarray(faces, np.int64))


@kernel
def _areas_of(vertices, faces):  # pragma: no cover - compiled
    area = np.empty(len(faces))
    for f in range(len(faces)):
        a, b, c = vertices[faces[f, 0]], vertices[faces[f, 1]], vertices[faces[f, 2]]
        x, y, z = b[0] - a[0], b[1] - a[1], b[2] - a[2]
        u, v, w = c[0] - a[0], c[1] - a[1], c[2] - a[2]
        area[f] = np.sqrt((y * w - z * v) ** 2 + (z * u - x * w) ** 2 + (x * v - y * u) ** 2) / 2
    return area


def _turn(faces: Integers, flip: NDArray[np.bool_] | None) -> tuple[Integers, int]:
    """Turn the faces to flip, or all others if those are fewer."""
    if flip is None or not flip.any():
        return faces, 0
    flip = flip if flip.mean() <= 0.5 else ~flip
    return np.where(flip[:, None], faces[:, ::-1], faces), int(flip.sum())


def _volume(vertices: Array, faces: Integers) -> float:
    """Six times the enclosed volume; negative when the faces look inward."""
    corners = (vertices - vertices.mean(axis=0))[faces]
    return float(np.einsum("ij,ij->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])))


def _border_lengths(vertices: Array, edges: Integers) -> tuple[float, ...]:
    """Length of each connected open border, longest first."""
    if len(edges) == 0:
        return ()
    n = len(vertices)
    graph = coo_matrix((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=(n, n))
    group = connected_components(graph, directed=False)[1][edges[:, 0]]
    length = np.bincount(
        np.unique(group, return_inverse=True)[1], weights=np.linalg.norm(vertices[edges[:, 0]] - vertices[edges[:, 1]], axis=1)
    )
    return tuple(float(x) for x in np.sort(length)[::-1])


def _disagreeing(faces: Integers) -> NDArray[np.bool_] | None:
    """Faces to flip so that all neighbours agree (None: impossible).

    Two copies of every face, as it is and flipped, are joined where they agree; copies in the piece of the first face's
    unflipped copy are right.
    """
    pairs = face_pairs(faces)
    n = len(faces)
    direction = np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1)  # (F, 3, 2)
    _, side_edge, count = edge_table(faces)
    flat = side_edge.ravel()
    order = np.argsort(flat, kind="stable")
    order = order[count[flat[order]] == 2].reshape(-1, 2)
    forward = (direction[..., 0] < direction[..., 1]).ravel()
    agree = forward[order[:, 0]] != forward[order[:, 1]]
    if agree.all():
        return np.zeros(n, bool)
    a, b = pairs[:, 0], pairs[:, 1]
    rows = np.concatenate([a, a + n])
    cols = np.concatenate([np.where(agree, b, b + n), np.where(agree, b + n, b)])
    _, group = connected_components(coo_matrix((np.ones(len(rows)), (rows, cols)), shape=(2 * n, 2 * n)), directed=False)
    if (group[:n] == group[n:]).any():
        return None
    # per piece of the surface, the copy that needs fewer flips
    partner = np.minimum(group[:n], group[n:])
    in_first = group[:n] == partner
    votes = np.bincount(partner, weights=np.where(in_first, 1.0, -1.0), minlength=int(group.max()) + 1)
    return in_first != (votes[partner] >= 0)
