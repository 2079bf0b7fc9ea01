"""What in a region table does not fit together: one sentence per fault, with row and value."""

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from app.geometry.region_rows import Row
from app.geometry.table_text import number, outline_points
from app.geometry.tool import RegionGraph

EQUAL = 1e-6  # relative: listed lengths and angles closer than this agree


class ListedBorder(Protocol):
    """A region's border as its row lists it."""

    @property
    def listed(self) -> list[int]: ...
    @property
    def corners(self) -> tuple[int, ...]: ...
    def length_to(self, b: int) -> float: ...


def faults_between(letters: Sequence[str], borders: Sequence[ListedBorder], graph: RegionGraph) -> list[str]:
    """Where two rows, or two cells of a row, contradict each other."""
    found: list[str] = []
    for a, border in enumerate(borders):
        name = letters[a]
        for b in sorted({b for b in border.listed if b >= 0}):
            found += _faults_of_pair(name, letters[b], a, b, border, borders[b], graph)
        for b in sorted(set(border.corners)):
            if a not in borders[b].corners:
                found.append(f"Row {name}: lists {letters[b]} as a corner neighbour, but row {letters[b]} doesn't list {name}.")
            if b in border.listed:
                found.append(f"Row {name}: lists {letters[b]} as a corner neighbour and as an edge neighbour.")
    return found


def _faults_of_pair(name: str, other: str, a: int, b: int, mine: ListedBorder, theirs: ListedBorder, graph: RegionGraph) -> list[str]:
    if a == b:
        return [f"Row {name}: lists itself ({name}) as a neighbour."]
    found = []
    if mine.listed.count(b) > 1:
        found.append(f"Row {name}: lists {other} {mine.listed.count(b)} times; the last length ({mine.length_to(b):g}) counts each time.")
    if a not in theirs.listed:
        return [*found, f"Row {name}: lists {other} as a neighbour, but row {other} doesn't list {name}."]
    if a > b:
        return found
    length, back = mine.length_to(b), theirs.length_to(a)
    if abs(length - back) > EQUAL * max(length, back):
        found.append(f"Rows {name} and {other}: their common border is {length:g} in row {name} and {back:g} in row {other}.")
    if graph.source != "synthetic":
        angle, turned = np.degrees(graph.angle[a, b]), np.degrees(graph.angle[b, a])
        if abs(angle + turned) > EQUAL * 360:
            found.append(
                f"Rows {name} and {other}: the angle between them is {angle:g} degrees in row {name} and {turned:g} in row {other};"
                " expected opposite signs."
            )
    return found


def faults_of_sizes(letters: Sequence[str], rows: Sequence[Row], graph: RegionGraph) -> list[str]:
    """Areas, outlines and positions that can't be right."""
    return _synthetic_sizes(letters, rows, graph) if graph.source == "synthetic" else _real_sizes(letters, graph)


def _synthetic_sizes(letters: Sequence[str], rows: Sequence[Row], graph: RegionGraph) -> list[str]:
    found, box = [], np.prod(graph.high - graph.low, axis=1)
    for a, name in enumerate(letters):
        if abs(box[a] - graph.area[a]) > EQUAL * box[a]:
            size = rows[a].cells.get("size", "")
            found.append(f"Row {name}: the size {size!r} has area {graph.area[a]:g}, its corner points enclose {box[a]:g}.")
        points = {(number(x), number(y)) for x, y in outline_points(rows[a].cells["outline"])}
        if points != {(x, y) for x in (graph.low[a, 0], graph.high[a, 0]) for y in (graph.low[a, 1], graph.high[a, 1])}:
            found.append(f"Row {name}: the corner points {rows[a].cells['outline']!r} are not those of a rectangle; their box is used.")
        for b in range(a):
            common = np.minimum(graph.high[a], graph.high[b]) - np.maximum(graph.low[a], graph.low[b])
            if (common > EQUAL).all():
                found.append(f"Rows {letters[b]} and {name}: their rectangles overlap by {common.prod():g}.")
    whole = float(np.prod(graph.high.max(axis=0) - graph.low.min(axis=0)))
    if abs(graph.area.sum() - whole) > EQUAL * whole:
        found.append(f"All rows: the areas add up to {graph.area.sum():g}, the tool's rectangle has {whole:g}.")
    return found


def _real_sizes(letters: Sequence[str], graph: RegionGraph) -> list[str]:
    found, places = [], {}
    for a, name in enumerate(letters):
        place = f"{graph.low[a, 0]:g},{graph.low[a, 1]:g}"
        if place in places:
            found.append(f"Row {name}: the position {place!r} is also that of row {places[place]}.")
        places.setdefault(place, name)
    total = float(graph.area.sum())
    if abs(total - 1) > 0.01:
        found.append(f"All rows: the shares of the area add up to {total:.3g} instead of 1.")
    return found
