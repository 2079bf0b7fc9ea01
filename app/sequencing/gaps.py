"""How full the bounding box or the convex hull of a set of regions is, compiled."""

import numpy as np
from numpy.typing import NDArray

from app.geometry.compiled import kernel
from app.geometry.tool import Array


@kernel
def box_gaps(inside: NDArray[np.bool_], low: Array, high: Array, area: Array, plain: bool) -> Array:
    """1 - area(S) / area(box of S) for each row S of `inside` (M, N); 0 for at most one region.

    `low` and `high` (N, 2) are the regions' boxes. The box's area is its width by height if `plain`, else the regions'
    areas times the share of their own box inside it; a region without extent along an axis is inside or not.
    """
    out = np.empty(len(inside))
    for i in range(len(inside)):
        out[i] = box_gap(inside[i], low, high, area, plain)
    return out


@kernel(nogil=True)
def box_gap(inside: NDArray[np.bool_], low: Array, high: Array, area: Array, plain: bool) -> float:
    """`box_gaps` of one set."""
    x0, y0, x1, y1 = np.inf, np.inf, -np.inf, -np.inf
    members, own = 0, 0.0
    for a in range(len(inside)):
        if inside[a]:
            members, own = members + 1, own + area[a]
            x0, y0, x1, y1 = min(x0, low[a, 0]), min(y0, low[a, 1]), max(x1, high[a, 0]), max(y1, high[a, 1])
    if members < 2:
        return 0.0
    box = (x1 - x0) * (y1 - y0)
    if not plain:
        box = 0.0
        for b in range(len(inside)):
            box += _common(low[b, 0], high[b, 0], x0, x1) * _common(low[b, 1], high[b, 1], y0, y1) * area[b]
    return 1 - own / box if box > 0 else 0.0  # walls have no area in plan view


@kernel
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


@kernel
def _turn(points: Array, a: int, b: int, c: int) -> float:
    """Positive when the way from a over b to c turns left."""
    return (points[b, 0] - points[a, 0]) * (points[c, 1] - points[a, 1]) - (points[b, 1] - points[a, 1]) * (points[c, 0] - points[a, 0])


@kernel(nogil=True)
def box_table(
    low: Array, high: Array, area: Array, plain: bool, always: NDArray[np.bool_], free: NDArray[np.int64], out: NDArray[np.float32]
) -> None:
    """`box_gaps` of every subset of the free regions together with those that are `always` in; out[s] for the bit mask s.

    A box is known by the ranks of its four sides, so its area is looked up; sides and areas of a set follow from those of its
    low and its high half of the bits.
    """
    n = len(free)
    half = n // 2
    sides = (_ranks(low[:, 0]), _ranks(low[:, 1]), _ranks(high[:, 0]), _ranks(high[:, 1]))
    boxes = _box_areas(low, high, area, plain, sides)
    first = _half_sides(sides, area, free[:half])
    second = _half_sides(sides, area, free[half:])
    x0, y0, x1, y1, own0, size0 = len(area), len(area), -1, -1, 0.0, 0
    for a in np.flatnonzero(always):
        x0, y0, x1, y1 = min(x0, sides[0][a]), min(y0, sides[1][a]), max(x1, sides[2][a]), max(y1, sides[3][a])
        own0, size0 = own0 + area[a], size0 + 1
    mask = (1 << half) - 1
    for s in range(1 << n):
        i, j = s & mask, s >> half
        if size0 + first[5][i] + second[5][j] < 2:
            out[s] = 0
            continue
        left, down = min(x0, first[0][i], second[0][j]), min(y0, first[1][i], second[1][j])
        right, up = max(x1, first[2][i], second[2][j]), max(y1, first[3][i], second[3][j])
        box = boxes[left, down, right, up]
        out[s] = 1 - (own0 + first[4][i] + second[4][j]) / box if box > 0 else 0.0


@kernel(nogil=True)
def _ranks(values: Array) -> NDArray[np.int64]:
    return np.searchsorted(np.unique(values), values)


@kernel(nogil=True)
def _box_areas(low: Array, high: Array, area: Array, plain: bool, sides: tuple[NDArray[np.int64], ...]) -> Array:
    """Area by the ranks of the left, lower, right and upper side."""
    xs, ys, xe, ye = np.unique(low[:, 0]), np.unique(low[:, 1]), np.unique(high[:, 0]), np.unique(high[:, 1])
    out, share = np.zeros((len(xs), len(ys), len(xe), len(ye))), np.empty(len(area))
    for i in range(len(xs)):
        for k in range(len(xe)):
            for b in range(len(area)):
                share[b] = area[b] * _common(low[b, 0], high[b, 0], xs[i], xe[k])
            for j in range(len(ys)):
                for m in range(len(ye)):
                    if plain:
                        out[i, j, k, m] = (xe[k] - xs[i]) * (ye[m] - ys[j])
                    else:
                        total = 0.0
                        for b in range(len(area)):
                            if share[b] != 0:
                                total += share[b] * _common(low[b, 1], high[b, 1], ys[j], ye[m])
                        out[i, j, k, m] = total
    return out


@kernel(nogil=True)
def _common(low: float, high: float, start: float, end: float) -> float:
    """Share of low..high inside start..end; without extent it is inside or not."""
    common = min(high, end) - max(low, start)
    if high > low:
        return max(common, 0.0) / (high - low)
    return 0.0 if common < 0 else 1.0


@kernel(nogil=True)
def _half_sides(sides: tuple[NDArray[np.int64], ...], area: Array, regions: NDArray[np.int64]):  # type: ignore[no-untyped-def]
    """Ranks of the sides, area and size of every subset of a few regions."""
    size = 1 << len(regions)
    far = len(area)
    left, down = np.full(size, far), np.full(size, far)
    right, up, count, own = np.full(size, -1), np.full(size, -1), np.zeros(size, np.int64), np.zeros(size)
    for i in range(len(regions)):
        a = regions[i]
        for s in range(1 << i):
            t = (1 << i) | s
            left[t], down[t] = min(left[s], sides[0][a]), min(down[s], sides[1][a])
            right[t], up[t] = max(right[s], sides[2][a]), max(up[s], sides[3][a])
            count[t], own[t] = count[s] + 1, own[s] + area[a]
    return left, down, right, up, own, count
