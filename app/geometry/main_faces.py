"""Which way a region looks where it meets another: its flat main face, the cylinder, cone or sphere it is, else its triangles."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.geometry.compiled import kernel
from app.geometry.round_shapes import ROUND, Round, fit_round
from app.geometry.tool import Array, Mesh, Tool

NEAR_FLAT = np.radians(10)  # triangles within this of the median normal belong to the flat face
LEVEL = np.radians(0.4)  # the same for what is called a plane whatever else belongs to it
EXACTLY = np.radians(1)  # the same for what looks round as a whole: a large flat face with its fillet is nearly a large cylinder
MOSTLY = 0.6  # share of the area from which a region with something bent at its edge counts as a flat face
FEW, SURELY = 500, 0.4  # triangles looked at first, and the share of them below which the region isn't mostly flat
ROUNDS, SETTLED, ROUGHLY = 60, 1e-10, 1e-4  # the last for the triangles looked at first


@dataclass(frozen=True)
class MainFaces:
    """Normals of regions at their borders."""

    triangle: Array  # (F, 3) unit normals of all triangles
    flat: Array  # (n, 3) unit normal of the flat main face, nan where there is none
    round: tuple[Round | None, ...]  # the cylinder, cone or sphere that a region is

    def at(self, region: NDArray[np.int64], face: NDArray[np.int64], points: Array) -> Array:
        """Unit normals (K, 3) of regions at points on their triangles."""
        normals = np.where(np.isnan(self.flat[region]), self.triangle[face], self.flat[region])
        for k, shape in enumerate(self.round):
            mine = region == k
            if shape is not None and mine.any():
                normals[mine] = shape.normals(points[mine])
        return normals


def find_main_faces(tool: Tool) -> MainFaces:
    """The main faces of all regions of a tool on a mesh."""
    cross = _crosses(tool.mesh)
    twice = np.linalg.norm(cross, axis=1)
    unit = cross / np.maximum(twice, 1e-300)[:, None]
    flat, shapes = np.full((tool.n, 3), np.nan), []
    order = np.argsort(tool.labels, kind="stable")
    ends = np.searchsorted(tool.labels[order], np.arange(tool.n + 1))
    for a, region in enumerate(tool.regions):
        mine = order[ends[a] : ends[a + 1]]
        main = flat_face(region.kind, unit[mine], twice[mine])
        if main is not None:
            flat[a] = main
        fitted = main is None and region.kind in ROUND
        shapes.append(fit_round(region.kind, tool.mesh, tool.mesh.faces[mine]) if fitted else None)
    return MainFaces(unit, flat, tuple(shapes))


def facing(mesh: Mesh, labels: NDArray[np.int32], kinds: Sequence[str], mean: Array) -> Array:
    """Which way each region looks (n, 3): the normal of its flat main face, else its mean normal (n, 3).

    A fillet that belongs to one of two faces turns the mean normal by up to half the angle between them, the main face not at all.
    """
    result, order = mean.copy(), np.argsort(labels, kind="stable")
    ends = np.searchsorted(labels[order], np.arange(len(kinds) + 1))
    for a, kind in enumerate(kinds):
        main = _mostly(_some_of(mesh, order[ends[a] : ends[a + 1]]), _within(kind))
        result[a] = mean[a] if main is None else main
    return result


def is_flat(mesh: Mesh, faces: NDArray[np.int64]) -> bool:
    """Whether most of a region, given by its faces, is exactly level with itself."""
    return _mostly(_some_of(mesh, faces), LEVEL) is not None


def flat_face(kind: str, normals: Array, weight: Array) -> Array | None:
    """Unit normal of the flat face that most of a region of a kind is; None where it bends all over.

    It is the geometric median of the triangles' normals: what is bent at the edge of a flat face doesn't move it.
    """
    return _mostly(lambda few: _every(normals, weight, few) if few else (normals, weight), _within(kind))


def _within(kind: str) -> float:
    return EXACTLY if kind in ROUND else NEAR_FLAT


def _every(normals: Array, weight: Array, few: int) -> tuple[Array, Array]:
    step = -(-len(weight) // few)
    return normals[::step], weight[::step]


def _some_of(mesh: Mesh, faces: NDArray[np.int64]) -> Callable[[int], tuple[Array, Array]]:
    """Tells normals and weights of about so many of the faces, of all for 0."""
    return lambda few: _normals_of(mesh.vertices, mesh.faces, faces[:: -(-len(faces) // few)] if few else faces)


@kernel
def _normals_of(vertices, faces, chosen):  # pragma: no cover - compiled
    """Unit normals and areas, twice, of chosen faces."""
    normals, twice = np.zeros((len(chosen), 3)), np.empty(len(chosen))
    for i in range(len(chosen)):
        a, b, c = vertices[faces[chosen[i], 0]], vertices[faces[chosen[i], 1]], vertices[faces[chosen[i], 2]]
        x, y, z = b[0] - a[0], b[1] - a[1], b[2] - a[2]
        u, v, w = c[0] - a[0], c[1] - a[1], c[2] - a[2]
        p, q, r = y * w - z * v, z * u - x * w, x * v - y * u
        twice[i] = np.sqrt(p * p + q * q + r * r)
        size = max(twice[i], 1e-300)
        normals[i, 0], normals[i, 1], normals[i, 2] = p / size, q / size, r / size
    return normals, twice


def _mostly(told: Callable[[int], tuple[Array, Array]], within: float) -> Array | None:
    """Median of the normals where most of them are within an angle of it; a few are looked at first, as most regions bend.

    Args:
        told: Normals and weights of about so many triangles, of all for 0.
        within: The angle, rad.
    """
    limit = np.cos(within)
    normals, weight = told(FEW)  # enough to see that a region bends
    few = _median(normals, weight, ROUGHLY)
    if few is None or weight[normals @ few > limit].sum() < SURELY * weight.sum():
        return None
    normals, weight = told(0)
    median = _median(normals, weight)
    return None if median is None or weight[normals @ median > limit].sum() < MOSTLY * weight.sum() else median


def _median(normals: Array, weight: Array, settled: float = SETTLED) -> Array | None:
    """Geometric median of unit vectors, itself one; None where they look all ways alike."""
    median = weight @ normals
    if np.linalg.norm(median) <= 1e-6 * weight.sum():
        return None
    return _settled(np.ascontiguousarray(normals), np.ascontiguousarray(weight), median / np.linalg.norm(median), settled)


@kernel
def _settled(normals, weight, median, enough):  # pragma: no cover - compiled
    """Weiszfeld's iteration on the unit sphere, until a step moves less than enough."""
    for _ in range(ROUNDS):
        step = np.zeros(3)
        for i in range(len(normals)):
            x, y, z = normals[i, 0] - median[0], normals[i, 1] - median[1], normals[i, 2] - median[2]
            pull = weight[i] / max(np.sqrt(x * x + y * y + z * z), 1e-9)
            for c in range(3):
                step[c] += pull * normals[i, c]
        step /= np.sqrt(np.sum(step * step))
        moved = np.sqrt(np.sum((step - median) ** 2))
        median = step
        if moved < enough:
            break
    return median


def _crosses(mesh: Mesh) -> Array:
    """Normals (F, 3) of the triangles, twice their area long."""
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    return np.cross(b - a, c - a)
