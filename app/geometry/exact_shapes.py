"""What regions of a CAD file are by its own exact surfaces: no fit can be surer of a radius than the model itself."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.geometry.attributes import Shape, turning_curvature
from app.geometry.cad_faces import CadFace, same_surface
from app.geometry.cleaning import joined
from app.geometry.tool import Array, Mesh, Tool

SIMPLE = ("plane", "cylinder", "cone", "sphere")
MOSTLY = 0.6  # share of a region's area on one surface from which it is what that surface is, holes and fillets aside


@dataclass(frozen=True)
class CadSurfaces:
    """Which face of a CAD model each triangle of a mesh lies on."""

    cad_face: NDArray[np.int32]  # (F,) index into cad_faces, -1 without
    cad_faces: tuple[CadFace, ...]  # in the mesh's frame, metres


def surface_of(cad_faces: Sequence[CadFace], size: float) -> NDArray[np.int64]:
    """Number of the surface that each face lies on; freeform faces have one of their own."""
    by_kind: dict[str, list[int]] = {}
    for k, face in enumerate(cad_faces):
        by_kind.setdefault(face.kind, []).append(k)
    result = np.arange(len(cad_faces))
    for kind, mine in by_kind.items():
        first: list[int] = []
        for k in mine if kind != "freeform" else []:
            same = next((f for f in first if same_surface(cad_faces[f], cad_faces[k], size)), None)
            result[k] = k if same is None else same
            first += [k] if same is None else []
    return result


def by_surface(labels: NDArray[np.int64], cad: CadSurfaces, surface: NDArray[np.int64], pairs: NDArray[np.int64]) -> NDArray[np.int64]:
    """Patches of a CAD model: faces on one surface together, all others apart; freeform ones join where their labels (F,) agree."""
    if not len(cad.cad_faces):
        return labels
    exact = np.array([face.kind != "freeform" for face in cad.cad_faces] + [False])[cad.cad_face]
    place = np.append(surface, -1)[cad.cad_face]
    a, b = pairs.T
    loose = ~exact[a] & ~exact[b] & (labels[a] == labels[b])
    return joined(pairs[((place[a] == place[b]) & (place[a] >= 0)) | loose], len(labels))


def exact_shapes(mesh: Mesh, labels: NDArray[np.int32], cad: CadSurfaces) -> tuple[Shape | None, ...]:
    """Curvature and kind of every region of which most lies on one plane, cylinder, cone or sphere of the model; else None.

    A region of several planes is freeform: a cylinder may fit it, but there is an edge in it.
    """
    n = int(labels.max()) + 1
    if not len(cad.cad_faces):
        return (None,) * n
    surface = surface_of(cad.cad_faces, float(np.linalg.norm(np.ptp(mesh.vertices, axis=0))))
    corners = mesh.vertices[mesh.faces]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    twice = np.sqrt(np.einsum("ij,ij->i", cross, cross))
    place = np.append(surface, -1)[cad.cad_face]
    shapes: list[Shape | None] = []
    for k in range(n):
        mine = np.flatnonzero(labels == k)
        on = mine[place[mine] >= 0]
        share = np.bincount(place[on], weights=twice[on], minlength=1)
        main = int(np.argmax(share))
        if share[main] >= MOSTLY * twice[mine].sum() and cad.cad_faces[main].kind in SIMPLE:
            chosen = on[place[on] == main]
            shapes.append((_curvature(cad.cad_faces[main], corners[chosen], cross[chosen]), cad.cad_faces[main].kind))
        else:
            edged = len(on) == len(mine) and all(cad.cad_faces[k].kind == "plane" for k in np.unique(place[mine]))
            shapes.append((turning_curvature(corners[mine]), "freeform") if edged else None)
    return tuple(shapes)


def known_shape(tool: Tool, region: int) -> Shape:
    """What a region is already known to be."""
    return tool.regions[region].curvature, tool.regions[region].kind


def _curvature(face: CadFace, corners: Array, cross: Array) -> float:
    """Of a face on its triangles' corners (F, 3, 3), whose normals times twice their area are `cross`; + where it is convex."""
    if face.kind == "plane" or face.point is None:
        return 0.0
    away = corners - np.array(face.point)
    if face.axis is not None:
        away = away - (away @ np.array(face.axis))[..., None] * np.array(face.axis)
    sign = 1.0 if (away.mean(axis=1) * cross).sum() >= 0 else -1.0
    if face.radius is not None:
        return sign / face.radius
    weight = np.sqrt((cross**2).sum(axis=1))
    square = np.average((away**2).sum(axis=2).mean(axis=1), weights=weight)
    return float(sign * np.cos(face.half_angle or 0.0) / np.sqrt(square))
