"""Region tables: a tool typed in as one line per region, with the expert's sequence in the first line.

The paper's authors have two layouts, for their synthetic and for their scanned tools. Numbers are read as the authors'
code reads them, quirks included, so that the published feature values come out; what does not fit together is named, what
can be put right is put right and said, and what can't be read is refused. The product's own layout is read in own_table.
"""

import math
import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.errors import MalformedTable
from app.geometry.cleaning import Level
from app.geometry.own_table import is_own_table, read_own_table
from app.geometry.region_rows import AuthorsLayout, Layout, Row, read_rows, words_of_delimiter
from app.geometry.schematic import drawn, rows_of_patches
from app.geometry.table_faults import faults_between, faults_of_sizes
from app.geometry.table_repair import Sides, four_sides, places_by_neighbours
from app.geometry.table_text import entries, number, outline_points
from app.geometry.tool import Array, RegionGraph, Tool

OUTSIDE = "O"  # the tool's outer edge in a list of neighbours
LEVEL = 1e-9  # rad: two regions that differ less in tilt are equally tilted


@dataclass(frozen=True)
class RegionTable:
    """What was read from a region table."""

    tool: Tool  # with a drawn stand-in for the mesh
    expert: tuple[int, ...] | None  # the sequence in the table
    lines: tuple[tuple[Level, str], ...]  # one sentence per repair ("repaired") and inconsistency ("warning")
    layout: Layout

    @property
    def faults(self) -> tuple[str, ...]:
        """Everything that was put right or does not fit together, with row and value."""
        return tuple(sentence for level, sentence in self.lines if level != "info")


@dataclass(frozen=True)
class Border:
    """A region's border as its row lists it."""

    sides: tuple[tuple[int, ...], ...]  # four sides clockwise from the back; -1 is the tool's outer edge
    lengths: tuple[float, ...]  # one per entry of all sides; surplus ones at the end
    angles: tuple[float, ...]  # rad, one per entry, 0 at the outer edge; empty for synthetic tables
    corners: tuple[int, ...]

    @property
    def listed(self) -> list[int]:
        """All entries in order."""
        return [b for side in self.sides for b in side]

    def length_to(self, b: int) -> float:
        """Length shared with b; of several entries the last counts."""
        return self.lengths[len(self.listed) - 1 - self.listed[::-1].index(b)]


def read_region_table(text: str, layout: Layout | None = None, file_name: str = "The table") -> RegionTable:
    """Read a region table.

    Args:
        text: The file's content (CSV, or JSON in the product's own layout; byte order mark, blank lines, any line ends and
            delimiters are fine).
        layout: "synthetic", "real" or "apprentice"; None recognises it.
        file_name: For messages.

    Raises:
        MalformedTable: Names row, column and value, and what would be accepted.

    Paper: surplus lengths (real tool 4, row a: "0,35" for 0.35) stay as the authors' code reads them and are named.
    """
    if layout == "apprentice" or (layout is None and is_own_table(text)):
        own = read_own_table(text, file_name)
        return RegionTable(own.tool, own.expert, own.lines, "apprentice")
    return _read_authors(text, layout, file_name)


def _read_authors(text: str, layout: AuthorsLayout | None, file_name: str) -> RegionTable:
    if "\0" in text:
        raise MalformedTable(f"{file_name} is not text. Expected a table with commas (CSV).")
    layout, rows, odd = read_rows(text, layout, file_name)
    ids = {row.letter: a for a, row in enumerate(rows)}
    groups = [_groups(row, ids) for row in rows]
    sides = [_sides(row, a, groups, list(ids)) for a, row in enumerate(rows)]
    borders = [_border(row, mine, ids, layout) for row, mine in zip(rows, sides, strict=True)]
    graph = _synthetic_graph(rows, borders) if layout == "synthetic" else _real_graph(rows, borders)
    unsure: list[str] = []
    expert = _expert(rows, ids, unsure)
    low, high = (graph.low, graph.high) if layout == "synthetic" else rows_of_patches(graph.low, graph.area)
    bends = (-0.05, 0.05) if layout == "synthetic" else (0.0, 5.0)  # real tables: a score from -5 to 10
    letters = [row.letter for row in rows]
    tool = drawn(graph, [name.upper() for name in letters], low, high, bends)
    unsure += faults_between(letters, borders, graph) + faults_of_sizes(letters, rows, graph)
    delimiter = words_of_delimiter(text)
    lines: list[tuple[Level, str]] = [("info", delimiter)] if delimiter else []
    lines.extend(("repaired", sentence) for sentence in odd)
    lines.extend(("warning", sentence) for sentence in unsure)
    return RegionTable(tool, expert, tuple(lines), layout)


def _border(row: Row, sides: Sides, ids: dict[str, int], layout: Layout) -> Border:
    count = sum(len(side) for side in sides)
    lengths = row.numbers("lengths")
    if len(lengths) < count or sum(lengths) <= 0 or min(lengths) < 0:
        place = row.headers["neighbours"]
        row.refuse("lengths", f"holds {len(lengths)} lengths for {count} entries in '{place}'. Write one length above 0 per entry.")
    if len(lengths) > count:
        row.note(
            "lengths",
            f"holds {len(lengths)} lengths for {count} neighbours,"
            f" probably a comma in place of a point; read as the authors' code does, the first {count} are taken in order.",
        )
    angles = _angles(row, sides) if layout == "real" else ()
    corners = [_region(row, "corners", t, ids) for t in row.items("corners") if t] if "corners" in row.cells else []
    return Border(sides, tuple(lengths), angles, tuple(b for b in corners if b is not None and b >= 0))


def _groups(row: Row, ids: dict[str, int]) -> list[list[int]]:
    """'O,x,b,c,x,d,x,O' -> the entries between the separators, empty groups left out."""
    groups: list[list[int]] = [[]]
    for token in row.items("neighbours"):
        if token.lower() == "x":
            groups.append([])
        elif not token:
            row.note("neighbours", "has a stray comma; it is left out.")
        else:
            region = _region(row, "neighbours", token, ids)
            groups[-1] += [] if region is None else [region]
    return [group for group in groups if group]


def _sides(row: Row, a: int, groups: list[list[list[int]]], letters: list[str]) -> Sides:
    """The four sides; where separators are missing or too many, as the neighbours' rows have it."""
    mine = groups[a]
    if len(mine) == 4:
        return tuple(tuple(group) for group in mine)
    sides = four_sides(a, mine, groups)
    if sides is None:
        how = "Separate the four sides by x and write O for the tool's edge: O,x,b,c,x,d,x,O."
        row.refuse("neighbours", f"lists {len(mine)} sides instead of 4, and the neighbours' rows don't tell which. {how}")
    read = ",x,".join(",".join(OUTSIDE if b < 0 else letters[b] for b in side) for side in sides)
    row.note("neighbours", f"lists {len(mine)} sides instead of 4; read as {read!r}, which agrees with the neighbours' rows.")
    return sides


def _region(row: Row, key: str, token: str, ids: dict[str, int]) -> int | None:
    """Region number of a letter, -1 for the tool's outer edge, None for a stray number."""
    if token == OUTSIDE:
        return -1
    name = token.strip(".:!?").lower()
    if name in ids:
        return ids[name]
    if name in ("o", "0"):
        row.note(key, f"has {token!r}; read as {OUTSIDE}, the tool's edge.")
        return -1
    if number(token) is not None:
        row.note(key, f"has the stray number {token!r}; it is left out.")
        return None
    row.refuse(key, f"names the region {token!r}, which has no row. Choose from: {', '.join(ids)}, or O for the tool's edge.")


def _angles(row: Row, sides: Sides) -> tuple[float, ...]:
    """Neighbour angles in rad, at the same places as the neighbours; the entry at an outer edge may be anything."""
    listed, given = [b for side in sides for b in side], row.items("angles")
    inner = [b for b in listed if b >= 0]
    if len(given) == len(inner) < len(listed) and all(number(e) is not None for e in given):
        row.note("angles", f"holds {len(given)} angles for {len(listed)} entries; read as those of the {len(inner)} neighbours in turn.")
        left = iter(given)
        given = [next(left) if b >= 0 else "x" for b in listed]
    if len(given) < len(listed):
        how = "Write one angle in degrees per neighbour, x at the tool's edge."
        row.refuse("angles", f"holds {len(given)} angles for {len(listed)} neighbours. {how}")
    if len(given) > len(listed):
        row.note("angles", f"holds {len(given)} angles for {len(listed)} neighbours; the last ones are left out.")
    return tuple(math.radians(row.number_in("angles", e)) if b >= 0 else 0.0 for b, e in zip(listed, given, strict=False))


@dataclass(frozen=True)
class _Matrices:
    """Border lengths as listed, before they are divided by a perimeter."""

    shared: Array
    opposite: Array
    neighbour: NDArray[np.bool_]
    corner: NDArray[np.bool_]
    first: NDArray[np.int64]


def _matrices(borders: list[Border]) -> _Matrices:
    n = len(borders)
    m = _Matrices(np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n), bool), np.zeros((n, n), bool), np.full(n, -1, np.int64))
    for a, border in enumerate(borders):
        regions = [b for b in border.listed if b >= 0]
        m.first[a] = regions[0] if regions else -1
        for b in regions:
            m.shared[a, b] += border.length_to(b)
            m.neighbour[a, b] = True
        m.corner[a, list(border.corners)] = True
        for i, side in enumerate(border.sides):
            for _ in range(side.count(-1)):
                for b in border.sides[(i + 2) % 4]:
                    if b >= 0:
                        m.opposite[a, b] += border.length_to(b)
    return m


def _synthetic_graph(rows: list[Row], borders: list[Border]) -> RegionGraph:
    m, n = _matrices(borders), len(rows)
    points = [_outline(row) for row in rows]
    size, turn = np.array([_size(row, p) for row, p in zip(rows, points, strict=True)]), np.radians([row.number_in("turn") for row in rows])
    difference = np.abs(turn[:, None] - turn[None, :])
    entries = np.array([[border.listed.count(b) for b in range(n)] for border in borders], float)
    turned = difference > LEVEL
    angle = np.where(turned, entries / np.where(turned, difference, 1.0), 0.0)
    half = size.sum(axis=1)[:, None]
    return RegionGraph(
        source="synthetic",
        shared=m.shared / (2 * half), opposite=m.opposite / half, angle=angle,
        neighbour=m.neighbour, corner=m.corner, first=m.first,
        curvature=_column(rows, "curvature"), height=_column(rows, "height"), area=size.prod(axis=1),
        low=np.array([p.min(axis=0) for p in points]), high=np.array([p.max(axis=0) for p in points]),
    )  # fmt: skip


def _size(row: Row, outline: Array) -> tuple[float, float]:
    if "size" not in row.cells:
        width, depth = np.ptp(outline, axis=0)
        return float(width), float(depth)
    width, depth = row.pair("size")
    if min(width, depth) <= 0:
        row.refuse("size", "is not a size. Write width and depth, both above 0, such as 1.5,8.")
    return width, depth


def _outline(row: Row) -> Array:
    """'0,0,x,1.5,0,x,1.5,8,x,0,8' -> (4, 2) corner points."""
    points = outline_points(row.cells["outline"])
    if len(points) < 3 or any(len(p) != 2 for p in points):
        how = "Write x and y of each corner, with x between corners: 0,0,x,1.5,0,x,1.5,8,x,0,8."
        row.refuse("outline", f"is not a list of corner points. {how}")
    outline = np.array([[row.number_in("outline", c.strip()) for c in p] for p in points])
    if np.ptp(outline, axis=0).min() <= 0:
        row.refuse("outline", "encloses no area. The corner points must span a rectangle.")
    return outline


def _real_graph(rows: list[Row], borders: list[Border]) -> RegionGraph:
    m, n = _matrices(borders), len(rows)
    perimeter = np.array([sum(border.lengths) for border in borders])[:, None]
    angle = np.zeros((n, n))
    for a, border in enumerate(borders):
        bend = dict(zip(border.listed, border.angles, strict=True))  # of several entries the last counts
        for b in border.listed:
            if b >= 0:
                angle[a, b] += bend[b]
    area, height = _column(rows, "area"), _column(rows, "height")
    for row, size, z in zip(rows, area, height, strict=True):
        if size <= 0:
            row.refuse("area", "is not a share of the tool's area above 0, such as 0.08.")
        if z == 0:
            row.refuse("height", "can't be used: the height feature divides by it. Write the highest point above 0, such as 0.85.")
    index = np.array([row.pair("index") for row in rows]) if "index" in rows[0].cells else places_by_neighbours([b.sides for b in borders])
    return RegionGraph(
        source="real",
        shared=m.shared / perimeter, opposite=m.opposite / perimeter, angle=angle,
        neighbour=m.neighbour, corner=m.corner, first=m.first,
        curvature=_column(rows, "curvature"), height=height, area=area, low=index, high=index,
    )  # fmt: skip


def _column(rows: list[Row], key: str) -> Array:
    return np.array([row.number_in(key) for row in rows])


def _expert(rows: list[Row], ids: dict[str, int], unsure: list[str]) -> tuple[int, ...] | None:
    """The expert's sequence, from the first row that has one; None if it is unusable, which is said."""
    given = [row for row in rows if row.cells.get("sequence")]
    if not given:
        return None
    row = given[0]
    unsure.extend(f"Row {other.letter}: a second sequence {other.cells['sequence']!r} is left out." for other in given[1:])
    names = entries(re.sub(r"\s*(->|>|\u2192|-)\s*", ",", row.cells["sequence"]).lower())
    unknown = [name for name in names if name not in ids]
    wrong = unknown or [name for name in ids if names.count(name) != 1]
    if wrong:
        unsure.append(
            f"Row {row.letter}: {row.cells['sequence']!r} in '{row.headers['sequence']}' does not hold every region once (see "
            f"{', '.join(repr(name) if unknown else name for name in wrong)}); it is left out, so the tool has no demonstration."
        )
        return None
    return tuple(ids[name] for name in names)
