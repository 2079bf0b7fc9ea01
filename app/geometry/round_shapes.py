"""Cylinders, cones and spheres through the corners of a region: exact normals at any point, and the sheet they unroll to."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.geometry.borders import tangent_frame
from app.geometry.cleaning import diagonal
from app.geometry.tool import Array, Mesh

ROUND = ("cylinder", "cone", "sphere")
OPEN = 1e-6  # rad; a smaller gap around the axis is rounding: the region closes on itself
LARGEST = 1e4  # radius over the region's size beyond which it is flat


@dataclass(frozen=True)
class Round:
    """A cylinder, cone or sphere."""

    kind: str  # one of ROUND
    point: Array  # (3,) on the axis at height 0; the centre of a sphere
    axis: Array  # (3,) unit; any for a sphere
    slope: float  # change of the radius per height along the axis; 0 for cylinders
    radius: float  # at height 0, m
    outward: float  # +1 where the surface looks away from the axis or centre, else -1

    def normals(self, points: Array) -> Array:
        """Unit surface normals (P, 3) at points on or near it."""
        away = points - self.point
        if self.kind != "sphere":
            away = away - (away @ self.axis)[:, None] * self.axis
        away = away / np.maximum(_sizes(away), 1e-300)[:, None]
        return self.outward * (away - self.slope * self.axis) / np.hypot(1.0, self.slope)


def _sizes(vectors: Array) -> Array:
    """Length of each row; several times as quick as numpy's norm over so short an axis."""
    return np.sqrt(np.einsum("ij,ij->i", vectors, vectors))


def used_vertices(mesh: Mesh, faces: NDArray[np.int32]) -> NDArray[np.int64]:
    """Vertices of some faces, each once."""
    used = np.zeros(len(mesh.vertices), bool)
    used[faces.ravel()] = True
    return np.flatnonzero(used)


def fit_round(kind: str, mesh: Mesh, faces: NDArray[np.int32]) -> Round | None:
    """The shape of a kind (one of ROUND) through the corners of some faces (F, 3); None where they don't determine one."""
    points, corners = mesh.vertices[used_vertices(mesh, faces)], mesh.vertices[faces]
    middle = points.mean(axis=0)
    x = points - middle
    size = diagonal(x)
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    twice = _sizes(cross)
    if kind == "sphere":
        axis, centre = np.array([0.0, 0.0, 1.0]), _centre(x)
        slope, radius = 0.0, float(_sizes(x - centre).mean())
    else:
        axis = _axis(kind, cross / np.maximum(twice, 1e-300)[:, None], twice)
        frame, height = tangent_frame(axis), x @ axis
        flat = x @ frame.T
        round_flat = _centre(flat, *([height, height**2] if kind == "cone" else []))
        distance = _sizes(flat - round_flat)
        slope, radius = (float(v) for v in np.polyfit(height, distance, 1)) if kind == "cone" else (0.0, float(distance.mean()))
        centre = round_flat @ frame
    if not 0 < radius < LARGEST * size:
        return None
    shape = Round(kind, middle + centre, axis, slope, radius, 1.0)
    looks = float(np.vdot(shape.normals((corners[:, 0] + corners[:, 1] + corners[:, 2]) / 3), cross))
    return Round(kind, middle + centre, axis, slope, radius, 1.0 if looks >= 0 else -1.0)


def _axis(kind: str, normals: Array, weight: Array) -> Array:
    """Normals of a cylinder are square to its axis, those of a cone all lean alike: the direction in which they vary least."""
    away = normals - (0.0 if kind == "cylinder" else weight @ normals / weight.sum())
    return np.linalg.eigh(away.T @ (away * weight[:, None]))[1][:, 0]


def _centre(x: Array, *extra: Array) -> Array:
    """Centre c of the circle or sphere through points: |x|^2 = 2 c . x + extra . unknowns + constant, by least squares."""
    rows = np.column_stack([2 * x, *extra, np.ones(len(x))])
    size = np.maximum(np.abs(rows).max(axis=0), 1e-300)
    return (np.linalg.lstsq(rows / size, (x**2).sum(axis=1), rcond=1e-12)[0] / size)[: x.shape[1]]


def unroll(shape: Round, corners: Array) -> tuple[Array, Array]:
    """Corners (F, 3, 3) on a cylinder or cone in its flat sheet (3 F, 2), m, and the sheet's two directions at its middle (2, 3).

    Along the first is the arc (of a cone: at the middle of its height), along the second the way up the surface. A ring is cut
    open where it has a gap, else anywhere.
    """
    frame = tangent_frame(shape.axis)
    x = corners - shape.point
    height, flat = x @ shape.axis, x @ frame.T
    distance = np.hypot(flat[..., 0], flat[..., 1])
    angle = np.arctan2(flat[..., 1], flat[..., 0])
    # the tip of a cone lies at any angle: at that of the next corner
    angle = np.where(distance < 1e-6 * distance.max(), np.roll(angle, -1, axis=1), angle)
    turn = (angle - angle[:, :1] + np.pi) % (2 * np.pi) - np.pi
    first, last = (choose(choose(turn[:, 0], turn[:, 1]), turn[:, 2]) for choose in (np.minimum, np.maximum))
    start = (angle[:, 0] + first) % (2 * np.pi)
    cut, gap = _widest_gap(start, start + last - first)
    place = (start - cut + gap / 2) % (2 * np.pi) - gap / 2
    unrolled = (place - first)[:, None] + turn
    if gap <= OPEN:
        unrolled = np.clip(unrolled, 0, 2 * np.pi)
    middle = (unrolled.min() + unrolled.max()) / 2 + cut
    tangent = np.array([-np.sin(middle), np.cos(middle)]) @ frame
    between = shape.radius + shape.slope * (height.min() + height.max()) / 2
    up = shape.axis + shape.slope * np.array([np.cos(middle), np.sin(middle)]) @ frame
    sheet = np.stack([unrolled * between, height * np.hypot(1.0, shape.slope)], axis=-1)
    return sheet.reshape(-1, 2), np.stack([tangent, up / np.linalg.norm(up)])


def _widest_gap(low: Array, high: Array) -> tuple[float, float]:
    """Where the widest gap between intervals on the circle ends, and its width; 0 where they cover it."""
    order = np.argsort(low)
    start, reached = low[order], np.maximum.accumulate(high[order])
    reached = np.maximum(reached, reached[-1] - 2 * np.pi)
    gap = np.append(start[1:], start[0] + 2 * np.pi) - reached
    best = int(np.argmax(gap))
    return float(start[(best + 1) % len(start)]), max(float(gap[best]), 0.0)
