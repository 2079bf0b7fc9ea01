"""What a CAD file says about each of its faces: the exact surface, where it has a simple one, and its colour."""

from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from app.geometry.tool import Array

Kind = Literal["plane", "cylinder", "cone", "sphere", "torus", "freeform"]
Point = tuple[float, float, float]
Colour = tuple[int, int, int]

# where the CAD kernel's record of a surface keeps its point and its direction
_POINTS = {"plane": "origin", "cylinder": "origin", "cone": "apex", "sphere": "center", "torus": "center"}
_AXES = {"plane": "normal", "cylinder": "axis", "cone": "axis", "torus": "axis"}
SAME = 1e-5  # share of the part's size, and rad, within which two faces lie on one surface
_RADII = {"cylinder": "radius", "sphere": "radius", "torus": "major_radius"}


@dataclass(frozen=True)
class CadFace:
    """One face of the CAD model; lengths in the unit and frame of the part it belongs to."""

    kind: Kind
    point: Point | None = None  # on the plane or axis; apex of a cone; centre of a sphere or torus
    axis: Point | None = None  # unit normal or axis; None for spheres and freeform faces
    radius: float | None = None  # cylinder, sphere; the large one of a torus
    minor_radius: float | None = None  # torus
    half_angle: float | None = None  # cone, rad
    colour: Colour | None = None  # red, green, blue 0..255 as painted in the CAD system

    def moved(self, rotation: Array, offset: Array, scale: float) -> "CadFace":
        """The face after x -> scale * rotation @ x + offset."""
        if self.kind == "freeform" or self.point is None:
            return self
        point = scale * rotation @ np.array(self.point) + offset
        axis = None if self.axis is None else _triple(rotation @ np.array(self.axis))
        grown = {name: None if (r := getattr(self, name)) is None else float(scale * r) for name in ("radius", "minor_radius")}
        return replace(self, point=_triple(point), axis=axis, **grown)


def _triple(values: Any) -> Point:
    x, y, z = (float(v) for v in values)
    return x, y, z


def same_surface(a: CadFace, b: CadFace, size: float) -> bool:
    """Whether two faces lie on one plane, cylinder, cone, sphere or torus; freeform ones never do.

    Args:
        a: A face.
        b: Another one.
        size: Of the part, in its unit.
    """
    if a.kind != b.kind or a.point is None or b.point is None:
        return False
    sizes = [((getattr(a, name) or 0.0) - (getattr(b, name) or 0.0)) / size for name in ("radius", "minor_radius")]
    if max(*np.abs(sizes), abs((a.half_angle or 0.0) - (b.half_angle or 0.0))) > SAME:
        return False
    apart = np.subtract(a.point, b.point) / size
    if a.axis is not None and b.axis is not None:
        axis = np.array(a.axis)
        if np.linalg.norm(np.cross(axis, b.axis)) > SAME:
            return False
        along = (apart @ axis) * axis
        apart = {"plane": along, "cylinder": apart - along}.get(a.kind, apart)
    return float(np.linalg.norm(apart)) <= SAME


def from_record(record: dict[str, Any] | None) -> CadFace:
    """A face from the kernel's record; what has no record, or a broken one, is freeform."""
    kind = str((record or {}).get("type"))
    if record is None or kind not in _POINTS:
        return CadFace("freeform")
    try:
        face = CadFace(
            kind,  # pyright: ignore[reportArgumentType]
            point=_triple(record[_POINTS[kind]]),
            axis=_triple(record[_AXES[kind]]) if kind in _AXES else None,
            radius=float(record[_RADII[kind]]) if kind in _RADII else None,
            minor_radius=float(record["minor_radius"]) if kind == "torus" else None,
            half_angle=float(record["semi_angle"]) if kind == "cone" else None,
        )
    except (KeyError, TypeError, ValueError):
        return CadFace("freeform")
    numbers = [*(face.point or ()), *(face.axis or ()), face.radius or 0.0, face.minor_radius or 0.0, face.half_angle or 0.0]
    return face if np.isfinite(numbers).all() else CadFace("freeform")


def paint(faces: list[CadFace], cad_face: NDArray[np.int64], colour: NDArray[np.int64]) -> list[CadFace]:
    """Give each face the colour that most of its triangles have.

    Args:
        faces: The faces.
        cad_face: Face of each triangle (F,), -1 without.
        colour: Colour of each triangle as 0xRRGGBB (F,), -1 without.
    """
    painted = list(faces)
    known = (cad_face >= 0) & (colour >= 0)
    for a in np.unique(cad_face[known]):
        values, count = np.unique(colour[known & (cad_face == a)], return_counts=True)
        if 2 * count.max() >= (cad_face == a).sum():
            rgb = int(values[np.argmax(count)])
            painted[a] = replace(painted[a], colour=(rgb >> 16, rgb >> 8 & 255, rgb & 255))
    return painted
