"""What the import of a file has to ask: its units, which way is up, and which of its bodies becomes the tool."""

from collections.abc import Sequence
from typing import Any

from app.errors import InvalidInput
from app.geometry.cleaning_report import METRES, lines_about_bodies, size_hint, size_words
from app.geometry.importing import UP, bodies_extents
from app.geometry.parsed import ALL, ParsedFile
from app.storage.tables import ToolRow

Json = dict[str, Any]

LIKELY_MM = 10.0  # a part whose longest side is a smaller number is probably not written in millimetres


def to_ask(parsed: ParsedFile, units: str | None, up: str | None, body: str | None) -> Json:
    """The questions that neither the file nor the caller answers; each null where nothing is to be asked."""
    extents = bodies_extents(parsed, body)
    number = parsed.chosen(body)[0]
    several = len(parsed.bodies) > 1 and body is None
    return {
        "units": None if units or parsed.units else _units(extents),
        "up": None if up else {"choices": list(UP), "guess": parsed.bodies[number].up_guess},
        "body": _bodies(parsed, units or parsed.units) if several else None,
    }


def still_open(row: ToolRow) -> Json | None:
    """The questions of a tool that have no answer yet; None when all have."""
    questions = row.questions or {}
    answers = {"units": row.units, "up": row.up, "body": row.body}
    asked = {key: questions.get(key) if answers[key] is None else None for key in answers}
    return asked if any(asked.values()) else None


def check_body(row: ToolRow, body: str | None) -> None:
    """Refuse a body the file doesn't have."""
    known = [entry["id"] for entry in row.bodies or []]
    if body is not None and body not in (*known, ALL):
        raise InvalidInput(f"The file of {row.name} has {len(known)} bodies; there is no body {body}. Choose one of its bodies, or {ALL}.")


def bodies_json(parsed: ParsedFile) -> list[Json]:
    """The bodies of a file, largest first."""
    return [
        {"id": str(k), "name": body.name, "extents": list(body.extents), "faces": body.faces, "up_guess": body.up_guess}
        for k, body in enumerate(parsed.bodies, start=1)
    ]


def notes(parsed: ParsedFile) -> list[dict[str, str]]:
    """What is known to be left out before anything is chosen."""
    every = list(range(len(parsed.bodies)))
    return [{"level": level, "text": text} for level, text in lines_about_bodies(parsed, every) if level != "info"]


def _units(extents: Sequence[float]) -> Json:
    sizes = [{"unit": unit, "size": size_words(extents, unit), "hint": size_hint(extents, unit)} for unit in METRES]
    guess = "mm" if max(extents) >= LIKELY_MM else "m"
    return {"choices": list(METRES), "guess": guess, "extents": [float(e) for e in extents], "sizes": sizes}


def _bodies(parsed: ParsedFile, units: str | None) -> Json:
    """Every body, and all of them together."""
    together = bodies_extents(parsed, ALL)
    faces = sum(body.faces for body in parsed.bodies)
    whole = {"id": ALL, "name": f"All {len(parsed.bodies)} bodies", "extents": list(together), "faces": faces}
    choices = [*bodies_json(parsed), {**whole, "up_guess": parsed.bodies[0].up_guess}]
    return {
        "choices": [{**choice, "size": size_words(choice["extents"], units) if units else None} for choice in choices],
        "guess": parsed.guess,
    }
