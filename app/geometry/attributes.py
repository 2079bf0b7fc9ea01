"""What each region is like: area, normal, curvature, kind, height, plan view."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.geometry.compiled import kernel
from app.geometry.fitting import AREA, CYLINDER, KINDS, NORMAL2, NORMAL2_AT, NORMAL_CENTRE, NORMAL_WEIGHT, SPHERE, fit, sums_about
from app.geometry.main_faces import is_flat
from app.geometry.quadrics import CONE, fit_cone, fit_quadric
from app.geometry.tool import Array, Mesh

Shape = tuple[float, str]  # signed dominant curvature, 1/m, and kind

# RMS cost of a primitive / size of the region above which it is called something else: facets of true primitives stay under
# 2e-4, a doubly curved patch (Hood's crown, radii 0.20 m and 0.53 m) reaches 3.5e-3, a plane with its fillet 8e-3
PRIMITIVE_ERROR = 0.002
BETTER = 0.25  # share of the cost of plane, sphere and cylinder below which a cone explains what one of them explains too
FLAT_TURN = np.radians(3)  # a region whose primitive bends less than this over its size counts as a plane
NO_TURN = 1e-6  # rad; a free-form region that turns less on average (both ways alike) has no curvature, whatever the rounding


@dataclass(frozen=True)
class Attributes:
    """Per region, in the order of the labels."""

    area: Array  # (n,) m^2
    projected: Array  # (n,) m^2 seen from above
    centroid: Array  # (n, 3) m
    normal: Array  # (n, 3) unit, area mean
    curvature: Array  # (n,) signed dominant principal curvature, 1/m, + convex
    kind: tuple[str, ...]  # "plane" | "cylinder" | "cone" | "sphere" | "curved" (one general quadric) | "freeform"
    low: Array  # (n, 3) lower corner of the box, m
    high: Array  # (n, 3) upper corner of the box, m


def find_attributes(mesh: Mesh, labels: NDArray[np.int32], shapes: Sequence[Shape | None] | None = None) -> Attributes:
    """Measure every region; curvature and kind are fitted where `shapes` doesn't know them."""
    n = int(labels.max()) + 1
    total = _totals(mesh.vertices, mesh.faces, labels, n)
    area, projected, centroid, normal = total[:, 0], total[:, 1], total[:, 2:5] / total[:, :1], total[:, 5:]
    size = np.linalg.norm(normal, axis=1)
    # a region that closes on itself (a ring wall) has no mean normal; call it upright
    normal = np.where((size > 1e-6 * area)[:, None], normal / np.maximum(size, 1e-300)[:, None], [0.0, 0.0, 1.0])
    low, high = region_boxes(mesh.vertices, mesh.faces, labels, n)
    known, order = shapes or [None] * n, np.argsort(labels, kind="stable")
    ends = np.searchsorted(labels[order], np.arange(n + 1))
    bends = [known[a] or _shape(mesh, order[ends[a] : ends[a + 1]], low[a], high[a]) for a in range(n)]
    curvature, kind = np.array([b for b, _ in bends]), tuple(k for _, k in bends)
    return Attributes(area, projected, centroid, normal, curvature, kind, low, high)


@kernel
def _totals(vertices, faces, labels, n):  # pragma: no cover - compiled
    """Per region (n, 8): area, area seen from above, area times centre, area times unit normal."""
    total = np.zeros((n, 8))
    for f in range(len(faces)):
        if labels[f] < 0:
            continue
        a, b, c = vertices[faces[f, 0]], vertices[faces[f, 1]], vertices[faces[f, 2]]
        x, y, z = b[0] - a[0], b[1] - a[1], b[2] - a[2]
        u, v, w = c[0] - a[0], c[1] - a[1], c[2] - a[2]
        i, j, k = (y * w - z * v) / 2, (z * u - x * w) / 2, (x * v - y * u) / 2
        area = np.sqrt(i * i + j * j + k * k)
        row = total[labels[f]]
        row[0] += area
        row[1] += abs(k)
        for d in range(3):
            row[2 + d] += area * ((a[d] + b[d] + c[d]) / 3)
        row[5] += i
        row[6] += j
        row[7] += k
    return total


@kernel
def region_boxes(vertices, faces, labels, n):  # pragma: no cover - compiled
    """Lower and upper corner (n, 3) of the box of each region; faces with label -1 belong to none."""
    low, high = np.full((n, 3), np.inf), np.full((n, 3), -np.inf)
    for f in range(len(faces)):
        region = labels[f]
        if region < 0:
            continue
        for k in range(3):
            for c in range(3):
                at = vertices[faces[f, k], c]
                if at < low[region, c]:
                    low[region, c] = at
                if at > high[region, c]:
                    high[region, c] = at
    return low, high


def nearest_middles(mesh: Mesh, labels: NDArray[np.int32], points: Array) -> Array:
    """Of each region the middle of the face that is nearest to its point (n, 3)."""
    return _nearest_middles(mesh.vertices, mesh.faces, labels, points)


@kernel
def _nearest_middles(vertices, faces, labels, wanted):  # pragma: no cover - compiled
    points, nearest = np.zeros_like(wanted), np.full(len(wanted), np.inf)
    for f in range(len(faces)):
        region = labels[f]
        if region < 0:
            continue
        distance = 0.0
        for c in range(3):
            middle = (vertices[faces[f, 0], c] + vertices[faces[f, 1], c] + vertices[faces[f, 2], c]) / 3
            distance += (middle - wanted[region, c]) ** 2
        if distance < nearest[region]:
            nearest[region] = distance
            points[region] = (vertices[faces[f, 0]] + vertices[faces[f, 1]] + vertices[faces[f, 2]]) / 3
    return points


def region_shape(mesh: Mesh, faces: NDArray[np.int64]) -> Shape:
    """Signed dominant curvature (1/m) and kind of one region.

    Paper: curvature comes from the fitted primitive, 1/r (of a cone: at its mean square distance to the axis); where none fits,
    from how the normals turn over the region. A flat face stays one with its holes and fillets.
    """
    low, high = region_boxes(mesh.vertices, mesh.faces[faces], np.zeros(len(faces), np.int32), 1)
    return _shape(mesh, faces, low[0], high[0])


def _shape(mesh: Mesh, faces: NDArray[np.int64], low: Array, high: Array) -> Shape:
    """The same where the corners of the region's box are known."""
    chosen = mesh.faces[faces]
    scale = float(np.linalg.norm(high - low))
    sums = sums_about(mesh.vertices, chosen, (low + high) / 2, scale)
    kind, curvature = _primitive(sums)
    if kind != "plane" and is_flat(mesh, faces):
        return 0.0, "plane"
    if kind in ("plane", "cylinder", "cone", "sphere"):
        return curvature / scale, kind
    bend = turning_curvature(mesh.vertices[chosen])
    return (bend if abs(bend) * scale > NO_TURN else 0.0), kind


def _primitive(sums: Array) -> tuple[str, float]:
    """Kind and signed curvature (in the sums' own unit; 0 for quadrics) of what describes them, the simplest first."""
    out, other = np.empty(5), np.empty(5)
    allowed = PRIMITIVE_ERROR**2 * sums[AREA]
    cost, cone = float(fit(sums, NORMAL_WEIGHT, out)), float(fit_cone(sums, NORMAL_WEIGHT, other))
    if cone <= allowed and cone < BETTER * cost:
        out[0], out[1] = CONE, other[1]
    elif cost > allowed:
        return ("curved" if fit_quadric(sums, NORMAL_WEIGHT, np.empty(10)) <= allowed else "freeform"), 0.0
    kind = int(out[0])
    if kind == SPHERE and _straight_one_way(sums):
        kind = CYLINDER
    if kind in (SPHERE, CYLINDER, CONE) and abs(out[1]) < FLAT_TURN:
        return "plane", 0.0
    return KINDS[kind], float(out[1])


def _straight_one_way(sums: Array) -> bool:
    """Whether normals turn so little in one direction that a sphere is as good as a cylinder: the narrow wall around a plate."""
    turn = np.linalg.eigvalsh(sums[NORMAL2:NORMAL_CENTRE][NORMAL2_AT])[0] / sums[AREA]
    return bool(turn < FLAT_TURN**2 / 12)


def turning_curvature(corners: Array) -> float:
    """Larger principal curvature (by size) of the shape operator that best explains how face normals turn.

    Least squares of n(x) = n0 + S (x - x0) in the tangent plane, S symmetric; works on long thin triangles.
    """
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    twice = np.linalg.norm(cross, axis=1)
    mean = cross.sum(axis=0)
    if np.linalg.norm(mean) < 1e-6 * twice.sum():
        return 0.0
    mean /= np.linalg.norm(mean)
    axis = np.eye(3)[np.argmin(np.abs(mean))]
    u = np.cross(mean, axis) / np.linalg.norm(np.cross(mean, axis))
    frame = np.stack([u, np.cross(mean, u)])
    weight = twice / twice.sum()
    place, turn = corners.mean(axis=1) @ frame.T, (cross / twice[:, None]) @ frame.T
    place, turn = place - weight @ place, turn - weight @ turn
    x, y = place.T
    zero = np.zeros_like(x)
    rows = np.concatenate([np.stack([x, y, zero], axis=1), np.stack([zero, x, y], axis=1)])
    both = np.sqrt(np.concatenate([weight, weight]))
    (xx, xy, yy), *_ = np.linalg.lstsq(rows * both[:, None], np.concatenate([turn[:, 0], turn[:, 1]]) * both, rcond=1e-9)
    principal = np.linalg.eigvalsh(np.array([[xx, xy], [xy, yy]]))
    return float(principal[np.argmax(np.abs(principal))])
