"""What lies under the pointer: rays into the part, and the regions inside a box drawn on the canvas."""

import numpy as np
from numpy.typing import NDArray

from app.geometry.cleaning import areas
from app.geometry.tool import Array, Mesh, Tool
from app.viewer.projection import Camera, project

MOST_OF = 0.5  # share of what is seen of a region that has to be inside a box
PROBES = 12  # faces per region that are looked at for being hidden behind others


def first_hit(mesh: Mesh, origin: Array, direction: Array, among: NDArray[np.bool_] | None = None) -> tuple[int, Array] | None:
    """The first face a ray meets and where, from either side; None when it meets nothing (Moeller and Trumbore 1997)."""
    chosen = np.arange(len(mesh.faces)) if among is None else np.flatnonzero(among)
    a, b, c = (mesh.vertices[mesh.faces[chosen, k]] for k in range(3))
    one, two = b - a, c - a
    across = np.cross(direction, two)
    size = np.einsum("fi,fi->f", one, across)
    usable = np.abs(size) > 1e-18
    scale = np.where(usable, 1 / np.where(usable, size, 1), 0)
    to = origin - a
    u = np.einsum("fi,fi->f", to, across) * scale
    turned = np.cross(to, one)
    v = turned @ direction * scale
    depth = np.einsum("fi,fi->f", two, turned) * scale
    met = usable & (u >= -1e-9) & (v >= -1e-9) & (u + v <= 1 + 1e-9) & (depth > 0)
    if not met.any():
        return None
    nearest = int(np.argmin(np.where(met, depth, np.inf)))
    return int(chosen[nearest]), origin + depth[nearest] * direction


def ray_through(camera: Camera, x: float, y: float, aspect: float) -> tuple[Array, Array]:
    """Origin and unit direction of the ray through a place of the canvas (0 to 1, y down); aspect is width / height."""
    forward = (camera.look_at - camera.position) / camera.distance
    right = np.cross(forward, camera.up)
    right /= np.linalg.norm(right)
    above = np.cross(right, forward)
    half = np.tan(camera.fov / 2)
    direction = forward + (2 * x - 1) * half * aspect * right + (1 - 2 * y) * half * above
    return camera.position, direction / np.linalg.norm(direction)


def regions_in_box(tool: Tool, camera: Camera, aspect: float, low: tuple[float, float], high: tuple[float, float]) -> list[int]:
    """Regions of which most of what is seen lies inside a box on the canvas (0 to 1, y down)."""
    corners = tool.mesh.vertices[tool.mesh.faces]
    middles = corners.mean(axis=1)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    towards = np.einsum("fi,fi->f", normals, camera.position - middles) > 0
    pixels = project(middles, camera, aspect, 1.0) / [aspect, 1.0]
    inside = ((pixels >= low) & (pixels <= high)).all(axis=1)
    area = areas(tool.mesh.vertices, tool.mesh.faces.astype(np.int64))
    found: list[int] = []
    for region in range(tool.n):
        seen = (tool.labels == region) & towards
        if area[seen & inside].sum() > MOST_OF * area[seen].sum() and not _behind(tool, camera, np.flatnonzero(seen & inside), middles):
            found.append(region)
    return found


def _behind(tool: Tool, camera: Camera, faces: NDArray[np.int64], middles: Array) -> bool:
    """Whether most of these faces are hidden by others."""
    chosen = faces[np.linspace(0, len(faces) - 1, min(PROBES, len(faces))).astype(int)]
    hidden = 0
    for face in chosen:
        way = middles[face] - camera.position
        hit = first_hit(tool.mesh, camera.position, way / np.linalg.norm(way))
        hidden += hit is not None and hit[0] != face and np.linalg.norm(hit[1] - camera.position) < 0.999 * np.linalg.norm(way)
    return bool(hidden > len(chosen) / 2)
