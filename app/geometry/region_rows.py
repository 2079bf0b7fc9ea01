"""Rows and cells of a region table, read with the row, column and value named in every complaint."""

import re
from dataclasses import dataclass
from typing import Literal, NoReturn

from app.errors import MalformedTable
from app.geometry.table_text import DELIMITERS, delimiter_of, entries, number, plain, split_lines

Layout = Literal["synthetic", "real", "apprentice"]
AuthorsLayout = Literal["synthetic", "real"]
MOST_ROWS = 200
LEAST_KNOWN = 0.5  # share of a layout's columns that a header must name
MOST_SURPLUS = 3  # cells beyond the header; with more, lists have lost their quotes

# key -> the header it has in the authors' files
_COLUMNS: dict[AuthorsLayout, dict[str, str]] = {
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
# columns that can be done without, and what is read instead
_OPTIONAL = {
    "tool_size": "", "sequence": "", "corners": "no region has corner neighbours",
    "index": "rows and columns are worked out from the neighbours", "size": "sizes are taken from the corner points",
}  # fmt: skip
_ALIASES = {"zmax": ("zheight", "heightmax", "maxz", "height"), "solution": ("userpreferredsequence", "expertsequence", "sequence")}


@dataclass(frozen=True)
class Row:
    """One line of the table: a region."""

    number: int  # line in the file, counting from 1
    letter: str  # lower case
    cells: dict[str, str]  # key -> text, stripped
    headers: dict[str, str]  # key -> the column's name
    odd: list[str]  # collects sentences about what was read in spite of its form

    def refuse(self, key: str, why: str) -> NoReturn:
        """Raise MalformedTable naming this row, the column and the value."""
        value = self.cells[key]
        where = f"Row {self.letter} (line {self.number}), column '{self.headers[key]}'"
        raise MalformedTable(f"{where}: {f'{value!r} ' if value else 'the empty cell '}{why}")

    def note(self, key: str, what: str) -> None:
        """Remember what is odd about a cell, once."""
        sentence = f"Row {self.letter}: {self.cells[key]!r} in '{self.headers[key]}' {what}"
        if sentence not in self.odd:
            self.odd.append(sentence)

    def items(self, key: str) -> list[str]:
        """Entries of a list cell; empty ones at the end don't count."""
        return entries(self.cells[key])

    def number_in(self, key: str, entry: str | None = None) -> float:
        """The cell, or one entry of it, as a finite number."""
        text = self.cells[key] if entry is None else entry
        value = number(text)
        if value is None:
            self.refuse(key, f"is not a number{f' at {text!r}' if entry is not None else ''}. Write a number with a point, such as 0.75.")
        if "," in text:
            self.note(key, f"has a decimal comma; read as {value:g}.")
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


def read_rows(text: str, layout: AuthorsLayout | None, file_name: str) -> tuple[AuthorsLayout, list[Row], list[str]]:
    """Split a table into rows of one layout, and sentences about anything in it that is odd.

    Raises:
        MalformedTable: Not a table, a column is missing, or the region letters are unusable.
    """
    known = {plain(name) for columns in _COLUMNS.values() for name in columns.values()}
    delimiter = delimiter_of(text, known)
    lines = split_lines(text, delimiter, file_name)
    if not lines:
        raise MalformedTable(f"{file_name} is empty. Expected a header line and one line per region.")
    odd: list[str] = []
    header, body = _header(lines, known, odd)
    layout = layout or _recognise(header, file_name)
    places = _places(header, layout, file_name, odd)
    names = {key: header[place].strip() for key, place in places.items()}
    body = _region_lines(body, header, places["id"], odd)
    rows = [
        Row(line, cells[places["id"]].strip(" '\"").lower(), {k: _cell(cells, p) for k, p in places.items()}, names, odd)
        for line, cells in body
    ]
    if not 1 <= len(rows) <= MOST_ROWS:
        raise MalformedTable(f"{file_name} lists {len(rows)} regions. Expected 1 to {MOST_ROWS}, one per line after the header.")
    return layout, _different(rows), odd


def _header(lines: list[tuple[int, list[str]]], known: set[str], odd: list[str]) -> tuple[list[str], list[tuple[int, list[str]]]]:
    """The line that names the most columns, among the first ten, and the lines after it."""
    best = max(range(min(10, len(lines))), key=lambda k: len({plain(c) for c in lines[k][1]} & known))
    if len({plain(c) for c in lines[best][1]} & known) < 3:
        best = 0
    odd += [f"Line {number}: {','.join(cells)!r} stands above the header; it is left out." for number, cells in lines[:best]]
    return lines[best][1], lines[best + 1 :]


def _region_lines(body: list[tuple[int, list[str]]], header: list[str], place: int, odd: list[str]) -> list[tuple[int, list[str]]]:
    """The lines that name a region."""
    kept = []
    for line, cells in body:
        if not _cell(cells, place):
            odd.append(f"Line {line} names no region; it is left out: {','.join(cells).strip(',')!r}.")
            continue
        surplus = [c for c in cells[len(header) :] if c.strip()]
        if len(surplus) > MOST_SURPLUS:
            raise MalformedTable(
                f"Row {_cell(cells, place).lower()} (line {line}) has {len(cells)} cells for {len(header)} columns. "
                'Put every list in double quotes, such as "O,x,b,x,c,x,O".'
            )
        if surplus:
            name = _cell(cells, place).lower()
            odd.append(f"Row {name}: the line has {len(cells)} cells for {len(header)} columns; the last ones are left out.")
        kept.append((line, cells))
    return kept


def _cell(cells: list[str], place: int) -> str:
    return cells[place].strip() if place < len(cells) else ""


def _recognise(header: list[str], file_name: str) -> AuthorsLayout:
    """The layout whose columns the header names best."""
    names = {plain(h) for h in header}
    shares: dict[AuthorsLayout, float] = {
        layout: len(names & {plain(c) for c in columns.values()}) / len(columns) for layout, columns in _COLUMNS.items()
    }
    best = max(shares, key=lambda layout: shares[layout])
    if shares[best] < LEAST_KNOWN:
        known = "; ".join(", ".join(columns.values()) for columns in _COLUMNS.values())
        raise MalformedTable(
            f"{file_name}: the header {','.join(header)!r} is not that of a region table. Expected one of: {known}; "
            "or the product's own layout, see the template."
        )
    return best


def _places(header: list[str], layout: AuthorsLayout, file_name: str, odd: list[str]) -> dict[str, int]:
    """Where each column stands; a name with a typing mistake is taken for the column it resembles."""
    there = [plain(h) for h in header]
    known = {plain(name) for name in _COLUMNS[layout].values()}
    places = {}
    for key, name in _COLUMNS[layout].items():
        wanted = plain(name)
        names = (wanted, *_ALIASES.get(wanted, ()))
        found = [there.index(n) for n in names if n in there]
        close = [k for k, h in enumerate(there) if h not in known and _slip(h, wanted)]
        if found:
            places[key] = found[0]
        elif len(close) == 1:
            places[key] = close[0]
            odd.append(f"The header: {header[close[0]]!r} is read as the column '{name}'.")
        elif _OPTIONAL.get(key):
            odd.append(f"The header has no column '{name}': {_OPTIONAL[key]}.")
    missing = [name for key, name in _COLUMNS[layout].items() if key not in places and key not in _OPTIONAL]
    if missing and sum(key in places for key in _COLUMNS[layout]) < LEAST_KNOWN * len(_COLUMNS[layout]):
        needed = ", ".join(_COLUMNS[layout].values())
        raise MalformedTable(f"{file_name}: the header {','.join(header)!r} is not that of a {layout} table, which needs: {needed}.")
    if missing:
        needed = ", ".join(_COLUMNS[layout].values())
        raise MalformedTable(f"{file_name}: the header has no column '{missing[0]}'. A {layout} table needs: {needed}.")
    return places


def _slip(name: str, wanted: str) -> bool:
    """Whether a name differs by one or two letters from the one that is wanted (neighbors, neighbours, neigbors)."""
    if len(wanted) < 5 or abs(len(name) - len(wanted)) > 2:
        return False
    before = list(range(len(wanted) + 1))
    for i, c in enumerate(name, start=1):
        row = [i]
        for j, d in enumerate(wanted, start=1):
            row.append(min(before[j] + 1, row[-1] + 1, before[j - 1] + (c != d)))
        before = row
    return before[-1] <= 2


def _different(rows: list[Row]) -> list[Row]:
    """The rows without literal repetitions; every region has one row."""
    seen: dict[str, Row] = {}
    for row in rows:
        if not re.fullmatch(r"\w+", row.letter) or row.letter == "x":
            row.refuse("id", "can't name a region. Name regions a, b, c, ... (x separates sides).")
        first = seen.get(row.letter)
        if first is not None and first.cells != row.cells:
            row.refuse("id", f"names a region twice; line {first.number} has it already. Every region needs its own line.")
        if first is not None:
            row.odd.append(f"Row {row.letter}: line {row.number} repeats line {first.number}; it is left out.")
        seen.setdefault(row.letter, row)
    return list(seen.values())


def words_of_delimiter(text: str) -> str | None:
    """A sentence if something else than commas separates the columns."""
    known = {plain(name) for columns in _COLUMNS.values() for name in columns.values()}
    delimiter = delimiter_of(text, known)
    return None if delimiter == "," else f"The columns are separated by {DELIMITERS[delimiter]}."
