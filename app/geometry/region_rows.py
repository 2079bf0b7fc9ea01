"""Rows and cells of a region table, read with the row, column and value named in every complaint."""

import csv
import math
from dataclasses import dataclass
from typing import Literal, NoReturn

from app.errors import MalformedTable

Layout = Literal["synthetic", "real"]
MOST_ROWS = 200

# key -> the header it has in the authors' files
_COLUMNS: dict[Layout, dict[str, str]] = {
    "synthetic": {
        "id": "region_id", "size": "region_dims", "neighbours": "edgewise_region_neighbors", "lengths": "neighbor_edge_dim",
        "turn": "region_angles", "outline": "corner_coords", "corners": "corner_regions", "curvature": "max_curvature",
        "height": "z_max", "tool_size": "mold_dimensions", "sequence": "user_preferred_sequence",
    },
    "real": {
        "id": "Region", "curvature": "Curvature avg", "neighbours": "neighbors", "angles": "neighbor angles",
        "lengths": "neighbor edges", "area": "Area/total area", "height": "Z max", "corners": "Corner Neighbors",
        "index": "region index", "sequence": "solution",
    },
}  # fmt: skip
_OPTIONAL = {"tool_size", "sequence"}


@dataclass(frozen=True)
class Row:
    """One line of the table: a region."""

    number: int  # line in the file, counting from 1
    letter: str  # lower case
    cells: dict[str, str]  # key -> text, stripped
    headers: dict[str, str]  # key -> the column's name

    def refuse(self, key: str, why: str) -> NoReturn:
        """Raise MalformedTable naming this row, the column and the value."""
        value = self.cells[key]
        where = f"Row {self.letter} (line {self.number}), column '{self.headers[key]}'"
        raise MalformedTable(f"{where}: {f'{value!r} ' if value else 'the empty cell '}{why}")

    def items(self, key: str) -> list[str]:
        """Entries of a cell separated by commas; empty ones at the end don't count."""
        entries = [e.strip() for e in self.cells[key].split(",")]
        while entries and not entries[-1]:
            entries.pop()
        return entries

    def number_in(self, key: str, entry: str | None = None) -> float:
        """The cell, or one entry of it, as a finite number."""
        text = self.cells[key] if entry is None else entry
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            self.refuse(key, f"is not a number{f' at {text!r}' if entry is not None else ''}. Write a number with a point, such as 0.75.")
        return value

    def numbers(self, key: str) -> list[float]:
        """All entries of a cell as numbers."""
        return [self.number_in(key, entry) for entry in self.items(key)]

    def pair(self, key: str) -> tuple[float, float]:
        """A cell of exactly two numbers."""
        values = self.numbers(key)
        if len(values) != 2:
            self.refuse(key, "does not hold two numbers. Write two numbers with a comma between, such as 1.5,8.")
        return values[0], values[1]


def read_rows(text: str, layout: Layout | None, file_name: str) -> tuple[Layout, list[Row], list[str]]:
    """Split a table into rows of one layout, and sentences about anything outside the rows that is odd.

    Raises:
        MalformedTable: Not a table, a column is missing, or the region letters are unusable.
    """
    lines = _lines(text, file_name)
    if not lines:
        raise MalformedTable(f"{file_name} is empty. Expected a header line and one line per region.")
    (_, header), body = lines[0], lines[1:]
    layout = layout or _recognise(header, file_name)
    places = _places(header, layout, file_name)
    names = {key: header[place] for key, place in places.items()}
    rows = [
        Row(number, cells[places["id"]].strip().lower(), {k: _cell(cells, p) for k, p in places.items()}, names) for number, cells in body
    ]
    if not 1 <= len(rows) <= MOST_ROWS:
        raise MalformedTable(f"{file_name} lists {len(rows)} regions. Expected 1 to {MOST_ROWS}, one per line after the header.")
    _check_letters(rows)
    extra = [
        f"Row {row.letter}: the line has {len(cells)} cells for {len(header)} columns; the last ones are left out."
        for row, (_, cells) in zip(rows, body, strict=True)
        if any(c.strip() for c in cells[len(header) :])
    ]
    return layout, rows, extra


def _lines(text: str, file_name: str) -> list[tuple[int, list[str]]]:
    """Lines that hold anything, with their numbers."""
    if "\0" in text:
        raise MalformedTable(f"{file_name} is not text. Expected a table with commas (CSV).")
    reader = csv.reader(text.lstrip("\ufeff").splitlines(), skipinitialspace=True)
    try:
        return [(reader.line_num, cells) for cells in reader if any(c.strip() for c in cells)]
    except csv.Error as error:
        raise MalformedTable(f"{file_name}, line {reader.line_num}, can't be split into cells: {error}.") from error


def _cell(cells: list[str], place: int) -> str:
    return cells[place].strip() if place < len(cells) else ""


def _plain(name: str) -> str:
    return "".join(c for c in name.lower() if c.isalnum())


def _recognise(header: list[str], file_name: str) -> Layout:
    """The layout whose columns the header names best."""
    names = {_plain(h) for h in header}
    shares: dict[Layout, float] = {
        layout: len(names & {_plain(c) for c in columns.values()}) / len(columns) for layout, columns in _COLUMNS.items()
    }
    best = max(shares, key=lambda layout: shares[layout])
    if shares[best] < 0.5:
        known = "; ".join(", ".join(columns.values()) for columns in _COLUMNS.values())
        raise MalformedTable(f"{file_name}: the header {','.join(header)!r} is not that of a region table. Expected one of: {known}.")
    return best


def _places(header: list[str], layout: Layout, file_name: str) -> dict[str, int]:
    """Where each column stands."""
    there = [_plain(h) for h in header]
    places = {key: there.index(_plain(name)) for key, name in _COLUMNS[layout].items() if _plain(name) in there}
    missing = [name for key, name in _COLUMNS[layout].items() if key not in places and key not in _OPTIONAL]
    if missing:
        needed = ", ".join(_COLUMNS[layout].values())
        raise MalformedTable(f"{file_name}: the header has no column '{missing[0]}'. A {layout} table needs: {needed}.")
    return places


def _check_letters(rows: list[Row]) -> None:
    seen: dict[str, Row] = {}
    for row in rows:
        if not row.letter.isalnum() or row.letter == "x":
            row.refuse("id", "can't name a region. Name regions a, b, c, ... (x separates sides).")
        if row.letter in seen:
            row.refuse("id", f"names a region twice; line {seen[row.letter].number} has it already. Every region needs its own line.")
        seen[row.letter] = row
