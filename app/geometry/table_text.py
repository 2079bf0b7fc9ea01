"""A region table's bytes as text, its lines as cells, and cells as lists, however the program that wrote it does that."""

import csv
import re

from app.errors import MalformedTable

DELIMITERS = {",": "commas", ";": "semicolons", "\t": "tabs", "|": "bars"}
UTF16 = (b"\xff\xfe", b"\xfe\xff")
BRACKETS = "[](){}<> \t'\"`"


def decode_table(content: bytes, file_name: str) -> str:
    """The text of a table: UTF-8, UTF-16 with a byte order mark, or the western code page of old spreadsheets.

    Raises:
        MalformedTable: It is no text.
    """
    encodings = ("utf-16",) if content.startswith(UTF16) else ("utf-8-sig", "cp1252")
    for encoding in encodings:
        try:
            text = content.decode(encoding)
        except UnicodeDecodeError:
            continue
        if not re.search(r"[\x00-\x08\x0e-\x1f]", text):
            return text.replace("\u00a0", " ")  # spreadsheets put it where people typed a space
    raise MalformedTable(f"{file_name} is not text. Expected a region table as CSV or JSON in UTF-8.")


def delimiter_of(text: str, known_columns: set[str]) -> str:
    """What separates the columns: the character at which some early line falls apart into most known column names."""
    early = [line for line in text.splitlines() if line.strip()][:10]

    def columns(delimiter: str) -> int:
        return max((len({plain(c) for c in line.split(delimiter)} & known_columns) for line in early), default=0)

    return max(DELIMITERS, key=columns)


def split_lines(text: str, delimiter: str, file_name: str) -> list[tuple[int, list[str]]]:
    """Lines that hold anything, with their numbers.

    Raises:
        MalformedTable: A line can't be split.
    """
    reader = csv.reader(text.lstrip("\ufeff").splitlines(), skipinitialspace=True, delimiter=delimiter)
    try:
        lines = [(reader.line_num, cells) for cells in reader if any(c.strip() for c in cells)]
    except csv.Error as error:
        raise MalformedTable(f"{file_name}, line {reader.line_num}, can't be split into cells: {error}.") from error
    if lines and len(lines[0][1]) <= 2 and lines[0][1][0].strip().lower().startswith("sep="):
        return lines[1:]  # a spreadsheet's note about its own delimiter
    return lines


def plain(name: str) -> str:
    """A column's name without what people vary: case, spaces, underscores."""
    return "".join(c for c in name.lower() if c.isalnum())


def entries(text: str) -> list[str]:
    """The entries of a list in a cell: `a,b`, `[a, b]`, `a;b`, `a|b`, `'a' 'b'`; empty ones at the end don't count."""
    text = text.strip(BRACKETS)
    separator = next((s for s in (";", "|", ",") if s in text), None)
    parts = [part.strip(BRACKETS) for part in (text.split(separator) if separator else text.split())]
    while parts and not parts[-1]:
        parts.pop()
    return parts


def outline_points(text: str) -> list[list[str]]:
    """'0,0,x,4,0,x,4,2' or '(0,0),(4,0),(4,2)' or '0 0; 4 0; 4 2' -> [['0', '0'], ['4', '0'], ['4', '2']]."""
    text = re.sub(r"\)\s*,?\s*\(|[;|]", "x", text.lower())
    return [entries(part.strip(BRACKETS + ",")) for part in text.split("x")]


def number(text: str) -> float | None:
    """A finite number, with point or decimal comma; None if it is none."""
    text = text.strip().replace("\u2212", "-")
    if re.fullmatch(r"[-+]?\d*,\d+", text):
        text = text.replace(",", ".")
    if not re.fullmatch(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d{1,3})?", text):
        return None
    value = float(text)
    return value if abs(value) < 1e12 else None
