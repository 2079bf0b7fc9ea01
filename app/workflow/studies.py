"""Study reports in `<data>/studies`: one folder each, as `apprentice study NAME --out FOLDER` saves them."""

import json
import re
from pathlib import Path
from typing import Any

from app.errors import NotFound
from app.workflow.context import Context

Json = dict[str, Any]

REPORT = "report.json"
PLAIN = re.compile(r"[A-Za-z0-9][A-Za-z0-9 _-]{0,79}")  # names of folders and plots that are shown
LARGEST = 20_000_000  # bytes of a report or plot


def studies_folder(ctx: Context) -> Path:
    """Where the page looks for reports."""
    return ctx.settings.data.absolute() / "studies"


def list_studies(ctx: Context) -> list[Json]:
    """The reports, newest first, without their tables."""
    place = studies_folder(ctx)
    folders = sorted(place.iterdir()) if place.is_dir() else []
    rows = [_described(folder) for folder in folders if PLAIN.fullmatch(folder.name) and _inside(place, folder / REPORT)]
    return sorted(rows, key=lambda row: row["made_at"] or "", reverse=True)


def get_study(ctx: Context, name: str) -> Json:
    """One report with its tables.

    Raises:
        NotFound: There is none of this name.
    """
    folder = _folder(ctx, name)
    report, _ = _read(folder / REPORT)
    return {**_described(folder), "tables": [_table(table) for table in report["tables"]] if report else []}


def plot_file(ctx: Context, name: str, plot: str) -> Path:
    """The SVG file of a plot.

    Raises:
        NotFound: The study has no such plot.
    """
    folder = _folder(ctx, name)
    file = folder / f"{plot}.svg"
    if not PLAIN.fullmatch(plot) or not _inside(folder, file):
        raise NotFound(f"The study {name!r} has no plot of this name; it has: {', '.join(_plots(folder)) or 'none'}.")
    return file


def _folder(ctx: Context, name: str) -> Path:
    place = studies_folder(ctx)
    folder = place / name
    if not PLAIN.fullmatch(name) or not _inside(place, folder / REPORT):
        raise NotFound(f"There is no study of this name in {place}. `apprentice study coverage --out {place / 'coverage'}` makes one.")
    return folder


def _inside(place: Path, file: Path) -> bool:
    """A file of bearable size, really within `place`: links to elsewhere are not followed."""
    return file.is_file() and file.resolve().is_relative_to(place.resolve()) and file.stat().st_size <= LARGEST


def _plots(folder: Path) -> list[str]:
    return sorted(file.stem for file in folder.glob("*.svg") if PLAIN.fullmatch(file.stem) and _inside(folder, file))


def _described(folder: Path) -> Json:
    report, fault = _read(folder / REPORT)
    shown = report or {"study": folder.name, "title": folder.name, "command": None, "made_at": None, "tables": []}
    return {
        "id": folder.name,
        "name": folder.name,
        **{key: shown[key] for key in ("study", "title", "command", "made_at")},
        "table_count": len(shown["tables"]),
        "plots": _plots(folder),
        "fault": fault,
    }


def _read(file: Path) -> tuple[Json | None, str | None]:
    """The report, or what is wrong with it."""
    try:
        report = json.loads(file.read_text(encoding="utf-8"), parse_constant=_refuse)
    except (OSError, ValueError):
        return None, f"{file.name} is not readable JSON; run the study again."
    texts = ("study", "title", "command", "made_at")
    if not isinstance(report, dict) or not all(isinstance(report.get(key), str) for key in texts) or not _tables_fit(report.get("tables")):
        return None, f"{file.name} does not hold {', '.join(texts)} and tables; run the study again."
    return report, None


def _refuse(word: str) -> None:
    raise ValueError(f"{word} is no JSON")


def _tables_fit(tables: Any) -> bool:
    """Tables with a title, named columns and rows of that many plain values."""
    if not isinstance(tables, list):
        return False
    for table in tables:
        if not isinstance(table, dict) or not isinstance(table.get("title"), str) or not isinstance(table.get("note", ""), str):
            return False
        columns, rows = table.get("columns"), table.get("rows")
        if not isinstance(columns, list) or not all(isinstance(c, str) for c in columns) or not isinstance(rows, list):
            return False
        if not all(isinstance(row, list) and len(row) == len(columns) and all(_plain(x) for x in row) for row in rows):
            return False
    return True


def _plain(value: Any) -> bool:
    return value is None or isinstance(value, (str, int, float))


def _table(table: Json) -> Json:
    return {"title": table["title"], "columns": table["columns"], "rows": table["rows"], "note": table.get("note", "")}
