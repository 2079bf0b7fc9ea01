"""What a scene looks like: colour, label and outline of every region. Pure; `scene.py` puts it on the screen."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from app.viewer.palette import Rgb, faded, mixed, ramp, rgb, theme

Outline = Literal["current", "differs", "conflict", "selected", "hover"]
PAINT_SOFTENED = 0.45  # share of the surface colour in what the CAD file paints
SELECTED_SHARE = 0.45  # of the signal colour in a selected region


@dataclass(frozen=True)
class RegionLook:
    """One region on the screen."""

    colour: Rgb
    text: str
    plate: bool  # a number on a white plate; otherwise the text is printed on the surface
    outline: Outline | None = None
    visible: bool = True


@dataclass(frozen=True)
class Picture:
    """Everything on the part that changes while its shape stays."""

    dark: bool
    regions: tuple[RegionLook, ...]


@dataclass(frozen=True)
class Progress:
    """How far an order is worked off in the view."""

    sequence: tuple[int, ...] = ()
    done: int = 0  # regions of the sequence that are done
    current: int | None = None  # region at hand
    differs: frozenset[int] = frozenset()  # when not empty, all other regions are faded
    highlight: frozenset[int] = frozenset()
    troubled: frozenset[int] = frozenset()  # regions the robot has problems with
    selected: frozenset[int] = frozenset()  # while regions are edited
    hover: int | None = None  # region under the pointer
    locked: frozenset[int] = frozenset()
    hidden: frozenset[int] = frozenset()
    painted: tuple[Rgb | None, ...] = ()  # by the CAD file; empty: tints tell regions apart


def paint(progress: Progress, names: Sequence[str], tints: Sequence[int], dark: bool) -> Picture:
    """The picture of a tool with regions `names`, whose undone regions take the tints of the given numbers."""
    colours, place = (
        ramp(max(len(names), len(progress.sequence)), dark),
        {region: k for k, region in enumerate(progress.sequence[: progress.done])},
    )
    tint = theme(dark).region_tints
    looks: list[RegionLook] = []
    for region, name in enumerate(names):
        step = place.get(region)
        colour = _ground(progress.painted[region], dark) if progress.painted else rgb(tint[tints[region] % len(tint)])
        if step is not None:
            colour = colours[step]
        if region in progress.locked:
            colour = rgb(theme(dark).body)
        if region in progress.selected:
            colour = mixed(colour, rgb(theme(dark).current), SELECTED_SHARE)
        quiet = bool(progress.differs) and region not in progress.differs
        looks.append(
            RegionLook(
                colour=faded(colour, dark) if quiet else colour,
                text=_text(name, step, region in progress.locked),
                plate=step is not None and not quiet,
                outline=_outline(region, progress),
                visible=region not in progress.hidden,
            )
        )
    return Picture(dark, tuple(looks))


def _ground(painted: Rgb | None, dark: bool) -> Rgb:
    """A CAD colour, softened so that the letter on it can be read; what has none looks like the body."""
    return rgb(theme(dark).body) if painted is None else mixed(painted, rgb(theme(dark).surface), PAINT_SOFTENED)


def _outline(region: int, progress: Progress) -> Outline | None:
    if region in progress.differs or region in progress.highlight:
        return "differs"
    if region == progress.current and not progress.differs:
        return "current"
    if region in progress.selected:
        return "selected"
    if region == progress.hover:
        return "hover"
    return "conflict" if region in progress.troubled else None


def _text(name: str, step: int | None, locked: bool) -> str:
    if step is not None:
        return str(step + 1)
    return f"{name} locked" if locked else name


def sequence_progress(sequence: Sequence[int], step: int | None, differs: Sequence[int] = (), highlight: Sequence[int] = ()) -> Progress:
    """An order after `step` regions (None: all), whose last done region is the current one unless all are shown."""
    done = len(sequence) if step is None else max(0, min(step, len(sequence)))
    current = sequence[done - 1] if step is not None and done else None
    return Progress(tuple(sequence), done, current, frozenset(differs), frozenset(highlight))


def draft_progress(sequence: Sequence[int], highlight: Sequence[int] = ()) -> Progress:
    """An order being recorded: the region clicked last is the current one."""
    return Progress(tuple(sequence), len(sequence), sequence[-1] if sequence else None, highlight=frozenset(highlight))
