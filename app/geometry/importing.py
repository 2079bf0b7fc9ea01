"""CAD or mesh file -> clean surface in the tool frame. Parsers only run in another process with limits."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from app.errors import InvalidInput, TooLarge
from app.geometry.cad_faces import CadFace
from app.geometry.cleaning import CleaningReport, CleanSurface, Findings, RawSurface, clean
from app.geometry.cleaning_report import METRES, Line, line_about_cad_faces, lines_about_bodies, report_lines, size_hint, size_words
from app.geometry.parsed import Body, ParsedFile
from app.geometry.parser_process import parse_apart
from app.geometry.sniffing import ACCEPTED, MOST_BYTES, recognise
from app.geometry.tool import Array, Mesh

__all__ = ["ACCEPTED", "METRES", "UP", "Body", "CleaningReport", "ImportedPart", "ParsedFile", "load_part", "make_part", "read_file"]

UP = ("+x", "-x", "+y", "-y", "+z", "-z")


@dataclass(frozen=True)
class ImportedPart:
    """A part ready to be segmented."""

    mesh: Mesh  # SI, +Z up, middle of the part over the origin, lowest point at z = 0
    cad_face: NDArray[np.int32]  # (F,) CAD face of each triangle, index into cad_faces; -1 without
    report: CleaningReport
    cad_faces: tuple[CadFace, ...] = ()  # exact surfaces and colours, in the mesh's frame and metres


def read_file(path: Path, file_name: str) -> ParsedFile:
    """Look into a file: its bodies, their size, units, and which way is probably up.

    Args:
        path: Where the bytes are.
        file_name: What the user calls it; decides the format together with the bytes.

    Raises:
        UnreadableMesh, TooLarge, InvalidInput: The file can't become a tool; the message says why.
    """
    if path.stat().st_size > MOST_BYTES:
        raise TooLarge(f"{file_name} has {path.stat().st_size / 2**20:.0f} MB; at most {MOST_BYTES // 2**20} MB are read.")
    return parse_apart(path, recognise(file_name, path.read_bytes()), file_name)


def load_part(path: Path, file_name: str, units: str, up: str, body: str | None = None) -> ImportedPart:
    """Read, clean and turn a file into the tool frame: `read_file`, then `make_part`."""
    _check_frame(units, up)
    return make_part(read_file(path, file_name), units, up, body)


def make_part(parsed: ParsedFile, units: str, up: str, body: str | None = None) -> ImportedPart:
    """Clean the chosen bodies and turn them into the tool frame.

    Args:
        parsed: What the file holds.
        units: "mm", "cm", "m" or "in": length of one file unit.
        up: Direction of the file's frame that points up, "+x" ... "-z".
        body: "1", "2", ... or "all"; None takes the largest.

    Raises:
        UnreadableMesh, InvalidInput: The bodies can't become a tool; the message says why.
    """
    _check_frame(units, up)
    chosen = parsed.chosen(body)
    scale, rotation = METRES[units], rotation_to_up(up)
    surfaces = [clean(_raw(parsed, number)) for number in chosen]
    placed = [surface.vertices @ rotation.T * scale for surface in surfaces]
    low, high = np.min([v.min(axis=0) for v in placed], axis=0), np.max([v.max(axis=0) for v in placed], axis=0)
    offset = -np.array([(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, low[2]])
    faces, turned = _faced_up(placed, surfaces)
    starts = np.cumsum([0, *(len(v) for v in placed)])
    joined = np.concatenate([f + start for f, start in zip(faces, starts[:-1], strict=True)])
    kept, cad_face = _compact(np.concatenate([s.cad_face for s in surfaces]))
    cad_faces = tuple(parsed.cad_faces[k].moved(rotation, offset, scale) for k in kept)
    lines = _lines(parsed, chosen, [s.findings for s in surfaces], units, high - low, len(joined), turned)
    lines[1:1] = line_about_cad_faces(cad_faces)
    mesh = Mesh(np.concatenate(placed) + offset, np.ascontiguousarray(joined, np.int32))
    return ImportedPart(mesh, cad_face, CleaningReport(tuple(lines)), cad_faces)


def bodies_extents(parsed: ParsedFile, body: str | None) -> tuple[float, float, float]:
    """Size of the chosen bodies together, file units."""
    inside = np.isin(parsed.body, parsed.chosen(body))
    x, y, z = np.ptp(parsed.vertices[np.unique(parsed.faces[inside])], axis=0)
    return float(x), float(y), float(z)


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


def _check_frame(units: str, up: str) -> None:
    if units not in METRES:
        raise InvalidInput(f"Unknown unit {units!r}. Accepted are {', '.join(METRES)}.")
    if up not in UP:
        raise InvalidInput(f"Unknown up-direction {up!r}. Accepted are {', '.join(UP)}.")


def _raw(parsed: ParsedFile, number: int) -> RawSurface:
    mine = parsed.body == number
    return RawSurface(parsed.vertices, parsed.faces[mine], parsed.cad_face[mine])


def _faced_up(placed: Sequence[Array], surfaces: Sequence[CleanSurface]) -> tuple[list[NDArray[np.int64]], int]:
    """The faces of each body, open ones turned over where they face down; how many were."""
    faces, turned = [], 0
    for vertices, surface in zip(placed, surfaces, strict=True):
        corners = vertices[surface.faces]
        upward = float(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2].sum())
        down = not surface.findings.closed and upward < 0
        faces.append(surface.faces[:, ::-1] if down else surface.faces)
        turned += down
    return faces, turned


def _compact(cad_face: NDArray[np.int64]) -> tuple[list[int], NDArray[np.int32]]:
    """The CAD faces that are left, and each triangle's place among them."""
    kept = np.unique(cad_face[cad_face >= 0])
    return kept.tolist(), np.where(cad_face >= 0, np.searchsorted(kept, cad_face), -1).astype(np.int32)


def _lines(
    parsed: ParsedFile, chosen: list[int], findings: list[Findings], units: str, size: Array, triangles: int, turned: int
) -> list[Line]:
    """The report: size first, then what was left out, repaired, suspicious and fine."""
    in_file = [float(e) / METRES[units] for e in size]
    lines: list[Line] = [("info", f"{triangles:,} triangles, {size_words(in_file, units)}.")]
    hint = size_hint(in_file, units)
    if hint:
        lines.append(("warning", f"Unlikely size: {hint}. Check the units ({units})."))
    lines += lines_about_bodies(parsed, chosen)
    lines += report_lines(findings, units)
    if turned:
        what = "the open surface over: it" if len(chosen) == 1 else f"{turned} open surfaces over: they"
        lines.append(("repaired", f"Turned {what} faced down."))
    return lines
