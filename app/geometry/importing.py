"""CAD or mesh file -> clean surface in the tool frame. Parsers only run in a child process with limits."""

import json
import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from app import errors
from app.errors import InvalidInput, TooLarge, UnreadableMesh
from app.geometry.cleaning import CleaningReport, areas
from app.geometry.sniffing import ACCEPTED, FORMAT_NAMES, MOST_BYTES, recognise
from app.geometry.tool import Array, Mesh

__all__ = ["ACCEPTED", "CleaningReport", "ImportedPart", "Probe", "load_part", "probe"]

WALL_SECONDS = 180.0
METRES = {"mm": 1e-3, "cm": 1e-2, "m": 1.0, "in": 0.0254}
UP = ("+x", "-x", "+y", "-y", "+z", "-z")
SMALLEST, LARGEST = 0.005, 20.0  # m; a diagonal outside is reported, the units are probably wrong
FLATTER = 1.5  # a side must be this much larger than the one below z before we doubt +z
ROOT = Path(__file__).resolve().parents[2]


@dataclass(frozen=True)
class Probe:
    """What a file holds, before it is imported."""

    extents: tuple[float, float, float]  # file units
    units: str | None  # "m", "mm", "cm", "in" when the file says it
    bodies: int
    faces: int
    notes: tuple[str, ...]
    up_guess: str  # "+x" ... "-z"


@dataclass(frozen=True)
class ImportedPart:
    """A part ready to be segmented."""

    mesh: Mesh  # SI, +Z up, middle of the part over the origin, lowest point at z = 0
    cad_face: NDArray[np.int32]  # (F,) CAD face of each triangle, -1 without
    report: CleaningReport


@dataclass(frozen=True)
class _Parsed:
    vertices: Array
    faces: NDArray[np.int32]
    cad_face: NDArray[np.int32]
    about: dict[str, object]
    lines: tuple[tuple[str, str], ...]


def probe(path: Path, file_name: str) -> Probe:
    """Look into a file: size, units, bodies, and which way is probably up.

    Raises:
        UnreadableMesh, TooLarge, InvalidInput: The file can't become a tool; the message says why.
    """
    parsed = _parse(path, file_name, "probe")
    x, y, z = np.ptp(parsed.vertices, axis=0)
    return Probe(
        extents=(float(x), float(y), float(z)),
        units=None if parsed.about["units"] is None else str(parsed.about["units"]),
        bodies=int(str(parsed.about["bodies"])),
        faces=len(parsed.faces),
        notes=tuple(sentence for level, sentence in parsed.lines if level != "info"),
        up_guess=_guess_up(parsed.vertices, parsed.faces),
    )


def load_part(path: Path, file_name: str, units: str, up: str) -> ImportedPart:
    """Read, clean and turn a file into the tool frame.

    Args:
        path: Where the bytes are.
        file_name: What the user calls it; decides the format together with the bytes.
        units: "mm", "cm", "m" or "in": length of one file unit.
        up: Direction of the file's frame that points up, "+x" ... "-z".

    Raises:
        UnreadableMesh, TooLarge, InvalidInput: The file can't become a tool; the message says why.
    """
    if units not in METRES:
        raise InvalidInput(f"Unknown unit {units!r}. Accepted are {', '.join(METRES)}.")
    if up not in UP:
        raise InvalidInput(f"Unknown up-direction {up!r}. Accepted are {', '.join(UP)}.")
    parsed = _parse(path, file_name, "load")
    vertices = parsed.vertices @ rotation_to_up(up).T * METRES[units]
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    vertices = vertices - [(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, low[2]]
    lines, faces = list(parsed.lines), parsed.faces
    if not parsed.about["closed"] and _faces_down(vertices, faces):
        faces = np.ascontiguousarray(faces[:, ::-1])
        lines.append(("repaired", "Turned the open surface over: it faced down."))
    diagonal = float(np.linalg.norm(high - low))
    if not SMALLEST <= diagonal <= LARGEST:
        lines.append(("warning", f"The part is {diagonal:.3g} m across. Check the units ({units})."))
    size = " × ".join(f"{1000 * e:.4g}" for e in high - low)
    lines.insert(0, ("info", f"{len(faces):,} triangles, {size} mm."))
    return ImportedPart(Mesh(vertices, faces), parsed.cad_face, CleaningReport(tuple(lines)))


def rotation_to_up(up: str) -> Array:
    """Rotation (3, 3) that takes the direction `up` to +Z; identity for "+z", quarter or half turns otherwise."""
    axis, sign = "xyz".index(up[1]), 1.0 if up[0] == "+" else -1.0
    if axis == 2:
        return np.diag([1.0, sign, sign])
    rows = np.zeros((3, 3))
    rows[2, axis] = sign
    other = 1 - axis
    rows[0, other] = 1.0 if axis == 1 else 0.0
    rows[1, other] = 1.0 if axis == 0 else 0.0
    rows[1 if axis == 1 else 0] = np.cross(rows[1], rows[2]) if axis == 0 else np.cross(rows[2], rows[0])
    return rows


def _guess_up(vertices: Array, faces: NDArray[np.int32]) -> str:
    """+z, unless the part is clearly flatter along another axis; the sign puts a flat underside down.

    The share of triangles that lie in the lowest or highest plane tells underside from worked side.
    """
    extents = np.ptp(vertices, axis=0)
    footprint = np.array([extents[1] * extents[2], extents[0] * extents[2], extents[0] * extents[1]])
    axis = 2 if footprint.max() < FLATTER * footprint[2] else int(np.argmax(footprint))
    height = vertices[faces][..., axis]
    tolerance = 1e-3 * extents[axis]
    area = areas(vertices, faces)
    low = area[(height <= vertices[:, axis].min() + tolerance).all(axis=1)].sum()
    high = area[(height >= vertices[:, axis].max() - tolerance).all(axis=1)].sum()
    upside_down = high > 0.5 * footprint[axis] and low < 0.5 * high
    return ("-" if upside_down else "+") + "xyz"[axis]


def _faces_down(vertices: Array, faces: NDArray[np.int32]) -> bool:
    corners = vertices[faces]
    return float(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2].sum()) < 0


def _parse(path: Path, file_name: str, what: str) -> _Parsed:
    if path.stat().st_size > MOST_BYTES:
        raise TooLarge(f"{file_name} has {path.stat().st_size / 2**20:.0f} MB; at most {MOST_BYTES // 2**20} MB are read.")
    data = path.read_bytes()
    kind = recognise(file_name, data)
    with tempfile.TemporaryDirectory(prefix="apprentice-import-") as name:
        folder = Path(name)
        (folder / "input").write_bytes(data)
        (folder / "request.json").write_text(json.dumps({"kind": kind, "what": what}))
        _run_child(folder, file_name, kind)
        result = json.loads((folder / "result.json").read_text())
        if "error" in result:
            raise getattr(errors, result["error"])(f"{file_name}: {result['detail']}")
        with np.load(folder / "result.npz", allow_pickle=False) as arrays:
            vertices, faces, cad_face = arrays["vertices"], arrays["faces"], arrays["cad_face"]
    return _Parsed(vertices, faces, cad_face, result, tuple((level, sentence) for level, sentence in result["lines"]))


def _run_child(folder: Path, file_name: str, kind: str) -> None:
    """Run the parser; every end but a written result becomes a sentence about the file."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    command = [sys.executable, "-m", "app.geometry.parser_child", str(folder)]
    try:
        done = subprocess.run(
            command, cwd=folder, env=environment, stdin=subprocess.DEVNULL, capture_output=True, timeout=WALL_SECONDS, check=False
        )
    except subprocess.TimeoutExpired as error:
        raise UnreadableMesh(
            f"{file_name}: reading took longer than {WALL_SECONDS:.0f} s and was stopped. Export it more coarsely."
        ) from error
    if (folder / "result.json").exists():
        return
    if b"MemoryError" in done.stderr or b"Unable to allocate" in done.stderr:
        raise TooLarge(f"{file_name}: reading it needs more memory than is allowed. Export it more coarsely.")
    raise UnreadableMesh(f"{file_name} is damaged: the {FORMAT_NAMES[kind]} reader can't make sense of it. Export it again.")
