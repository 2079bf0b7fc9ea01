"""Fit a cone or a general quadric to a cluster of triangles from the same 54 numbers as plane, sphere and cylinder.

The general quadric f is the least-squares solution of int f^2 + weight^2 int |grad f - n|^2: ten linear equations. As the
gradient is asked to be the unit normal, f is nearly a distance, and what is left over is the cost itself. It describes
freeform patches (ellipsoids, saddles, ruled patches), which no other primitive fits.
"""

import numpy as np

from app.geometry.compiled import kernel
from app.geometry.fitting import AREA, NO_FIT, NORMAL, NORMAL2, NORMAL2_AT, NORMAL_CENTRE, PRODUCT, SQUARE, fit, smallest_eigen, solve3

CONE, QUADRIC = 3, 4
# a quadric has more freedom than the other primitives (9 against 3 to 6 numbers) and fits two of them joined smoothly; its
# cost counts this many times, so that it only takes what none of them describes
FREEDOM = 4.0
RIDGE = 1e-11  # keeps the ten equations solvable for planes, where many quadrics agree
STEEPEST, SHALLOWEST = 0.996, 0.05  # cosine between a cone's normals and its axis beyond which it is a plane or a cylinder
APEX = 2.0  # least square of the apex distance over the variance of the height; less means that the apex lies inside

_GRADIENT = np.zeros((3, 10, 4))  # component, monomial -> combination of (1, x, y, z)
for _c in range(3):
    _GRADIENT[_c, 1 + _c, 0] = 1
    for _d in range(3):
        _GRADIENT[_c, SQUARE[_c, _d], 1 + _d] += 2 if _c == _d else 1
_TERMS = [
    (i, j, PRODUCT[k, m], float(_GRADIENT[c, i, k] * _GRADIENT[c, j, m]))
    for i in range(10)
    for j in range(i + 1)
    for c in range(3)
    for k in range(4)
    for m in range(4)
    if _GRADIENT[c, i, k] * _GRADIENT[c, j, m]
]
_TERM_AT = np.array([t[:3] for t in _TERMS])
_TERM_BY = np.array([t[3] for t in _TERMS])
_SLOPES = [
    (i, NORMAL + c if k == 0 else NORMAL_CENTRE + 3 * c + k - 1, float(_GRADIENT[c, i, k]))
    for c in range(3)
    for i in range(10)
    for k in range(4)
    if _GRADIENT[c, i, k]
]
_SLOPE_AT = np.array([t[:2] for t in _SLOPES])
_SLOPE_BY = np.array([t[2] for t in _SLOPES])


@kernel
def _solve_spd(a, b):  # pragma: no cover - compiled
    """Cholesky: b becomes the solution of a b = b for a symmetric positive definite (lower half used); False when it is not."""
    n = len(b)
    for j in range(n):
        s = a[j, j]
        for k in range(j):
            s -= a[j, k] * a[j, k]
        if s <= 0:
            return False
        root = np.sqrt(s)
        a[j, j] = root
        for i in range(j + 1, n):
            s = a[i, j]
            for k in range(j):
                s -= a[i, k] * a[j, k]
            a[i, j] = s / root
    for i in range(n):
        for k in range(i):
            b[i] -= a[i, k] * b[k]
        b[i] /= a[i, i]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            b[i] -= a[k, i] * b[k]
        b[i] /= a[i, i]
    return True


@kernel
def fit_quadric(m, weight, q):  # pragma: no cover - compiled
    """Cost of the best general quadric; fills its ten coefficients."""
    a, right = np.empty((10, 10)), np.zeros(10)
    square = weight * weight
    for i in range(10):
        for j in range(i + 1):
            a[i, j] = m[PRODUCT[i, j]]
        a[i, i] += RIDGE * m[0]
    for t in range(len(_TERM_BY)):
        a[_TERM_AT[t, 0], _TERM_AT[t, 1]] += square * _TERM_BY[t] * m[_TERM_AT[t, 2]]
    for t in range(len(_SLOPE_BY)):
        right[_SLOPE_AT[t, 0]] += square * _SLOPE_BY[t] * m[_SLOPE_AT[t, 1]]
    q[:] = right
    if not _solve_spd(a, q):
        return NO_FIT
    gained = 0.0
    for i in range(10):
        gained += right[i] * q[i]
    return max(square * m[AREA] - gained, 0.0)


@kernel
def _cone_axis(m, axis):  # pragma: no cover - compiled
    """Fill the direction along which normals vary least; returns by how much they do (int), and the cosine between them and it."""
    varying = np.empty((3, 3))
    for a in range(3):
        for b in range(3):
            varying[a, b] = m[NORMAL2 + NORMAL2_AT[a, b]] - m[NORMAL + a] * m[NORMAL + b] / m[AREA]
    least = max(smallest_eigen(varying, axis), 0.0)
    return least, (m[NORMAL] * axis[0] + m[NORMAL + 1] * axis[1] + m[NORMAL + 2] * axis[2]) / m[AREA]


@kernel
def _about_centroid(m, g, spread):  # pragma: no cover - compiled
    """Fill the centroid and the spread of the positions about it."""
    for a in range(3):
        g[a] = m[PRODUCT[0, 1 + a]] / m[0]
    for a in range(3):
        for b in range(3):
            spread[a, b] = m[PRODUCT[1 + a, 1 + b]] - m[0] * g[a] * g[b]


@kernel
def _leaning(m, s2, g, sq):  # pragma: no cover - compiled
    """Fill sq with int s x monomial for s = (x - g)^T s2 (x - g); returns int s^2."""
    row, ss = np.zeros(10), 0.0
    for a in range(3):
        sg = s2[a, 0] * g[0] + s2[a, 1] * g[1] + s2[a, 2] * g[2]
        row[0] += g[a] * sg
        row[1 + a] -= 2 * sg
        for b in range(3):
            row[SQUARE[a, b]] += s2[a, b]
    for i in range(10):
        sq[i] = 0.0
        for j in range(10):
            sq[i] += row[j] * m[PRODUCT[i, j]]
        ss += row[i] * sq[i]
    return ss


@kernel
def _slope_of(m, s2, spread, g, c):  # pragma: no cover - compiled
    """Mean square of |grad f| / 2, and int n . grad f / 2, for f = s - 2 c . (x - g) - d."""
    steep2, radial = c[0] * c[0] + c[1] * c[1] + c[2] * c[2], 0.0
    for a in range(3):
        for b in range(3):
            part = 0.0
            for k in range(3):
                part += s2[a, k] * spread[k, b]
            steep2 += part * s2[a, b] / m[0]
            radial += s2[a, b] * (m[NORMAL_CENTRE + 3 * a + b] - m[NORMAL + a] * g[b])
        radial -= m[NORMAL + a] * c[a]
    return steep2, radial


@kernel
def fit_cone(m, weight, out):  # pragma: no cover - compiled
    """Cost of the best circular cone; fills curvature at the middle (signed, 1 / distance to the axis along the normal) and axis.

    The axis is the direction along which normals all have the same component; with it the cone is linear in what is left:
    f = s - 2 c . (x - g) - d with s = (x - g)^T s2 (x - g), s2 = identity - (1 + slope^2) axis axis^T, g the centroid.
    """
    axis, g, c, sx, sq = np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty(10)
    spread, s2 = np.empty((3, 3)), np.empty((3, 3))
    varying, lean = _cone_axis(m, axis)
    if abs(lean) > STEEPEST or abs(lean) < SHALLOWEST:
        return NO_FIT
    _about_centroid(m, g, spread)
    slope2 = lean * lean / (1 - lean * lean)
    for a in range(3):
        for b in range(3):
            s2[a, b] = (1.0 if a == b else 0.0) - (1 + slope2) * axis[a] * axis[b]
    ss, scale = _leaning(m, s2, g, sq), spread[0, 0] + spread[1, 1] + spread[2, 2]
    for a in range(3):
        sx[a] = sq[1 + a] - g[a] * sq[0]
        c[a] = sx[a] / (2 * scale)
    if scale <= 0 or not solve3(spread / scale, c):
        return NO_FIT
    error = ss - sq[0] * sq[0] / m[0] - 4 * np.dot(c, sx) + 4 * np.dot(c, spread @ c)
    steep2, radial = _slope_of(m, s2, spread, g, c)
    if steep2 <= 0:
        return NO_FIT
    out[1] = (1.0 if radial >= 0 else -1.0) / np.sqrt(steep2)
    out[2:5] = axis
    # |grad f| grows with the distance h from the apex; what it varies by on a true cone is no error of the normals
    var, apex = np.dot(axis, spread @ axis) / m[0], np.dot(c, axis) / slope2
    if apex * apex < APEX * var:
        return NO_FIT  # two nappes
    # f at the apex, 0 on a true cone; what is left is a hyperboloid
    tip = apex * apex * slope2 * (1 + slope2) - sq[0] / m[0] - np.dot(c, c)
    mean2 = slope2 * (1 + slope2) * (apex * apex + var)  # of |grad f| on a true cone
    astray = max(1 - radial * radial / (m[AREA] * m[AREA] * steep2) - var / (apex * apex + var), 0.0) + abs(mean2 / steep2 - 1)
    return (max(error, 0.0) + m[0] * tip * tip) / (4 * steep2) + weight * weight * (m[AREA] * astray + varying)


@kernel
def fit_any(m, weight, freeform, out):  # pragma: no cover - compiled
    """Cost of the best of all primitives (`freeform`: a general quadric too).

    `out` as for `fit`, with the kinds CONE and QUADRIC (its curvature stays 0).
    """
    best = fit(m, weight, out)
    other = np.empty(5)
    cost = fit_cone(m, weight, other)
    if cost < best:
        best = cost
        out[0], out[1] = CONE, other[1]
        out[2], out[3], out[4] = other[2], other[3], other[4]
    if freeform and best > 0:
        q = np.empty(10)
        cost = FREEDOM * fit_quadric(m, weight, q)
        if cost < best:
            best = cost
            out[0], out[1], out[2], out[3], out[4] = QUADRIC, 0.0, 0.0, 0.0, 0.0
    return best


@kernel
def misfit(sums, q, weight):  # pragma: no cover - compiled
    """int f^2 + weight^2 int |grad f - n|^2 of each row of sums (F, 54) for a given quadric q."""
    square, result = weight * weight, np.empty(len(sums))
    for r in range(len(sums)):
        m, total = sums[r], square * sums[r, AREA]
        for i in range(10):
            for j in range(10):
                total += q[i] * q[j] * m[PRODUCT[i, j]]
        for t in range(len(_TERM_BY)):
            i, j = _TERM_AT[t, 0], _TERM_AT[t, 1]
            total += (1.0 if i == j else 2.0) * square * _TERM_BY[t] * m[_TERM_AT[t, 2]] * q[i] * q[j]
        for t in range(len(_SLOPE_BY)):
            total -= 2 * square * _SLOPE_BY[t] * m[_SLOPE_AT[t, 1]] * q[_SLOPE_AT[t, 0]]
        result[r] = max(total, 0.0)
    return result
