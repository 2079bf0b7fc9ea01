"""Parse one CAD or mesh file with hard limits on memory and processor time: `python -m app.geometry.parser_child JOB`.

Native parsers may crash, hang or eat all memory on a hostile file, so they only ever run here. JOB is a folder with
`request.json` and `input`; the answer is `result.json` and, for meshes, `result.npz`. Any other end is read as "damaged file".
"""

import io
import json
import resource
import sys
from pathlib import Path

import cascadio
import numpy as np
import trimesh

from app.errors import AppError, UnreadableMesh
from app.geometry.cleaning import RawSurface, clean

MEMORY_BYTES = 6 * 2**30
CPU_SECONDS = 120
COARSE_SAG, FINE_SAG = 200, 2000  # STEP: an edge (probe) or the diagonal (load) over this is the allowed distance to the true surface
ANGLE = 0.2  # rad between neighbouring facets of a STEP surface
UNIT_NAMES = {"meters": "m", "meter": "m", "millimeters": "mm", "millimeter": "mm", "centimeters": "cm", "inches": "in", "inch": "in"}


def parse(data: bytes, kind: str, fine: bool) -> tuple[RawSurface, dict[str, object]]:
    """Triangles of all bodies in the scene's frame, and what the file says about itself."""
    if kind in ("step", "iges"):
        scene = _brep_scene(data, kind, fine)
    else:
        scene = trimesh.load(io.BytesIO(data), file_type=kind, process=False)
    vertices, faces, cad_faces, skipped, bodies = [np.empty((0, 3))], [np.empty((0, 3), np.int64)], [np.empty(0, np.int64)], 0, 0
    offset, cad_offset = 0, 0
    for mesh, transform in _instances(scene):
        if not isinstance(mesh, trimesh.Trimesh):
            skipped += 1
            continue
        bodies += 1
        own = np.asarray(mesh.vertices, float) @ transform[:3, :3].T + transform[:3, 3]
        triangles = np.asarray(mesh.faces, np.int64).reshape(-1, 3)
        if np.linalg.det(transform[:3, :3]) < 0:
            triangles = triangles[:, ::-1]
        cad = np.asarray(mesh.face_attributes.get("brep_index", np.full(len(triangles), -1)), np.int64)
        vertices.append(own)
        faces.append(triangles + offset)
        cad_faces.append(np.where(cad >= 0, cad + cad_offset, -1))
        offset += len(own)
        cad_offset += int(cad.max(initial=-1)) + 1
    units = UNIT_NAMES.get(str(getattr(scene, "units", None) or "").lower())
    about = {"bodies": bodies, "skipped": skipped, "units": units if kind in ("step", "iges", "glb", "3mf") else None}
    return RawSurface(np.concatenate(vertices), np.concatenate(faces), np.concatenate(cad_faces)), about


def _brep_scene(data: bytes, kind: str, fine: bool) -> trimesh.Scene:
    """Triangulate a STEP or IGES file; the tolerance is absolute, so the size has to be known first."""
    scene = _triangulate(data, kind, 1 / COARSE_SAG, relative=True)
    diagonal = float(np.linalg.norm(scene.extents)) if scene.extents is not None else 0.0
    if not fine or not diagonal > 0:
        return scene
    per_metre = 1000.0  # cascadio writes metres, but takes its tolerance in the file's unit, nearly always mm
    return _triangulate(data, kind, diagonal * per_metre / FINE_SAG, relative=False)


def _triangulate(data: bytes, kind: str, sag: float, relative: bool) -> trimesh.Scene:
    glb = cascadio.load(data, file_type=kind, tol_linear=sag, tol_angular=ANGLE, tol_relative=relative, include_brep=True)  # pyright: ignore[reportArgumentType]
    if not glb:
        raise UnreadableMesh("The CAD kernel can't read this file: it is damaged or holds no shape. Export it again.")
    return trimesh.load(io.BytesIO(glb), file_type="glb", process=False)  # pyright: ignore[reportReturnType]


def _instances(scene: object) -> list[tuple[object, np.ndarray]]:
    if not isinstance(scene, trimesh.Scene):
        return [(scene, np.eye(4))]
    found = []
    for node in scene.graph.nodes_geometry:
        transform, name = scene.graph[node]
        found.append((scene.geometry[name], np.asarray(transform)))
    return found


def answer(folder: Path) -> None:
    """Do what request.json asks and write the result."""
    request = json.loads((folder / "request.json").read_text())
    raw, about = parse((folder / "input").read_bytes(), request["kind"], fine=request["what"] == "load")
    surface = clean(raw)
    lines = list(surface.lines)
    if about["skipped"]:
        lines.insert(0, ("info", f"Skipped {about['skipped']} entries that are lines or points, not surfaces."))
    np.savez(
        folder / "result.npz", vertices=surface.vertices, faces=surface.faces.astype(np.int32), cad_face=surface.cad_face.astype(np.int32)
    )
    (folder / "result.json").write_text(json.dumps({**about, "closed": surface.closed, "lines": lines}))


def main(folder: Path) -> None:
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES, MEMORY_BYTES))
    resource.setrlimit(resource.RLIMIT_CPU, (CPU_SECONDS, CPU_SECONDS))
    try:
        answer(folder)
    except AppError as error:
        (folder / "result.json").write_text(json.dumps({"error": type(error).__name__, "detail": str(error)}))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
