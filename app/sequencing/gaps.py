"""How full the bounding box or the convex hull of a set of regions is, compiled."""

import numba as nb
import numpy as np
from numpy.typing import NDArray

from app.geometry.tool import Array


@nb.njit(cache=True)
def box_gaps(inside: NDArray[np.bool_], low: Array, high: Array, area: Array, plain: bool) -> Array:
    """1 - area(S) / area(box of S) for each row S of `inside` (M, N); 0 for at most one region.

    `low` and `high` (N, 2) are the regions' boxes. The box's area is its width by height if `plain`, else the regions'
    areas times the share of their own box inside it; a region without extent along an axis is inside or not.
    """
    m, n = inside.shape
    out = np.zeros(m)
    lo, hi = np.zeros(2), np.zeros(2)
    for i in range(m):
        lo[:], hi[:] = np.inf, -np.inf
        members, own = 0, 0.0
        for a in range(n):
            if inside[i, a]:
                members += 1
                own += area[a]
                for k in range(2):
                    lo[k], hi[k] = min(lo[k], low[a, k]), max(hi[k], high[a, k])
        if members < 2:
            continue
        box = (hi[0] - lo[0]) * (hi[1] - lo[1])
        if not plain:
            box = 0.0
            for b in range(n):
                share = 1.0
                for k in range(2):
                    common = min(high[b, k], hi[k]) - max(low[b, k], lo[k])
                    extent = high[b, k] - low[b, k]
                    if extent > 0:
                        share *= max(common, 0.0) / extent
                    elif common < 0:
                        share = 0.0
                box += share * area[b]
        if box > 0:  # walls have no area in plan view
            out[i] = 1 - own / box
    return out


@nb.njit(cache=True)
def hull_gaps(inside: NDArray[np.bool_], low: Array, high: Array, area: Array) -> Array:
    """1 - area(S) / area of the convex hull of the corners of S for each row S of `inside` (M, N); 0 for at most one region."""
    m, n = inside.shape
    corners, owner = np.empty((4 * n, 2)), np.empty(4 * n, np.int64)
    for a in range(n):
        for k in range(4):
            corners[4 * a + k, 0] = low[a, 0] if k < 2 else high[a, 0]
            corners[4 * a + k, 1] = low[a, 1] if k % 2 == 0 else high[a, 1]
            owner[4 * a + k] = a
    by_y = np.argsort(corners[:, 1], kind="mergesort")
    order = by_y[np.argsort(corners[by_y, 0], kind="mergesort")]  # sorted once: every subset is sorted too
    out, chain = np.zeros(m), np.empty(4 * n, np.int64)
    for i in range(m):
        members, own = 0, 0.0
        for a in range(n):
            if inside[i, a]:
                members += 1
                own += area[a]
        if members < 2:
            continue
        hull = 0.0
        for side in (1.0, -1.0):  # below, then above
            top = 0
            for p in order:
                if not inside[i, owner[p]]:
                    continue
                while top > 1 and side * _turn(corners, chain[top - 2], chain[top - 1], p) <= 0:
                    top -= 1
                chain[top] = p
                top += 1
            for q in range(top - 1):
                a, b = chain[q], chain[q + 1]
                hull -= side * (corners[b, 0] - corners[a, 0]) * (corners[a, 1] + corners[b, 1]) / 2
        if hull > 0:
            out[i] = 1 - own / hull
    return out


@nb.njit(cache=True)
def _turn(points: Array, a: int, b: int, c: int) -> float:
    """Positive when the way from a over b to c turns left."""
    return (points[b, 0] - points[a, 0]) * (points[c, 1] - points[a, 1]) - (points[b, 1] - points[a, 1]) * (points[c, 0] - points[a, 0])
