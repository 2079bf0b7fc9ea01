"""Where the camera stands for a tool, and where on the canvas a point of it appears."""

from dataclasses import dataclass

import numpy as np

from app.geometry.attributes import nearest_middles
from app.geometry.tool import Array, Tool

AZIMUTH, ELEVATION = -0.46, 0.84  # rad; the camera stands to the left in front of the tool and looks down on it
FIELD_OF_VIEW = 0.56  # rad, vertical
FILL_HEIGHT, FILL_WIDTH = 0.80, 0.82  # largest share of the canvas the tool may take
MIDDLE = 0.03  # of the canvas height: how far above its middle the tool stands, because pages have their buttons below
LEAST_ASPECT = 0.95  # width / height of the narrowest canvas the tool still fills like this


@dataclass(frozen=True)
class Camera:
    """A pose in the tool frame, as viser takes it."""

    position: Array  # (3,) metres
    look_at: Array  # (3,) metres
    up: Array  # (3,) unit
    fov: float  # rad, vertical

    @property
    def distance(self) -> float:
        return float(np.linalg.norm(self.look_at - self.position))


def camera_for(tool: Tool, also: Array | None = None) -> Camera:
    """The pose from which the whole tool, and the points `also` (K, 3), fill the view. Depends on nothing else."""
    points = tool.mesh.vertices if also is None else np.concatenate([tool.mesh.vertices, also])
    up, back = np.array([0.0, 0.0, 1.0]), _towards_eye()
    right, above = _axes(-back, up)
    tall, wide = np.tan(FIELD_OF_VIEW / 2), np.tan(FIELD_OF_VIEW / 2) * LEAST_ASPECT
    look_at, distance = (points.min(0) + points.max(0)) / 2, 1.0
    for _ in range(8):  # centre what is seen, then step back until it just fits; each round corrects the other
        offset = points - look_at
        # a point p from the middle appears at (p . above) / (distance - p . back)
        needed = np.maximum(np.abs(offset @ above) / (tall * FILL_HEIGHT), np.abs(offset @ right) / (wide * FILL_WIDTH)) + offset @ back
        distance = max(float(needed.max()), 1e-6)
        depth = distance - offset @ back
        across, upward = offset @ right / depth, offset @ above / depth
        look_at = look_at + distance * ((across.min() + across.max()) / 2 * right + (upward.min() + upward.max()) / 2 * above)
    look_at = look_at - 2 * MIDDLE * tall * distance * above
    return Camera(look_at + back * distance, look_at, up, FIELD_OF_VIEW)


def _towards_eye() -> Array:
    return np.array([np.cos(ELEVATION) * np.sin(AZIMUTH), -np.cos(ELEVATION) * np.cos(AZIMUTH), np.sin(ELEVATION)])


def project(points: Array, camera: Camera, width: float, height: float) -> Array:
    """Pixels (K, 2) of points (K, 3) on a canvas; NaN behind the camera."""
    forward = (camera.look_at - camera.position) / camera.distance
    right, above = _axes(forward, camera.up)
    ray = np.atleast_2d(points) - camera.position
    depth = ray @ forward
    scale = np.where(depth > 0, height / 2 / np.tan(camera.fov / 2) / np.where(depth > 0, depth, 1), np.nan)
    return np.stack([width / 2 + ray @ right * scale, height / 2 - ray @ above * scale], axis=1)


def label_points(tool: Tool) -> Array:
    """A point on the surface of every region (N, 3), in the middle of the face nearest to its centroid."""
    return nearest_middles(tool.mesh, tool.labels, np.array([r.centroid for r in tool.regions]))


def _axes(forward: Array, up: Array) -> tuple[Array, Array]:
    """Unit vectors to the right of and above a view direction."""
    right = np.cross(forward, up)
    right /= np.linalg.norm(right)
    return right, np.cross(right, forward)
