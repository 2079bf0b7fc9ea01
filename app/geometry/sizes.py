"""How long and wide each region is along its surface, and which way it lies."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.geometry.borders import smallest_rectangle, tangent_frame
from app.geometry.main_faces import flat_face
from app.geometry.round_shapes import Round, fit_round, unroll, used_vertices
from app.geometry.tool import Array, Mesh, Tool

SQUARE = 1.02  # length over width below which a region lies no way in particular
UPRIGHT = 0.1  # level part of a direction below which it has none seen from above


@dataclass(frozen=True)
class Size:
    """The smallest rectangle around a region: of cylinders and cones unrolled, of all others as seen along the mean normal."""

    length: float  # m, the longer side
    width: float  # m
    direction: float | None  # rad from x in plan view, 0 to pi: where the longer side points; None for squares and upright ones

    @property
    def aspect(self) -> float:
        """Length over width, at least 1."""
        return self.length / max(self.width, 1e-12)


def region_sizes(tool: Tool) -> tuple[Size, ...]:
    """The size of every region of a tool on a mesh."""
    order = np.argsort(tool.labels, kind="stable")
    ends = np.searchsorted(tool.labels[order], np.arange(tool.n + 1))
    return tuple(
        _size(tool.mesh, tool.mesh.faces[order[ends[a] : ends[a + 1]]], region.kind, region.normal) for a, region in enumerate(tool.regions)
    )


def _size(mesh: Mesh, faces: NDArray[np.int32], kind: str, normal: Array) -> Size:
    shape = _rolled(mesh, faces, kind) if kind in ("cylinder", "cone") else None
    if shape is None:
        frame = tangent_frame(normal)
        flat = mesh.vertices[used_vertices(mesh, faces)] @ frame.T
    else:
        flat, frame = unroll(shape, mesh.vertices[faces])
    axes, sides = smallest_rectangle(flat)
    long = int(sides[1] > sides[0])
    x, y, _ = axes[long] @ frame
    level = sides[long] > SQUARE * sides[1 - long] and np.hypot(x, y) > UPRIGHT
    return Size(float(sides[long]), float(sides[1 - long]), float(np.arctan2(y, x) % np.pi) if level else None)


def _rolled(mesh: Mesh, faces: NDArray[np.int32], kind: str) -> Round | None:
    """The cylinder or cone that a region is; None for a flat face with something bent at its edge."""
    a, b, c = (mesh.vertices[faces[:, k]] for k in range(3))
    cross = np.cross(b - a, c - a)
    twice = np.sqrt(np.einsum("ij,ij->i", cross, cross))
    if flat_face(kind, cross / np.maximum(twice, 1e-300)[:, None], twice) is not None:
        return None
    return fit_round(kind, mesh, faces)
