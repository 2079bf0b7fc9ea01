"""Boxes of regions in plan view along the part's own directions: the same however the part is turned about the vertical."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from app.geometry.attributes import region_boxes
from app.geometry.borders import MANY, outer_points
from app.geometry.tool import Array, Mesh

ALIKE = 1e-6  # relative: rectangles this close in area are equally tight
SAME_WAY = 1e-7  # rad


def plan_boxes(mesh: Mesh, labels: NDArray[np.int32], n: int) -> tuple[Array, Array]:
    """Lower and upper corner (n, 2) of every region's box, m, along the sides of the tightest rectangle around all regions.

    Where several rectangles are equally tight, as around an octagon, the one along which the boxes of the regions are smallest counts.
    Of its quarter turns the one nearest to the mesh's own axes is taken, so a part that lies straight keeps its coordinates.
    """
    used = np.zeros(len(mesh.vertices), bool)
    used[mesh.faces[labels >= 0]] = True
    found = [_boxes(mesh, labels, n, angle) for angle in _tightest(mesh.vertices[used, :2])]
    low, high = min(found, key=lambda box: float(np.prod(box[1] - box[0], axis=1).sum()))
    return low, high


def _boxes(mesh: Mesh, labels: NDArray[np.int32], n: int, angle: float) -> tuple[Array, Array]:
    cos, sin = np.cos(angle), np.sin(angle)
    turned = mesh.vertices @ np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
    low, high = region_boxes(turned if angle else mesh.vertices, mesh.faces, labels, n)
    return low[:, :2], high[:, :2]


def _tightest(points: Array) -> Array:
    """Angles of the sides of the tightest rectangles around points (P, 2), between -45 and 45 degrees; 0 where they lie on a line."""
    points = outer_points(np.ascontiguousarray(points)) if len(points) > MANY else points
    try:
        hull = points[ConvexHull(points).vertices]
    except QhullError:
        return np.zeros(1)
    edge = np.roll(hull, -1, axis=0) - hull
    angle = np.sort((np.arctan2(edge[:, 1], edge[:, 0]) + np.pi / 4) % (np.pi / 2) - np.pi / 4)
    angle = np.where(np.abs(angle) < SAME_WAY, 0.0, angle)
    angle = angle[np.r_[True, np.diff(angle) > SAME_WAY]]
    u = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    area = np.ptp(u @ hull.T, axis=1) * np.ptp(np.stack([-u[:, 1], u[:, 0]], axis=1) @ hull.T, axis=1)
    return angle[area <= (1 + ALIKE) * area.min()]
