"""What a bench measures, and how it is printed."""

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal


@dataclass(frozen=True)
class Options:
    """What a bench may use."""

    data: Path | None = None  # folder with the authors' tables; figures that need it are left out without it
    cad: Path | None = None  # folder with CAD files, the same
    checkout: Path | None = None  # a checkout of the authors' published code, for ratios against it
    out: Path | None = None  # folder for pictures and tables
    quick: bool = False  # smaller doses, for tests
    reference_command: str | None = None  # what solves one tool in the checkout
    reference_tool: str | None = None  # "real/8": which of the authors' tables that is


@dataclass(frozen=True)
class Figure:
    """One measured value."""

    group: str  # "exact", "noise", ...
    name: str  # "N = 12, one solve"
    value: float
    unit: str = ""
    bar: float | None = None
    sense: Literal["at most", "at least"] = "at most"
    note: str = ""  # what was compared with, why it is missed

    @property
    def met(self) -> bool | None:
        """Whether the bar is met; None without a bar."""
        if self.bar is None:
            return None
        return bool(self.value <= self.bar if self.sense == "at most" else self.value >= self.bar)

    @property
    def ratio(self) -> float | None:
        """value / bar."""
        return self.value / self.bar if self.bar else None


def as_line(figure: Figure) -> str:
    """A figure as one printed line."""
    verdict = {None: "      ", True: "ok    ", False: "MISSED"}[figure.met]
    bar = "" if figure.bar is None else f"{figure.sense} {figure.bar:.4g}"
    ratio = "" if figure.ratio is None else f"x{figure.ratio:.3g}"
    return f"{verdict} {figure.name:58s} {figure.value:>11.4g} {figure.unit:7s} {bar:>18s} {ratio:>8s}  {figure.note}".rstrip()


def grouped(figures: Iterator[Figure]) -> Iterator[str]:
    """Lines with a heading wherever the group changes."""
    group = None
    for figure in figures:
        if figure.group != group:
            group = figure.group
            yield f"\n{group}"
        yield as_line(figure)


def as_json(figures: list[Figure]) -> list[dict[str, Any]]:
    """Figures for --json."""
    return [asdict(f) | {"met": f.met} for f in figures]
