"""The findings about an imported part in sentences an engineer can act on: repaired, left out, suspicious, or fine."""

from collections import Counter
from collections.abc import Sequence

from app.geometry.cad_faces import CadFace
from app.geometry.cleaning import Findings, Level
from app.geometry.parsed import ParsedFile

METRES = {"mm": 1e-3, "cm": 1e-2, "m": 1.0, "in": 0.0254}
SMALLEST, LARGEST = 0.005, 20.0  # m; a part whose longest side is outside is reported, the units are probably wrong
Line = tuple[Level, str]


def length_words(metres: float) -> str:
    """'2.4 km', '120 mm'."""
    for factor, unit in ((1e-3, "km"), (1.0, "m"), (1e3, "mm")):
        if metres * factor >= 1:
            return f"{metres * factor:,.4g} {unit}" if metres * factor < 1e4 else f"{metres * factor:,.0f} {unit}"
    return f"{metres * 1e3:.2g} mm"


def size_words(extents: Sequence[float], units: str) -> str:
    """'120 × 80 × 32 mm': what the part measures if the file is written in this unit; metres from one metre on."""
    metres = [e * METRES[units] for e in extents]
    large = max(metres) >= 1
    return " × ".join(f"{m if large else 1000 * m:,.4g}" for m in metres) + (" m" if large else " mm")


def size_hint(extents: Sequence[float], units: str) -> str | None:
    """A warning where the unit makes the part unbelievably large or small."""
    longest = max(extents) * METRES[units]
    if SMALLEST <= longest <= LARGEST:
        return None
    return f"this would make the part {length_words(longest)} long"


def report_lines(findings: Sequence[Findings], units: str) -> list[Line]:
    """What was done to the bodies and what looks wrong, over all bodies."""
    total = {name: sum(getattr(f, name) for f in findings) for name in ("joined", "flat", "doubled", "turned", "inside_out", "crowded")}
    lines = _repairs(total, len(findings))
    lines += _suspicions(findings, total["crowded"], units)
    fine = [
        words
        for words, bad in (
            ("triangles without area", total["flat"]),
            ("doubled triangles", total["doubled"]),
            ("triangles facing the wrong way", total["turned"] or total["inside_out"] or any(f.one_sided for f in findings)),
            ("edges with more than two triangles", total["crowded"]),
            ("holes", not all(f.closed for f in findings)),
        )
        if not bad
    ]
    if all(f.closed for f in findings):
        lines.append(("info", "The surface is closed." if len(findings) == 1 else "All bodies are closed."))
    if fine:
        lines.append(("info", f"Looked for and not found: {', '.join(fine)}."))
    return lines


def _repairs(total: dict[str, int], bodies: int) -> list[Line]:
    lines: list[Line] = []
    if n := total["joined"]:
        lines.append(("info", f"Joined {_count(n, 'doubled corner point')}."))
    if n := total["flat"]:
        lines.append(("repaired", f"Removed {_count(n, 'triangle')} without area."))
    if n := total["doubled"]:
        lines.append(("repaired", f"Removed {_count(n, 'doubled triangle')}."))
    if n := total["turned"]:
        lines.append(("repaired", f"Turned {_count(n, 'triangle')} that faced the wrong way."))
    if n := total["inside_out"]:
        what = "the surface" if bodies == 1 else _count(n, "body", "bodies")
        lines.append(("repaired", f"Turned {what} inside out: all triangles faced inward."))
    return lines


def _suspicions(findings: Sequence[Findings], crowded: int, units: str) -> list[Line]:
    lines: list[Line] = []
    if any(f.one_sided for f in findings):
        lines.append(("warning", "The surface has only one side (like a Moebius strip); inside and outside can't be told apart."))
    if crowded:
        lines.append(("warning", f"{_count(crowded, 'edge is', 'edges are')} shared by more than two triangles; regions end there."))
    borders = sorted((METRES[units] * length for f in findings for length in f.borders), reverse=True)
    if len(borders) == 1:
        lines.append(("warning", f"The surface is open: it has one border or hole, {length_words(borders[0])} long."))
    elif borders:
        lengths = f"the longest is {length_words(borders[0])} long, the shortest {length_words(borders[-1])}"
        lines.append(("warning", f"The surface is open: it has {len(borders):,} borders or holes; {lengths}."))
    return lines


def lines_about_bodies(parsed: ParsedFile, chosen: Sequence[int]) -> list[Line]:
    """Which bodies became the part, what was left out."""
    lines: list[Line] = []
    if len(chosen) > 1:
        lines.append(("info", f"Made of all {len(chosen)} bodies of the file."))
    elif len(parsed.bodies) > 1:
        share = 100 * (1 - parsed.bodies[chosen[0]].area / sum(body.area for body in parsed.bodies))
        one = parsed.bodies[chosen[0]].name
        lines.append(("refused", f"Left out all bodies but {one}, one of {len(parsed.bodies)} ({share:.1f} % of the area)."))
    if parsed.specks:
        lines.append(("refused", f"Left out {_count(parsed.specks, 'tiny separate piece')}."))
    if parsed.skipped:
        lines.append(("refused", f"Left out {_count(parsed.skipped, 'entry that is', 'entries that are')} lines or points, not surfaces."))
    return lines


def line_about_cad_faces(faces: Sequence[CadFace]) -> list[Line]:
    """How much the CAD model says about its faces."""
    if not faces:
        return []
    kinds = Counter(face.kind for face in faces)
    plural = {
        "plane": "planes",
        "cylinder": "cylinders",
        "cone": "cones",
        "sphere": "spheres",
        "torus": "tori",
        "freeform": "freeform faces",
    }
    singular = {kind: "freeform face" if kind == "freeform" else kind for kind in plural}
    told = ", ".join(f"{n} {singular[kind] if n == 1 else plural[kind]}" for kind, n in kinds.most_common())
    colours = len({face.colour for face in faces} - {None})
    painted = f", painted in {_count(colours, 'colour')}" if colours else ""
    return [("info", f"{_count(len(faces), 'CAD face')} kept ({told}){painted}.")]


def _count(n: int, one: str, many: str | None = None) -> str:
    return f"{n:,} {one if n == 1 else many or one + 's'}"
