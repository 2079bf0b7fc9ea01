"""Which triangles a tool from above can reach: rays in nine directions within 40 degrees of up."""

import numpy as np
import trimesh
from numpy.typing import NDArray

from app.geometry.tool import Array, Mesh

TILT = np.radians(40)  # of the eight directions around straight up
GRAZING = 0.05  # cosine below which a ray only slides along the triangle


def directions() -> Array:
    """Straight up and eight directions around it (9, 3)."""
    turn = np.arange(8) * np.pi / 4
    ring = np.stack([np.sin(TILT) * np.cos(turn), np.sin(TILT) * np.sin(turn), np.full(8, np.cos(TILT))], axis=1)
    return np.concatenate([[[0.0, 0.0, 1.0]], ring])


def reachable(mesh: Mesh) -> NDArray[np.bool_]:
    """Faces (F,) whose centre sees the sky in at least one of the directions."""
    solid = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    normals, centres = solid.face_normals, solid.triangles_center
    lift = 1e-4 * float(np.linalg.norm(solid.extents))
    seen = np.zeros(len(mesh.faces), bool)
    for direction in directions():
        candidates = np.flatnonzero((normals @ direction > GRAZING) & ~seen)
        if len(candidates) == 0:
            continue
        origins = centres[candidates] + lift * normals[candidates]
        hit = solid.ray.intersects_any(origins, np.tile(direction, (len(candidates), 1)))
        seen[candidates[~hit]] = True
    return seen
