"""Fit plane, sphere and cylinder to a cluster of triangles from 54 additive numbers, in constant time.

Sums over a cluster (weights: a third of the triangle's area at each corner, exact on CAD tessellations whose corners lie
on the true surface): 35 monomials of the position up to degree 4; area-weighted normal (3), normal x normal (6),
normal x centre (9); area (1). Adding two clusters adds their numbers.

Any squared-distance-like function is linear in the ten monomials q = (1, x, y, z, xx, yy, zz, xy, xz, yz), so the algebraic
fits only need products u . (sum q q^T) . v. Paper: Sec. V segments with hierarchical fitting primitives (its citation 34).
"""

import numpy as np
from numpy.typing import NDArray

from app.geometry.compiled import kernel
from app.geometry.tool import Array

_QUADRATIC = ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (2, 0, 0), (0, 2, 0), (0, 0, 2), (1, 1, 0), (1, 0, 1), (0, 1, 1))
_MONOMIALS = sorted({tuple(a + b for a, b in zip(p, q, strict=True)) for p in _QUADRATIC for q in _QUADRATIC}, key=lambda e: (sum(e), e))
_FACTOR = np.array([next((c for c in range(3) if m[c]), 0) for m in _MONOMIALS])  # a coordinate that divides each monomial
_REST = np.array(
    [_MONOMIALS.index((*m[:c], m[c] - 1, *m[c + 1 :])) if any(m) else 0 for m, c in zip(_MONOMIALS, _FACTOR, strict=True)]
)  # what is left
PRODUCT = np.array([[_MONOMIALS.index(tuple(a + b for a, b in zip(p, q, strict=True))) for q in _QUADRATIC] for p in _QUADRATIC])
SQUARE = np.array([[4, 7, 8], [7, 5, 9], [8, 9, 6]])  # position in q of x_a x_b
NORMAL, NORMAL2, NORMAL_CENTRE, AREA, SIZE = 35, 38, 44, 53, 54
NORMAL2_AT = np.array([[0, 1, 2], [1, 3, 4], [2, 4, 5]])
PLANE, SPHERE, CYLINDER = 0, 1, 2
KINDS = ("plane", "sphere", "cylinder", "cone", "freeform")
NO_FIT = 1e300
NORMAL_WEIGHT = 0.003  # lambda: how far (in diagonals) a normal error of 1 counts as a distance
LARGEST_RADIUS = 1e3  # diagonals; flatter is a plane


def face_sums(vertices: Array, faces: NDArray[np.integer]) -> Array:
    """The 54 numbers of every face (F, 54); vertices should be centred and of unit size."""
    return _sums_of(np.ascontiguousarray(vertices, np.float64), np.ascontiguousarray(faces, np.int64))


def sums_about(vertices: Array, faces: NDArray[np.integer], middle: Array, scale: float) -> Array:
    """The 54 numbers of some faces together (54,), in coordinates (x - middle) / scale."""
    return _sum_about(np.ascontiguousarray(vertices, np.float64), np.ascontiguousarray(faces, np.int64), middle, scale)


@kernel
def _sums_of(vertices, faces):  # pragma: no cover - compiled
    sums, corners, value = np.zeros((len(faces), SIZE)), np.empty((3, 3)), np.empty(NORMAL)
    for f in range(len(faces)):
        for k in range(3):
            corners[k] = vertices[faces[f, k]]
        _fill_sums(corners, value, sums[f])
    return sums


@kernel
def _sum_about(vertices, faces, middle, scale):  # pragma: no cover - compiled
    total, one, corners, value = np.zeros(SIZE), np.empty(SIZE), np.empty((3, 3)), np.empty(NORMAL)
    for f in range(len(faces)):
        for k in range(3):
            for c in range(3):
                corners[k, c] = (vertices[faces[f, k], c] - middle[c]) / scale
        one[:] = 0
        _fill_sums(corners, value, one)
        for at in range(SIZE):
            total[at] += one[at]
    return total


@kernel
def _fill_sums(corners, value, m):  # pragma: no cover - compiled
    """The 54 numbers of one face into m, which is all zero; value (35,) is scratch."""
    a, b, g = corners[0], corners[1], corners[2]
    twice = 0.0
    for c in range(3):
        d, e = (c + 1) % 3, (c + 2) % 3
        m[NORMAL + c] = (b[d] - a[d]) * (g[e] - a[e]) - (b[e] - a[e]) * (g[d] - a[d])
        twice += m[NORMAL + c] * m[NORMAL + c]
    area = np.sqrt(twice) / 2
    m[AREA] = area
    for v in corners:
        value[0] = area / 3
        m[0] += value[0]
        for at in range(1, NORMAL):  # by degree, so that the rest is known
            value[at] = value[_REST[at]] * v[_FACTOR[at]]
            m[at] += value[at]
    for c in range(3):
        m[NORMAL + c] /= 2  # area times unit normal
        for d in range(3):
            m[NORMAL_CENTRE + 3 * d + c] = (a[c] + b[c] + g[c]) / 3
    for c in range(3):
        for d in range(3):
            m[NORMAL_CENTRE + 3 * c + d] *= m[NORMAL + c]
            if c <= d and area > 0:
                m[NORMAL2 + NORMAL2_AT[c, d]] = m[NORMAL + c] * m[NORMAL + d] / area


def add_up(sums: Array, label: NDArray[np.integer]) -> Array:
    """Sums per label (max + 1, 54); faces with label -1 are left out."""
    return _added(sums, np.ascontiguousarray(label, np.int64), int(label.max()) + 1)


@kernel
def _added(sums, label, n):  # pragma: no cover - compiled
    total = np.zeros((n, sums.shape[1]))
    for f in range(len(label)):
        if label[f] >= 0:
            for k in range(sums.shape[1]):
                total[label[f], k] += sums[f, k]
    return total


@kernel
def smallest_eigen(s, vector):  # pragma: no cover - compiled
    """Smallest eigenvalue of the symmetric s (3, 3), which is overwritten; fills its unit eigenvector (cyclic Jacobi)."""
    u = np.eye(3)
    for _ in range(15):
        off = abs(s[0, 1]) + abs(s[0, 2]) + abs(s[1, 2])
        if off <= 1e-17 * (abs(s[0, 0]) + abs(s[1, 1]) + abs(s[2, 2])):
            break
        for p in range(2):
            for q in range(p + 1, 3):
                if s[p, q] == 0.0:
                    continue
                half = 0.5 * np.arctan2(2 * s[p, q], s[p, p] - s[q, q])
                c, d = np.cos(half), np.sin(half)
                for k in range(3):
                    x, y = s[k, p], s[k, q]
                    s[k, p], s[k, q] = c * x + d * y, c * y - d * x
                for k in range(3):
                    x, y = s[p, k], s[q, k]
                    s[p, k], s[q, k] = c * x + d * y, c * y - d * x
                for k in range(3):
                    x, y = u[k, p], u[k, q]
                    u[k, p], u[k, q] = c * x + d * y, c * y - d * x
    least = 0
    for k in range(1, 3):
        if s[k, k] < s[least, least]:
            least = k
    for k in range(3):
        vector[k] = u[k, least]
    return s[least, least]


@kernel
def solve3(a, b):  # pragma: no cover - compiled
    """Cramer's rule, b becomes the solution; False when singular."""
    c00 = a[1, 1] * a[2, 2] - a[1, 2] * a[2, 1]
    c01 = a[1, 2] * a[2, 0] - a[1, 0] * a[2, 2]
    c02 = a[1, 0] * a[2, 1] - a[1, 1] * a[2, 0]
    det = a[0, 0] * c00 + a[0, 1] * c01 + a[0, 2] * c02
    if abs(det) < 1e-13:
        return False
    x = (b[0] * c00 + b[1] * (a[0, 2] * a[2, 1] - a[0, 1] * a[2, 2]) + b[2] * (a[0, 1] * a[1, 2] - a[0, 2] * a[1, 1])) / det
    y = (b[0] * c01 + b[1] * (a[0, 0] * a[2, 2] - a[0, 2] * a[2, 0]) + b[2] * (a[0, 2] * a[1, 0] - a[0, 0] * a[1, 2])) / det
    z = (b[0] * c02 + b[1] * (a[0, 1] * a[2, 0] - a[0, 0] * a[2, 1]) + b[2] * (a[0, 0] * a[1, 1] - a[0, 1] * a[1, 0])) / det
    b[0], b[1], b[2] = x, y, z
    return True


@kernel
def round_fit(m, across, spread, g, centre):  # pragma: no cover - compiled
    """Algebraic sphere (across = identity) or cylinder (across drops the axis): int (s - 2 c.x - d)^2 / (4 r^2).

    Here x is the position from the centroid g and s = x^T across x. Fills centre; returns (error, radius).
    """
    w = m[0]
    row = np.zeros(10)  # s as a combination of the monomials q
    ag = across @ g
    row[0] = g[0] * ag[0] + g[1] * ag[1] + g[2] * ag[2]
    for a in range(3):
        row[1 + a] = -2 * ag[a]
        for b in range(3):
            row[SQUARE[a, b]] += across[a, b]
    sq = np.zeros(10)  # sum of s times each monomial
    for i in range(10):
        for j in range(10):
            sq[i] += row[j] * m[PRODUCT[i, j]]
    ss, s1 = 0.0, sq[0]
    for i in range(10):
        ss += row[i] * sq[i]
    flat = across @ spread @ across
    trace = flat[0, 0] + flat[1, 1] + flat[2, 2]
    if trace <= 0:
        return NO_FIT, 0.0
    lhs, c, sx = np.empty((3, 3)), np.empty(3), np.empty(3)
    for a in range(3):
        sx[a] = sq[1 + a] - g[a] * s1
    c[:] = across @ sx / (2 * trace)
    for a in range(3):
        for b in range(3):
            lhs[a, b] = flat[a, b] / trace + ((1.0 if a == b else 0.0) - across[a, b])  # identity along the axis
    if not solve3(lhs, c):
        return NO_FIT, 0.0
    r2 = c[0] * c[0] + c[1] * c[1] + c[2] * c[2] + s1 / w
    if r2 <= 0 or r2 > LARGEST_RADIUS * LARGEST_RADIUS:
        return NO_FIT, 0.0
    error = ss - s1 * s1 / w
    for a in range(3):
        error -= 4 * c[a] * sx[a]
        for b in range(3):
            error += 4 * c[a] * spread[a, b] * c[b]
        centre[a] = g[a] + c[a]
    return max(error, 0.0) / (4 * r2), np.sqrt(r2)


@kernel
def fit(m, weight, out):  # pragma: no cover - compiled
    """Cost of the best primitive: int distance^2 + weight^2 int |n - n_primitive|^2.

    Fills out with the kind, the signed curvature 1/r (+ convex) and the cylinder's axis (3). Without the normal term any
    two triangles would merge across a crease for nothing, as a sphere fits them exactly.
    """
    w = m[0]
    g, axis, centre = np.empty(3), np.empty(3), np.empty(3)
    spread, work = np.empty((3, 3)), np.empty((3, 3))
    for a in range(3):
        g[a] = m[PRODUCT[0, 1 + a]] / w
    for a in range(3):
        for b in range(3):
            spread[a, b] = work[a, b] = m[PRODUCT[1 + a, 1 + b]] - w * g[a] * g[b]
    flatness = smallest_eigen(work, axis)
    along = abs(m[NORMAL] * axis[0] + m[NORMAL + 1] * axis[1] + m[NORMAL + 2] * axis[2])
    best = max(flatness, 0.0) + 2 * weight * weight * max(m[AREA] - along, 0.0)
    out[0], out[1], out[2], out[3], out[4] = PLANE, 0.0, 0.0, 0.0, 0.0
    across = np.eye(3)
    for kind in range(SPHERE, CYLINDER + 1):
        if kind == CYLINDER:  # the axis is the direction that normals avoid
            for a in range(3):
                for b in range(3):
                    work[a, b] = m[NORMAL2 + NORMAL2_AT[a, b]]
            smallest_eigen(work, axis)
            for a in range(3):
                for b in range(3):
                    across[a, b] -= axis[a] * axis[b]
        error, radius = round_fit(m, across, spread, g, centre)
        if error >= NO_FIT:
            continue
        radial = 0.0  # sum of A n . across (x - centre): positive when normals point away from the centre
        for a in range(3):
            for b in range(3):
                radial += across[a, b] * (m[NORMAL_CENTRE + 3 * a + b] - m[NORMAL + a] * centre[b])
        sign = 1.0 if radial >= 0 else -1.0
        error += 2 * weight * weight * max(m[AREA] - sign * radial / radius, 0.0)
        if error < best:
            best = error
            out[0], out[1] = kind, sign / radius
            for a in range(3):
                out[2 + a] = axis[a] if kind == CYLINDER else 0.0
    return best
