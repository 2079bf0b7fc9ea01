"""The product's own region table: rectangles in plan view with height, curvature and tilt, as CSV or JSON.

Written down in docs/region-tables.md; the templates below are what a person downloads to start from.
"""

import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, NoReturn

import numpy as np

from app.errors import MalformedTable
from app.geometry.cleaning import Level
from app.geometry.own_graph import Box, Neighbour, Side, graph_of
from app.geometry.schematic import drawn
from app.geometry.table_text import DELIMITERS, delimiter_of, entries, number, plain, split_lines
from app.geometry.tool import Tool

SCHEMA = "apprentice-region-table/1"
SIDES: tuple[Side, ...] = ("back", "right", "front", "left")
NEEDED = ("region", "x_mm", "y_mm", "width_mm", "depth_mm", "height_mm", "curvature_per_m")
OPTIONAL = ("name", "tilt_right_deg", "tilt_back_deg", "neighbours", "corners", "sequence")
ABOVE_ZERO = ("width_mm", "depth_mm")
MOST_REGIONS = 200
STEEPEST = 89  # degrees
BENDS = (-0.05, 0.05)  # scaled curvatures called inwards, outwards

TEMPLATE_CSV = """region,name,x_mm,y_mm,width_mm,depth_mm,height_mm,curvature_per_m,tilt_right_deg,tilt_back_deg,neighbours,corners,sequence
a,Back left,0,200,400,300,60,-2,0,20,right:b:300 front:c:400,d,"b,a,d,c"
b,Back right,400,200,200,300,70,0,0,20,left:a:300 front:d:200,c,
c,Front left,0,0,400,200,20,0,0,0,right:d:200 back:a:400,b,
d,Front right,400,0,200,200,30,4,10,0,,,
"""


@dataclass(frozen=True)
class OwnTable:
    """What was read from a table in the product's own layout."""

    tool: Tool
    expert: tuple[int, ...] | None
    lines: tuple[tuple[Level, str], ...]


@dataclass(frozen=True)
class _Line:
    """One region's entries before they are checked."""

    where: str  # "Row a (line 2)"
    values: Mapping[str, Any]  # column -> text (CSV) or value (JSON)

    def refuse(self, column: str, why: str) -> NoReturn:
        """Raise MalformedTable naming row, column and value."""
        value = self.values.get(column)
        shown = "the empty entry" if value in (None, "") else repr(value)
        raise MalformedTable(f"{self.where}, column '{column}': {shown} {why}")

    def number(self, column: str, default: float | None = None) -> float:
        """A finite number."""
        value = self.values.get(column)
        if value in (None, "") and default is not None:
            return default
        read = value if isinstance(value, int | float) and not isinstance(value, bool) else number(str(value or ""))
        if read is None or not np.isfinite(read) or abs(read) > 1e9:
            self.refuse(column, "is not a number. Write a number with a point, such as 12.5.")
        return float(read)


def is_own_table(text: str) -> bool:
    """Whether a text is JSON, or CSV with the columns of this layout."""
    if text.lstrip("\ufeff \t\r\n").startswith(("{", "[")):
        return True
    names = {plain(name) for name in (*NEEDED, *OPTIONAL)}
    delimiter = delimiter_of(text, names)
    header = next((line for line in text.splitlines() if line.strip()), "")
    return len({plain(cell) for cell in header.split(delimiter)} & {plain(name) for name in NEEDED}) >= 4


def template_json() -> str:
    """The template as JSON: the same tool as the CSV one."""
    regions = []
    for line in _csv_lines(TEMPLATE_CSV, "template", []):
        region: dict[str, Any] = {"region": line.values["region"], "name": line.values["name"]}
        region |= {column: line.number(column) for column in (*NEEDED[1:], "tilt_right_deg", "tilt_back_deg")}
        if line.values["neighbours"]:
            parts = [entry.split(":") for entry in line.values["neighbours"].split()]
            region["neighbours"] = [{"side": side, "region": other, "length_mm": float(length)} for side, other, length in parts]
        if line.values["corners"]:
            region["corners"] = line.values["corners"].split(",")
        regions.append(region)
    return json.dumps({"schema": SCHEMA, "regions": regions, "sequence": ["b", "a", "d", "c"]}, indent=2) + "\n"


def read_own_table(text: str, file_name: str = "The table") -> OwnTable:
    """Read a table in the product's own layout.

    Raises:
        MalformedTable: Names row, column and value, and what would be accepted.
    """
    lines: list[tuple[Level, str]] = []
    if text.lstrip("\ufeff \t\r\n").startswith(("{", "[")):
        rows, sequence = _json_lines(text, file_name, lines)
    else:
        rows = list(_csv_lines(text, file_name, lines))
        sequence = [row.values["sequence"] for row in rows if row.values.get("sequence")]
    if not 1 <= len(rows) <= MOST_REGIONS:
        raise MalformedTable(f"{file_name} lists {len(rows)} regions. Expected 1 to {MOST_REGIONS}.")
    ids = _ids(rows)
    boxes = [_box(row, ids) for row in rows]
    graph, found = graph_of(boxes)
    lines.extend(("warning", sentence) for sentence in found)
    expert = _expert(sequence, ids, lines)
    low = np.array([[b.x, -b.y - b.depth] for b in boxes])
    high = np.array([[b.x + b.width, -b.y] for b in boxes])
    names = [str(row.values.get("name") or box.id.upper())[:40] for row, box in zip(rows, boxes, strict=True)]
    if len(set(names)) < len(names):
        names = [box.id.upper() for box in boxes]
        lines.append(("repaired", "Some regions have the same name; they are called by their ids instead."))
    return OwnTable(drawn(graph, names, low, high, BENDS), expert, tuple(lines))


def _csv_lines(text: str, file_name: str, lines: list[tuple[Level, str]]) -> Iterator[_Line]:
    names = {plain(name): name for name in (*NEEDED, *OPTIONAL)}
    delimiter = delimiter_of(text, set(names))
    if delimiter != ",":
        lines.append(("info", f"The columns are separated by {DELIMITERS[delimiter]}."))
    table = split_lines(text, delimiter, file_name)
    if not table:
        raise MalformedTable(f"{file_name} is empty. Expected a header line and one line per region.")
    header = [names.get(plain(cell), cell.strip()) for cell in table[0][1]]
    missing = [name for name in NEEDED if name not in header]
    if missing:
        raise MalformedTable(f"{file_name}: the header has no column '{missing[0]}'. Needed are: {', '.join(NEEDED)}.")
    unknown = [name for name in header if name and name not in names.values()]
    if unknown:
        lines.append(("repaired", f"The header: the columns {', '.join(map(repr, unknown))} are not known and left out."))
    for line, cells in table[1:]:
        values = {name: cell.strip() for name, cell in zip(header, cells, strict=False)}
        if not values.get("region"):
            lines.append(("repaired", f"Line {line} names no region; it is left out: {delimiter.join(cells).strip(delimiter)!r}."))
            continue
        if any(cell.strip() for cell in cells[len(header) :]):
            raise MalformedTable(
                f"Row {values['region']} (line {line}) has {len(cells)} cells for {len(header)} columns. "
                'Put every list in double quotes, such as "b,a,d,c".'
            )
        yield _Line(f"Row {values['region']} (line {line})", values)


def _json_lines(text: str, file_name: str, lines: list[tuple[Level, str]]) -> tuple[list[_Line], list[Any]]:
    try:
        content = json.loads(text.lstrip("\ufeff"))
    except (json.JSONDecodeError, RecursionError) as error:
        where = f" at line {error.lineno}" if isinstance(error, json.JSONDecodeError) else ""
        raise MalformedTable(f"{file_name} is not valid JSON{where}. Expected an object with 'schema' and 'regions'.") from error
    regions = content.get("regions") if isinstance(content, dict) else None
    if not isinstance(regions, list) or not all(isinstance(region, dict) for region in regions):
        raise MalformedTable(f"{file_name} has no list 'regions' of objects. Download the template to see one.")
    if content.get("schema") != SCHEMA:
        lines.append(("warning", f"The schema is {content.get('schema')!r}; read as {SCHEMA!r}."))
    rows = [_Line(f"Region {region.get('region', k + 1)!s:.40} (number {k + 1})", region) for k, region in enumerate(regions)]
    unknown = sorted({str(key)[:40] for region in regions for key in region} - {*NEEDED, *OPTIONAL})
    if unknown:
        lines.append(("repaired", f"The entries {', '.join(map(repr, unknown))} are not known and left out."))
    sequence = content.get("sequence")
    return rows, [] if sequence in (None, []) else [sequence]


def _ids(rows: list[_Line]) -> dict[str, int]:
    ids: dict[str, int] = {}
    for row in rows:
        name = str(row.values.get("region") or "").strip().lower()
        if not re.fullmatch(r"\w{1,20}", name):
            row.refuse("region", "can't name a region. Name regions with letters and digits: a, b, c, ...")
        if name in ids:
            row.refuse("region", "names a region twice. Every region needs its own row.")
        ids[name] = len(ids)
    return ids


def _box(row: _Line, ids: dict[str, int]) -> Box:
    for column in ABOVE_ZERO:
        if row.number(column) <= 0:
            row.refuse(column, "is not above 0. Write a length in millimetres.")
    for column in ("tilt_right_deg", "tilt_back_deg"):
        if abs(row.number(column, 0.0)) > STEEPEST:
            row.refuse(column, f"is no tilt. Write degrees from -{STEEPEST} to {STEEPEST}; positive rises to that side.")
    x, y, width, depth, height = (row.number(column) / 1000 for column in NEEDED[1:6])
    tilt = np.radians([row.number("tilt_right_deg", 0.0), row.number("tilt_back_deg", 0.0)])
    name = str(row.values["region"]).strip().lower()
    corners = row.values.get("corners")
    listed = [_known(row, "corners", str(entry), ids) for entry in _list(row, "corners")] if corners not in (None, "") else None
    return Box(
        name, x, y, width, depth, height, row.number("curvature_per_m"), float(tilt[0]), float(tilt[1]), _neighbours(row, ids),
        None if listed is None else tuple(listed),
    )  # fmt: skip


def _list(row: _Line, column: str) -> list[Any]:
    value = row.values.get(column)
    if isinstance(value, list):
        return value
    return entries(str(value or ""))


def _known(row: _Line, column: str, name: str, ids: dict[str, int]) -> int:
    if name.strip().lower() not in ids:
        row.refuse(column, f"names the region {name!r}, which has no row. Choose from: {', '.join(ids)}.")
    return ids[name.strip().lower()]


def _neighbours(row: _Line, ids: dict[str, int]) -> tuple[Neighbour, ...] | None:
    """`right:b:300:-12 front:c:400`, or a list of objects; None leaves it to the rectangles."""
    value = row.values.get("neighbours")
    if value in (None, "", []):
        return None
    how = "Write side:region:length_mm or side:region:length_mm:angle_deg, such as right:b:300:-12; sides are back, right, front, left."
    found = []
    for entry in value if isinstance(value, list) else re.split(r"[\s;,]+", str(value).strip()):
        if isinstance(entry, dict):
            parts = tuple(entry.get(key) for key in ("side", "region", "length_mm", "angle_deg"))
        else:
            parts = tuple(str(entry).split(":"))
        side, other, length, angle = (*parts, None, None, None, None)[:4]
        read, bend = number(str(length)), None if angle in (None, "") else number(str(angle))
        if side not in SIDES or read is None or read <= 0 or len(parts) > 4 or (angle not in (None, "") and bend is None):
            row.refuse("neighbours", f"can't be read at {str(entry)!r}. {how}")
        b = _known(row, "neighbours", str(other), ids)
        found.append(Neighbour(side, b, read / 1000, None if bend is None else float(np.radians(bend))))  # pyright: ignore[reportArgumentType]
    return tuple(found)


def _expert(given: list[Any], ids: dict[str, int], lines: list[tuple[Level, str]]) -> tuple[int, ...] | None:
    """The sequence; one that misses or repeats regions is left out, and that is said."""
    if not given:
        return None
    if len(given) > 1:
        lines.append(("warning", f"{len(given) - 1} further sequences are left out."))
    names = [str(name).strip().lower() for name in (given[0] if isinstance(given[0], list) else entries(str(given[0])))]
    wrong = [name for name in names if name not in ids] or [name for name in ids if names.count(name) != 1]
    if wrong:
        told = f"The sequence {','.join(names)!r} does not hold every region once (see {', '.join(wrong)})"
        lines.append(("warning", f"{told}; it is left out, so the tool has no demonstration."))
        return None
    return tuple(ids[name] for name in names)
