"""How far the middles of regions lie apart along the surface.

Distances spread from vertex to vertex as on unfolded triangles: where both ends of an edge know how far they are, the
point they measure from lies in the plane of the next triangle, and the vertex across is as far from it as the straight line. On
flat and developable surfaces this is exact until lines meet a corner.
"""

import heapq

import numpy as np
from numpy.typing import NDArray

from app.geometry.cleaning import diagonal
from app.geometry.compiled import kernel
from app.geometry.slicing import closest_points
from app.geometry.tool import Array, Mesh

FINEST = 1 / 48  # of the surface's diagonal: longer edges are halved before, as long triangles know distances at their ends only
MOST_FACES = 60_000  # beyond this nothing more is halved
TIED = 1e-9  # of the diagonal: points that are as near to a target; the first one counts, however the part is turned
MOST_VISITS = 40  # of a vertex; a bound for meshes that are no surfaces


def surface_distances(mesh: Mesh, labels: NDArray[np.int32], targets: Array) -> Array:
    """Shortest way over the working surface between the regions' middles (n, n), m; infinite where it doesn't hang together.

    Args:
        mesh: The part.
        labels: (F,) region of each face, -1 outside the working surface.
        targets: (n, 3) the middle of a region is its point nearest to this one.
    """
    chosen = np.flatnonzero(labels >= 0)
    used, faces = np.unique(mesh.faces[chosen], return_inverse=True)
    vertices, faces, region = halved(mesh.vertices[used], faces.reshape(-1, 3).astype(np.int64), labels[chosen])
    n = len(targets)
    corners = vertices[faces]
    foot = closest_points(corners, targets[region])
    away = np.linalg.norm(foot - targets[region], axis=1)
    nearest = np.full(n, np.inf)
    np.minimum.at(nearest, region, away)
    near = np.flatnonzero(away <= nearest[region] + TIED * diagonal(vertices))
    first = near[np.unique(region[near], return_index=True)[1]]
    middle = foot[first]
    start, around = _around(faces, len(vertices))
    result = np.empty((n, n))
    for a in range(n):
        far = _spread(vertices, faces, start, around, first[a], middle[a])
        result[a] = _at(vertices, faces[first], middle, far)
    result = np.minimum(result, result.T)
    np.fill_diagonal(result, 0.0)
    return result


def halved(vertices: Array, faces: NDArray[np.int64], region: NDArray[np.int32]) -> tuple[Array, NDArray[np.int64], NDArray[np.int32]]:
    """The same surface with no edge longer than FINEST of its diagonal, neighbours still meeting edge to edge."""
    longest = FINEST * float(diagonal(vertices))
    while len(faces) < MOST_FACES:
        sides = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1), axis=-1).reshape(-1, 2)
        edges, edge = np.unique(sides[:, 0] * len(vertices) + sides[:, 1], return_inverse=True)
        low, high = edges // len(vertices), edges % len(vertices)
        length = np.linalg.norm(vertices[low] - vertices[high], axis=1)
        split = length > longest
        if not split.any():
            break
        # the longest first: a triangle's other long edges come next round, so that pieces stay well shaped
        own = length[edge].reshape(-1, 3)
        is_longest = np.zeros((len(faces), 3), bool)
        is_longest[np.arange(len(faces)), own.argmax(axis=1)] = True
        count = np.bincount(edge.ravel(), weights=is_longest.ravel(), minlength=len(edges))
        split &= count > 0
        number = np.full(len(edges), -1)
        number[split] = len(vertices) + np.arange(split.sum())
        vertices = np.concatenate([vertices, (vertices[low[split]] + vertices[high[split]]) / 2])
        faces, region = _cut(faces, region, number[edge].reshape(-1, 3))
    return vertices, faces, region


def _cut(faces: NDArray[np.int64], region: NDArray[np.int32], new: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int32]]:
    """Triangles with a new vertex on some sides (F, 3; -1: none; side k runs from corner k to the next)."""
    parts, owners = [faces[(new < 0).all(axis=1)]], [region[(new < 0).all(axis=1)]]
    for k in range(3):
        a, b, c = (faces[:, (k + i) % 3] for i in range(3))
        p, q, r = (new[:, (k + i) % 3] for i in range(3))
        one, two = (p >= 0) & (q < 0) & (r < 0), (p >= 0) & (q >= 0) & (r < 0)
        pieces = [(one, (a, p, c)), (one, (p, b, c)), (two, (p, b, q)), (two, (a, p, q)), (two, (a, q, c))]
        if k == 0:
            every = (new >= 0).all(axis=1)
            pieces += [(every, three) for three in ((a, p, r), (p, b, q), (r, q, c), (p, q, r))]
        for mask, three in pieces:
            parts.append(np.stack([corner[mask] for corner in three], axis=1))
            owners.append(region[mask])
    return np.concatenate(parts), np.concatenate(owners)


def _around(faces: NDArray[np.int64], n: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Faces around every vertex: those of v are around[start[v]:start[v + 1]]."""
    flat = faces.ravel()
    order = np.argsort(flat, kind="stable")
    return np.searchsorted(flat[order], np.arange(n + 1)), order // 3


@kernel
def _across(first, second, base, near, far, height):  # pragma: no cover - compiled
    """Distance of a vertex beyond an edge of length `base`, whose ends lie at `first` and `second` from the origin of the line.

    The vertex stands `height` over the place `near` from the first end and `far` from the second. Where the straight line misses
    the edge, the way leads along a side.
    """
    left = first + np.sqrt(near * near + height * height)
    right = second + np.sqrt(far * far + height * height)
    best = min(left, right)
    x = (first * first - second * second + base * base) / (2 * base)
    square = first * first - x * x
    if square >= 0 and height > 0:
        y = np.sqrt(square)  # below the edge
        crossing = x + (near - x) * y / (y + height)
        if 0 <= crossing <= base:
            return min(best, np.sqrt((near - x) ** 2 + (y + height) ** 2))
    return best


@kernel
def _over(v, a, b, far_a, far_b, c):  # pragma: no cover - compiled
    """Distance of the point c (3,) in a triangle over the edge between vertices a and b."""
    base, near, square = 0.0, 0.0, 0.0
    for k in range(3):
        base += (v[b, k] - v[a, k]) ** 2
        near += (v[b, k] - v[a, k]) * (c[k] - v[a, k])
        square += (c[k] - v[a, k]) ** 2
    base = np.sqrt(base)
    if base <= 0:
        return far_a + np.sqrt(square)
    near /= base
    return _across(far_a, far_b, base, near, base - near, np.sqrt(max(square - near * near, 0.0)))


@kernel
def _spread(vertices, faces, start, around, origin, middle):  # pragma: no cover - compiled
    """Distances of all vertices (V,) from a point of the face `origin`."""
    n = len(vertices)
    far, visits = np.full(n, np.inf), np.zeros(n, np.int64)
    heap = [(0.0, faces[origin, 0])]
    heap.pop()
    for v in faces[origin]:
        gap = 0.0
        for k in range(3):
            gap += (vertices[v, k] - middle[k]) ** 2
        far[v] = np.sqrt(gap)
        heapq.heappush(heap, (far[v], v))  # pyright: ignore[reportArgumentType]
    while heap:
        known, v = heapq.heappop(heap)
        if known > far[v] or visits[v] >= MOST_VISITS:
            continue
        visits[v] += 1
        for f in around[start[v] : start[v + 1]]:
            k = 0
            while faces[f, k] != v:
                k += 1
            for turn in range(1, 3):
                c, other = faces[f, (k + turn) % 3], faces[f, (k + 3 - turn) % 3]
                if np.isfinite(far[other]):
                    gap = _over(vertices, v, other, known, far[other], vertices[c])
                else:
                    gap = 0.0
                    for d in range(3):
                        gap += (vertices[c, d] - vertices[v, d]) ** 2
                    gap = known + np.sqrt(gap)
                if gap < far[c] * (1 - 1e-12):
                    far[c] = gap
                    heapq.heappush(heap, (gap, c))
    return far


@kernel
def _at(vertices, faces, points, far):  # pragma: no cover - compiled
    """Distances (K,) of points in the triangles (K, 3)."""
    result = np.full(len(points), np.inf)
    for i in range(len(points)):
        for k in range(3):
            a, b = faces[i, k], faces[i, (k + 1) % 3]
            if np.isfinite(far[a]) and np.isfinite(far[b]):
                result[i] = min(result[i], _over(vertices, a, b, far[a], far[b], points[i]))
    return result
