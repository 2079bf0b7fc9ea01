"""Coordinates along which a grid is laid over regions: straight ones, and the angle around the axis of a cylinder or cone."""

from dataclasses import dataclass, replace

import numpy as np

from app.geometry.fitting import AREA, CYLINDER, NORMAL_WEIGHT, sums_about
from app.geometry.quadrics import CONE, fit_any
from app.geometry.splitting import Integers, Surface, cut_by_plane
from app.geometry.tool import Array

ROUND = 0.002  # RMS cost / size of the regions up to which they are one cylinder or cone
LEAST_TURN = np.radians(20)  # flatter ones are cut straight
GAP = np.radians(20)  # a wider opening makes a ring an open one


@dataclass(frozen=True)
class Straight:
    """Distance along a direction."""

    direction: Array  # (3,) unit
    unit: float = 1.0  # metres per step of the coordinate
    closed: bool = False

    def at(self, points: Array) -> Array:
        """Coordinate of points (K, 3)."""
        return points @ self.direction

    def corners(self, vertices: Array, faces: Integers) -> Array:
        """Coordinates of the corners of faces (F, 3)."""
        return self.at(vertices)[faces]

    def cut(self, surface: Surface, region: int, place: float) -> Surface:
        """Cut a region where the coordinate has a value."""
        return cut_by_plane(surface, region, self.direction, place)


@dataclass(frozen=True)
class Turning:
    """Angle around an axis, -pi to pi, 0 in the middle of the regions."""

    point: Array  # (3,) on the axis
    radial: Array  # (3,) unit, from the axis to where the angle is 0
    tangent: Array  # (3,) unit, where it grows to from there
    unit: float  # mean distance from the axis
    closed: bool  # whether the regions go all around

    def towards(self, sign: float) -> "Turning":
        """The same angle, counted the other way where `sign` is -1."""
        return replace(self, tangent=sign * self.tangent)

    def at(self, points: Array) -> Array:
        """Angle of points (K, 3)."""
        away = points - self.point
        return np.arctan2(away @ self.tangent, away @ self.radial)

    def corners(self, vertices: Array, faces: Integers) -> Array:
        """Angles of the corners of faces (F, 3), those of one face within half a turn of each other."""
        middle = self.at(vertices[faces].mean(axis=1))[:, None]
        away = self.at(vertices)[faces] - middle
        return middle + (away + np.pi) % (2 * np.pi) - np.pi

    def cut(self, surface: Surface, region: int, place: float) -> Surface:
        """Cut a region by the half plane that ends at the axis."""
        out = np.cos(place) * self.radial + np.sin(place) * self.tangent
        normal = np.cos(place) * self.tangent - np.sin(place) * self.radial
        return cut_by_plane(surface, region, normal, float(normal @ self.point), (surface.vertices - self.point) @ out > 0)


Way = Straight | Turning


def round_ways(vertices: Array, faces: Integers) -> tuple[Turning, Straight] | None:
    """Around and along the axis of the cylinder or cone that the faces lie on; None when they are none, or nearly flat."""
    corners = vertices[faces]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    out = np.empty(5)
    sums = sums_about(vertices, faces, (low + high) / 2, float(np.linalg.norm(high - low)))
    cost = fit_any(sums, NORMAL_WEIGHT, False, out)
    if int(out[0]) not in (CYLINDER, CONE) or cost > ROUND**2 * sums[AREA]:
        return None
    axis, centres = out[2:].copy(), corners.mean(axis=1)
    point = _on_axis(centres, cross, axis)
    away = centres - point
    away -= np.outer(away @ axis, axis)
    radius = np.linalg.norm(away, axis=1)
    u = away[0] / radius[0]
    v = np.cross(axis, u)
    angle = np.sort(np.arctan2(away @ v, away @ u))
    gaps = np.diff(np.concatenate([angle, [angle[0] + 2 * np.pi]]))
    widest = int(np.argmax(gaps))
    opposite = angle[widest] + gaps[widest] / 2 + np.pi
    if 2 * np.pi - gaps[widest] < LEAST_TURN:
        return None
    radial, tangent = np.cos(opposite) * u + np.sin(opposite) * v, np.cos(opposite) * v - np.sin(opposite) * u
    unit = float(np.average(radius, weights=np.linalg.norm(cross, axis=1)))
    return Turning(point, radial, tangent, unit, bool(gaps[widest] < GAP)), Straight(axis)


def _on_axis(centres: Array, cross: Array, axis: Array) -> Array:
    """The point nearest to all lines along the normals, seen along the axis: there they meet."""
    normal = cross - np.outer(cross @ axis, axis)
    side = np.cross(axis, normal)  # (x - point) . side = 0 for points of a face's line
    here = np.einsum("ij,ij->i", side, centres)
    middle = centres.mean(axis=0)
    rows, values = np.vstack([side, axis * np.abs(side).max()]), np.append(here, (middle @ axis) * np.abs(side).max())
    return np.asarray(np.linalg.lstsq(rows, values, rcond=None)[0], np.float64)
