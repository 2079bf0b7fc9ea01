"""A picture of a segmented part: one colour per region, grey outside the working surface, drawn by rays."""

import colorsys
import struct
import zlib

import numpy as np
import trimesh
from numpy.typing import NDArray

from app.geometry.tool import Mesh

PARTS = (
    ("base_interface_AP214.STEP", "m", "+z"),
    ("featuretype.STEP", "m", "+z"),
    ("1002_tray_bottom.STL", "mm", "+y"),
    ("naca0012.stl", "m", "+z"),
    ("cycloidal.ply", "mm", "+z"),
    ("testplate.glb", "m", "+y"),
)
WIDTH, HEIGHT = 720, 540
VIEW = np.array([0.45, -0.75, 0.75])  # from the part towards the eye


def draw(mesh: Mesh, labels: NDArray[np.int32]) -> bytes:
    """A PNG of the part seen from the front right above, borders in black."""
    eye = VIEW / np.linalg.norm(VIEW)
    right = np.cross([0, 0, 1], eye)
    right /= np.linalg.norm(right)
    up = np.cross(eye, right)
    solid = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    flat = mesh.vertices @ np.stack([right, up]).T
    middle, size = (flat.min(axis=0) + flat.max(axis=0)) / 2, np.ptp(flat, axis=0)
    step = 1.08 * max(size[0] / WIDTH, size[1] / HEIGHT)
    x, y = np.meshgrid((np.arange(WIDTH) - WIDTH / 2) * step + middle[0], (HEIGHT / 2 - np.arange(HEIGHT)) * step + middle[1])
    far = 2 * np.linalg.norm(solid.extents) + (mesh.vertices @ eye).max()
    origins = x.ravel()[:, None] * right + y.ravel()[:, None] * up + far * eye
    face = solid.ray.intersects_first(origins, np.tile(-eye, (len(origins), 1))).reshape(HEIGHT, WIDTH)
    n = int(labels.max()) + 1
    palette = np.array([colorsys.hsv_to_rgb((0.61803 * k) % 1, 0.55, 0.95) for k in range(n)] + [(0.62, 0.62, 0.62)])
    lamp = eye + np.array([0, 0, 0.4])
    light = 0.45 + 0.55 * np.clip(solid.face_normals @ lamp / np.linalg.norm(lamp), 0, 1)
    label = np.where(face >= 0, labels[face], -2)
    image = np.where((face >= 0)[..., None], palette[label] * light[face][..., None], 1.0)
    edge = np.zeros(face.shape, bool)
    edge[:, 1:] |= label[:, 1:] != label[:, :-1]
    edge[1:] |= label[1:] != label[:-1]
    image[edge] = 0.1
    return _png((255 * image).astype(np.uint8))


def _png(image: NDArray[np.uint8]) -> bytes:
    height, width, _ = image.shape

    def chunk(kind: bytes, content: bytes) -> bytes:
        return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))

    rows = np.concatenate([np.zeros((height, 1), np.uint8), image.reshape(height, -1)], axis=1)
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows.tobytes(), 6)) + chunk(b"IEND", b"")
