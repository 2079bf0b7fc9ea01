"""File bytes -> triangles, bodies and CAD faces. Native parsers run here, so this module is only used in a child process."""

import io
import re
from typing import Any

import cascadio
import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.spatial import KDTree

from app.errors import UnreadableMesh
from app.geometry.bodies import Entry, find_bodies
from app.geometry.cad_faces import CadFace, from_record, paint
from app.geometry.parsed import ParsedFile
from app.geometry.tool import Array

Integers = NDArray[np.int64]

SAG = 2000  # the diagonal over this is the allowed distance between a CAD surface and its triangles
ANGLE = 0.2  # rad between neighbouring facets of a CAD surface
COARSE_SAG, COARSE_ANGLE = 1e9, 3.0  # fewest triangles: only the size is wanted
KERNEL_UNIT = 1e-3  # m: the CAD kernel computes in millimetres, whatever unit the file is written in
SAME_PLACE = 1e-7  # share of the diagonal: triangles whose centres are closer are the same
UNIT_NAMES = {"meters": "m", "meter": "m", "millimeters": "mm", "millimeter": "mm", "centimeters": "cm", "inches": "in", "inch": "in"}
# without its colours, a STEP file keeps all faces of a part together; with them, only the first colour keeps its face ids
STYLES = re.compile(rb"#\d+\s*=\s*(?:OVER_RIDING_|CONTEXT_DEPENDENT_OVER_RIDING_)?STYLED_ITEM\s*\([^;]*;")


def parse(data: bytes, kind: str) -> ParsedFile:
    """Everything a file holds.

    Raises:
        UnreadableMesh: The CAD kernel can't read it, or there is no surface in it.
        TooLarge: Too many triangles.
    """
    scene, unit = _brep_scene(data, kind) if kind in ("step", "iges") else _mesh_scene(data, kind)
    entries, cad_face, cad_faces, skipped = _collect(scene)
    found = find_bodies(entries)
    if kind == "step" and b"COLOUR" in data and cad_faces:
        cad_faces = paint(cad_faces, cad_face, _colours(data, scene, entries))
    offsets = np.cumsum([0, *(len(e.vertices) for e in entries)])
    return ParsedFile(
        vertices=np.concatenate([e.vertices for e in entries]),
        faces=np.concatenate([e.faces + start for e, start in zip(entries, offsets[:-1], strict=True)]),
        cad_face=cad_face,
        body=found.body,
        bodies=found.listed,
        cad_faces=tuple(cad_faces),
        units=unit,
        skipped=skipped,
        specks=found.specks,
    )


def _mesh_scene(data: bytes, kind: str) -> tuple[Any, str | None]:
    scene = trimesh.load(io.BytesIO(data), file_type=kind, process=False)
    unit = UNIT_NAMES.get(str(getattr(scene, "units", None) or "").lower())
    return scene, {"glb": "m", "3mf": unit or "mm"}.get(kind)  # by definition of the formats


def _brep_scene(data: bytes, kind: str) -> tuple[Any, str]:
    """Triangulate a STEP or IGES file with a tolerance relative to its size, which a first coarse pass finds."""
    unit = "m" if kind == "step" else "mm"  # the kernel's GLB is in metres for STEP, but in millimetres for IGES
    plain = STYLES.sub(b"", data) if kind == "step" else data
    scene = _triangulate(plain, kind, COARSE_SAG, COARSE_ANGLE)
    diagonal = float(np.linalg.norm(scene.extents)) if scene.extents is not None else 0.0
    if not (np.isfinite(diagonal) and diagonal > 0):
        return scene, unit
    per_kernel = 1 / KERNEL_UNIT if kind == "step" else 1.0
    return _triangulate(plain, kind, diagonal * per_kernel / SAG, ANGLE), unit


def _triangulate(data: bytes, kind: str, sag: float, angle: float) -> Any:
    glb = cascadio.load(data, file_type=kind, tol_linear=sag, tol_angular=angle, include_brep=True)  # pyright: ignore[reportArgumentType]
    if not glb:
        raise UnreadableMesh("The CAD kernel can't read this file: it is damaged or holds no shape. Export it again.")
    return trimesh.load(io.BytesIO(glb), file_type="glb", process=False)


def _collect(scene: Any) -> tuple[list[Entry], Integers, list[CadFace], int]:
    """The meshes in the scene's frame, the CAD face of each triangle, the CAD faces, and how many entries are no meshes."""
    entries: list[Entry] = []
    of_triangle: list[Integers] = [np.empty(0, np.int64)]
    cad_faces: list[CadFace] = []
    skipped = 0
    for name, mesh, transform in _instances(scene):
        if not isinstance(mesh, trimesh.Trimesh) or len(mesh.faces) == 0:
            skipped += 1
            continue
        vertices = np.asarray(mesh.vertices, float) @ transform[:3, :3].T + transform[:3, 3]
        faces = np.asarray(mesh.faces, np.int64).reshape(-1, 3)
        if np.linalg.det(transform[:3, :3]) < 0:
            faces = faces[:, ::-1]
        entries.append(Entry(name, vertices, faces))
        ids = np.asarray(mesh.face_attributes.get("brep_index", np.full(len(faces), -1)), np.int64)
        of_triangle.append(np.where(ids >= 0, ids + len(cad_faces), -1))
        cad_faces += _faces_of(mesh, int(ids.max(initial=-1)) + 1, transform)
    return entries, np.concatenate(of_triangle), cad_faces, skipped


def _instances(scene: Any) -> list[tuple[str, Any, Array]]:
    if not isinstance(scene, trimesh.Scene):
        return [("", scene, np.eye(4))]
    nodes = [(str(node), *scene.graph[node]) for node in scene.graph.nodes_geometry]
    return [(node, scene.geometry[name], np.asarray(transform, float)) for node, transform, name in nodes]


def _faces_of(mesh: Any, count: int, transform: Array) -> list[CadFace]:
    """The exact surfaces of a mesh's CAD faces, in the scene's frame."""
    records = {}
    for record in (mesh.metadata.get("cascadio") or {}).get("brep_faces") or []:
        if isinstance(record, dict) and isinstance(record.get("face_index"), int):
            records[record["face_index"]] = record
    scale = float(np.cbrt(abs(np.linalg.det(transform[:3, :3])))) or 1.0
    return [from_record(records.get(k)).moved(transform[:3, :3] / scale, transform[:3, 3], scale) for k in range(count)]


def _encoded(linear: Array) -> list[int]:
    """sRGB values 0..255 of linear light in [0, 1], in which the reader's materials are given."""
    return np.rint(255 * np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)).astype(int).tolist()


def _colours(data: bytes, scene: Any, entries: list[Entry]) -> Integers:
    """Colour of each triangle as 0xRRGGBB, -1 without: the file is read again with its colours, triangles are matched by place."""
    diagonal = float(np.linalg.norm(scene.extents))
    painted = _triangulate(data, "step", diagonal / KERNEL_UNIT / SAG, ANGLE)
    centres, colours = [np.empty((0, 3))], [np.empty(0, np.int64)]
    for _, mesh, transform in _instances(painted):
        factor = getattr(getattr(getattr(mesh, "visual", None), "material", None), "baseColorFactor", None)
        if not isinstance(mesh, trimesh.Trimesh) or factor is None:
            continue
        red, green, blue = _encoded(np.asarray(factor, float)[:3] / 255)
        corners = np.asarray(mesh.vertices, float) @ transform[:3, :3].T + transform[:3, 3]
        centres.append(corners[mesh.faces].mean(axis=1))
        colours.append(np.full(len(mesh.faces), red << 16 | green << 8 | blue))
    mine = np.concatenate([e.vertices[e.faces].mean(axis=1) for e in entries])
    distance, nearest = KDTree(np.concatenate(centres)).query(mine, distance_upper_bound=SAME_PLACE * diagonal + 1e-12)
    known = np.concatenate([*colours, [-1]])
    return np.where(np.isfinite(distance), known[np.minimum(nearest, len(known) - 1)], -1)
