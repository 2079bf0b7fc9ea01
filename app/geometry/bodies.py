"""Which triangles of a file belong together: the bodies an engineer can choose from."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.errors import TooLarge, UnreadableMesh
from app.geometry.cleaning import areas, components, edge_table, weld
from app.geometry.parsed import Body
from app.geometry.tool import Array

Integers = NDArray[np.int64]

MOST_FACES = 2_000_000
LEAST_CONNECTED = 0.5  # share of triangles that must touch another one along an edge
MOST_BODIES = 50  # larger numbers can't be chosen from; the smallest are left out
SPECK = 1e-3  # pieces with a smaller share of the largest body's area are left out
FLATTER = 1.5  # a side must be this much larger than the one below z before we doubt +z
MOST_NAME = 60  # characters


@dataclass(frozen=True)
class Entry:
    """One mesh of the file as it stands in the scene."""

    name: str
    vertices: Array  # (V, 3) file units
    faces: Integers  # (F, 3) into these vertices


@dataclass(frozen=True)
class Bodies:
    """The pieces of a file."""

    body: Integers  # (F,) over the faces of all entries in turn; -1 for specks
    listed: tuple[Body, ...]  # largest area first
    specks: int


def find_bodies(entries: Sequence[Entry]) -> Bodies:
    """Connected pieces within each entry, largest first.

    Raises:
        UnreadableMesh: No triangles, coordinates that are not numbers, or triangles that don't hang together.
        TooLarge: More than MOST_FACES triangles.
    """
    _refuse_hopeless(entries)
    pieces, start, touching, total = [], 0, 0.0, 0
    piece_of_face = []
    for entry in entries:
        if len(entry.faces) == 0:
            continue
        vertices, faces = weld(entry.vertices, entry.faces)
        _, side_edge, count = edge_table(faces)
        touching, total = touching + float((count[side_edge] >= 2).any(axis=1).sum()), total + len(faces)
        piece = components(faces)
        names = _names(entry.name, int(piece.max()) + 1)
        for k, name in enumerate(names):
            mine = faces[piece == k]
            pieces.append((_body(name, vertices, mine), start + k))
        piece_of_face.append(piece + start)
        start += len(names)
    _refuse_soup(total, touching)
    return _sorted(pieces, np.concatenate(piece_of_face))


def _sorted(pieces: list[tuple[Body, int]], piece: Integers) -> Bodies:
    order = sorted(pieces, key=lambda p: -p[0].area)
    if order[0][0].area <= 0:
        raise UnreadableMesh("No triangle in the file has an area. Export a solid or a surface.")
    kept = [p for p in order[:MOST_BODIES] if p[0].area >= SPECK * order[0][0].area]
    number = np.full(len(pieces), -1, np.int64)
    number[[k for _, k in kept]] = np.arange(len(kept))
    return Bodies(number[piece], _told_apart([body for body, _ in kept]), len(order) - len(kept))


def _told_apart(bodies: list[Body]) -> tuple[Body, ...]:
    """Bodies of one name get numbers; those without a name are called Body 1, Body 2, ..."""
    names = [body.name or "Body" for body in bodies]
    seen: dict[str, int] = {}
    result = []
    for body, name in zip(bodies, names, strict=True):
        seen[name] = seen.get(name, 0) + 1
        numbered = names.count(name) > 1 or not body.name
        result.append(Body(**{**vars(body), "name": f"{name} {seen[name]}" if numbered else name}))
    return tuple(result)


def _names(name: str, count: int) -> list[str]:
    """The entry's name for each of its pieces, without what exporters add to it."""
    plain = re.sub(r"_[0-9a-f]{6}$", "", name)
    plain = re.sub(r"\s+", " ", "".join(c if c.isprintable() else " " for c in plain)).strip()[:MOST_NAME]
    if re.fullmatch(r"(geometry|mesh|object|node|shell|solid|compound|world|part|=>.*)?[\s_.]?\d*", plain, re.IGNORECASE):
        plain = ""
    return [plain] * count


def _body(name: str, vertices: Array, faces: Integers) -> Body:
    used = vertices[np.unique(faces)]
    x, y, z = np.ptp(used, axis=0)
    _, _, count = edge_table(faces)
    return Body(
        name,
        (float(x), float(y), float(z)),
        len(faces),
        float(areas(vertices, faces).sum()),
        not (count == 1).any(),
        guess_up(vertices, faces),
    )


def guess_up(vertices: Array, faces: Integers) -> str:
    """+z, unless the part is clearly flatter along another axis; the sign puts a flat underside down.

    The share of triangles that lie in the lowest or highest plane tells underside from worked side.
    """
    corners = vertices[faces]
    lowest, highest = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    extents = highest - lowest
    footprint = np.array([extents[1] * extents[2], extents[0] * extents[2], extents[0] * extents[1]])
    axis = 2 if footprint.max() < FLATTER * footprint[2] else int(np.argmax(footprint))
    height = corners[..., axis]
    tolerance = 1e-3 * extents[axis]
    area = areas(vertices, faces)
    low = area[(height <= lowest[axis] + tolerance).all(axis=1)].sum()
    high = area[(height >= highest[axis] - tolerance).all(axis=1)].sum()
    upside_down = high > 0.5 * footprint[axis] and low < 0.5 * high
    return ("-" if upside_down else "+") + "xyz"[axis]


def _refuse_hopeless(entries: Sequence[Entry]) -> None:
    total = sum(len(entry.faces) for entry in entries)
    if total == 0:
        raise UnreadableMesh("The file holds no triangles. Export a solid or a surface, not only lines or points.")
    if total > MOST_FACES:
        raise TooLarge(f"The file holds {total:,} triangles; at most {MOST_FACES:,} are accepted. Export it more coarsely.")
    bad, size = 0, 0.0
    for entry in entries:
        if len(entry.faces) == 0:
            continue
        if entry.faces.min() < 0 or entry.faces.max() >= len(entry.vertices):
            raise UnreadableMesh("A triangle refers to a corner point that is not in the file. The file is damaged; export it again.")
        used = entry.vertices[np.unique(entry.faces)]
        wrong = ~np.isfinite(used).all(axis=1)
        bad += int(wrong.sum())
        size = max(size, 0.0 if wrong.any() else float(np.ptp(used, axis=0).max()))
    if bad:
        raise UnreadableMesh(f"{bad:,} corner points have coordinates that are not numbers (NaN or infinite). Export the part again.")
    if not size > 0:
        raise UnreadableMesh("All corner points lie in one place: the part has no size.")
    if size > 1e100:
        raise UnreadableMesh(f"The part would be {size:.0e} units long. The file is damaged; export it again.")


def _refuse_soup(total: int, touching: float) -> None:
    if total > 1 and touching < LEAST_CONNECTED * total:
        raise UnreadableMesh(
            f"The {total:,} triangles don't form a surface: only {100 * touching / total:.0f} % of them touch another triangle "
            "along an edge. Export the part as one connected solid or surface."
        )
