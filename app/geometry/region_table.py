"""The authors' region tables: a tool typed in as one line per region, with the expert's sequence in the first line.

Two layouts exist, for the paper's synthetic and for its scanned tools. Numbers are read as the authors' code reads them,
quirks included, so that the published feature values come out; what does not fit together is named, and what can't be
read is refused.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.geometry.region_rows import Layout, Row, read_rows
from app.geometry.schematic import patches, rows_of_patches
from app.geometry.table_faults import faults_between, faults_of_sizes
from app.geometry.tool import Array, Mesh, Region, RegionGraph, Tool, region_letters

OUTSIDE = "O"  # the tool's outer edge in a list of neighbours


@dataclass(frozen=True)
class RegionTable:
    """What was read from a region table."""

    tool: Tool  # with a drawn stand-in for the mesh
    expert: tuple[int, ...] | None  # the sequence in the table
    faults: tuple[str, ...]  # one sentence per inconsistency, with row and value
    layout: Layout


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
        text: The file's content (CSV; byte order mark, blank lines and any line ends are fine).
        layout: "synthetic" or "real"; None recognises it from the header.
        file_name: For messages.

    Raises:
        MalformedTable: Names row, column and value, and what would be accepted.

    Paper: surplus lengths (real tool 4, row a: "0,35" for 0.35) stay as the authors' code reads them and are named.
    """
    layout, rows, odd = read_rows(text, layout, file_name)
    ids = {row.letter: a for a, row in enumerate(rows)}
    borders = [_border(row, ids, layout, odd) for row in rows]
    graph = _synthetic_graph(rows, borders) if layout == "synthetic" else _real_graph(rows, borders)
    expert = _expert(rows, ids, odd)
    tool = _drawn(graph)
    letters = [row.letter for row in rows]
    faults = odd + faults_between(letters, borders, graph) + faults_of_sizes(letters, rows, graph)
    return RegionTable(tool, expert, tuple(faults), layout)


def _border(row: Row, ids: dict[str, int], layout: Layout, odd: list[str]) -> Border:
    sides = _sides(row, ids, odd)
    count = sum(len(side) for side in sides)
    lengths = row.numbers("lengths")
    if len(lengths) < count or sum(lengths) <= 0:
        place = row.headers["neighbours"]
        row.refuse("lengths", f"holds {len(lengths)} lengths for {count} entries in '{place}'. Write one length above 0 per entry.")
    if len(lengths) > count:
        odd.append(
            f"Row {row.letter}: {row.cells['lengths']!r} in '{row.headers['lengths']}' holds {len(lengths)} lengths for {count} neighbours,"
            f" probably a comma in place of a point; read as the authors' code does, the first {count} are taken in order."
        )
    angles = _angles(row, sides, odd) if layout == "real" else ()
    corners = [_region(row, "corners", t, ids) for t in row.items("corners") if t]
    return Border(sides, tuple(lengths), angles, tuple(b for b in corners if b >= 0))


def _sides(row: Row, ids: dict[str, int], odd: list[str]) -> tuple[tuple[int, ...], ...]:
    """'O,x,b,c,x,d,x,O' -> four sides."""
    sides: list[list[int]] = [[]]
    for token in row.items("neighbours"):
        if token.lower() == "x":
            sides.append([])
        elif not token:
            odd.append(f"Row {row.letter}: {row.cells['neighbours']!r} in '{row.headers['neighbours']}' has a stray comma; it is left out.")
        else:
            sides[-1].append(_region(row, "neighbours", token, ids))
    if len(sides) != 4 or not all(sides):
        filled = sum(bool(side) for side in sides)
        how = "Separate the four sides by x and write O for the tool's edge: O,x,b,c,x,d,x,O."
        row.refuse("neighbours", f"lists {filled} sides instead of 4. {how}")
    return tuple(tuple(side) for side in sides)


def _region(row: Row, key: str, token: str, ids: dict[str, int]) -> int:
    """Region number of a letter, -1 for the tool's outer edge."""
    if token == OUTSIDE:
        return -1
    if token.lower() not in ids:
        row.refuse(key, f"names the region {token!r}, which has no row. Choose from: {', '.join(ids)}, or O for the tool's edge.")
    return ids[token.lower()]


def _angles(row: Row, sides: tuple[tuple[int, ...], ...], odd: list[str]) -> tuple[float, ...]:
    """Neighbour angles in rad, at the same places as the neighbours; the entry at an outer edge may be anything."""
    listed, entries = [b for side in sides for b in side], row.items("angles")
    if len(entries) < len(listed):
        how = "Write one angle in degrees per neighbour, x at the tool's edge."
        row.refuse("angles", f"holds {len(entries)} angles for {len(listed)} neighbours. {how}")
    if len(entries) > len(listed):
        odd.append(
            f"Row {row.letter}: {row.cells['angles']!r} in '{row.headers['angles']}' holds {len(entries)} angles"
            f" for {len(listed)} neighbours; the last ones are left out."
        )
    return tuple(math.radians(row.number_in("angles", e)) if b >= 0 else 0.0 for b, e in zip(listed, entries, strict=False))


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
    size, turn = np.array([_size(row) for row in rows]), np.radians([row.number_in("turn") for row in rows])
    difference = np.abs(turn[:, None] - turn[None, :])
    entries = np.array([[border.listed.count(b) for b in range(n)] for border in borders], float)
    angle = np.where(difference > 0, entries / np.where(difference > 0, difference, 1.0), 0.0)
    points = [_outline(row) for row in rows]
    half = size.sum(axis=1)[:, None]
    return RegionGraph(
        source="synthetic",
        shared=m.shared / (2 * half), opposite=m.opposite / half, angle=angle,
        neighbour=m.neighbour, corner=m.corner, first=m.first,
        curvature=_column(rows, "curvature"), height=_column(rows, "height"), area=size.prod(axis=1),
        low=np.array([p.min(axis=0) for p in points]), high=np.array([p.max(axis=0) for p in points]),
    )  # fmt: skip


def _size(row: Row) -> tuple[float, float]:
    width, depth = row.pair("size")
    if min(width, depth) <= 0:
        row.refuse("size", "is not a width and a depth above 0. Write two lengths, such as 1.5,8.")
    return width, depth


def _outline(row: Row) -> Array:
    """'0,0,x,1.5,0,x,1.5,8,x,0,8' -> (4, 2) corner points."""
    points = [p.strip(" ,").split(",") for p in row.cells["outline"].lower().split("x")]
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
    index = np.array([row.pair("index") for row in rows])
    return RegionGraph(
        source="real",
        shared=m.shared / perimeter, opposite=m.opposite / perimeter, angle=angle,
        neighbour=m.neighbour, corner=m.corner, first=m.first,
        curvature=_column(rows, "curvature"), height=height, area=area, low=index, high=index,
    )  # fmt: skip


def _column(rows: list[Row], key: str) -> Array:
    return np.array([row.number_in(key) for row in rows])


def _expert(rows: list[Row], ids: dict[str, int], odd: list[str]) -> tuple[int, ...] | None:
    """The expert's sequence, from the first row that has one."""
    given = [row for row in rows if row.cells.get("sequence")]
    if not given:
        return None
    row = given[0]
    odd.extend(f"Row {other.letter}: a second sequence {other.cells['sequence']!r} is left out." for other in given[1:])
    order = [_region(row, "sequence", token, ids) for token in row.items("sequence")]
    wrong = [letter for letter, a in ids.items() if order.count(a) != 1]
    if wrong or len(order) != len(ids):
        how = f"Write all of {','.join(ids)} in the expert's order."
        row.refuse("sequence", f"does not hold every region once: see {', '.join(wrong) or 'O'}. {how}")
    return tuple(order)


def _drawn(graph: RegionGraph) -> Tool:
    """The tool with patches in place of its mesh."""
    low, high = (graph.low, graph.high) if graph.source == "synthetic" else rows_of_patches(graph.low, graph.area)
    mesh, labels = patches(low, high, graph.height)
    middle = (low + high) / 2
    place = (middle - low.min(axis=0)) / (high.max(axis=0) - low.min(axis=0))
    names = region_letters(graph.n)
    regions = tuple(_drawn_region(names[a], _describe(graph, a, place[a]), mesh, labels == a, graph.curvature[a]) for a in range(graph.n))
    return Tool(mesh, labels, regions, graph)


def _describe(graph: RegionGraph, a: int, place: Array) -> str:
    """'Back left, curved inwards'."""
    along = ("Back", "Middle", "Front")[min(2, int(place[1] * 3))]
    across = ("left", "", "right")[min(2, int(place[0] * 3))]
    inwards, outwards = (0.0, 5.0) if graph.source == "real" else (-0.05, 0.05)  # real tables: a score from -5 to 10
    k = graph.curvature[a]
    bend = "curved inwards" if k < inwards else "curved outwards" if k > outwards else "flat"
    return f"{along} {across}".strip() + f", {bend}"


def _drawn_region(name: str, description: str, mesh: Mesh, mine: NDArray[np.bool_], curvature: float) -> Region:
    """Centre, normal and area as drawn; a region hidden under others gets the middle of the tool and no area."""
    corners = mesh.vertices[mesh.faces[mine]]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2
    size = np.linalg.norm(across, axis=1)
    area = float(size.sum())
    if area == 0:
        return Region(name, description, mesh.vertices.mean(axis=0), np.array([0.0, 0.0, 1.0]), 0.0, float(curvature), "listed")
    normal = across.sum(axis=0) / np.linalg.norm(across.sum(axis=0))
    return Region(name, description, (corners.mean(axis=1) * size[:, None]).sum(axis=0) / area, normal, area, float(curvature), "listed")
