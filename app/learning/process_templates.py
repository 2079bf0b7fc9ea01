"""Named starting points for a kind of work: which features count, which interactions are suspected, how levels are made.

A template fixes no weights; those are learned. It keeps features away that the work gives no reason for, because every feature
that could matter asks for demonstrations that show whether it does.
"""

from dataclasses import dataclass
from typing import Literal

from app.sequencing.features import DEFAULT_INTERACTIONS, Interaction

LevelRule = Literal["quantile", "range"]


@dataclass(frozen=True)
class ProcessTemplate:
    """What a project of this kind of work starts from."""

    key: str
    name: str
    why: str  # one or two sentences for the engineer
    without: tuple[str, ...]  # factors of the feature set that are switched off
    interactions: tuple[Interaction, ...]
    levels: LevelRule


BUILT_IN = (
    ProcessTemplate(
        "layup",
        "Composite layup",
        "A ply bridges over corners and wrinkles on double curvature, so what matters is where a region lies between finished ones, "
        "and height and turn together with curvature. All features count, as in the paper.",
        (),
        DEFAULT_INTERACTIONS,
        "quantile",
    ),
    ProcessTemplate(
        "finishing",
        "Surface finishing",
        "Sanding and polishing leave no material that later regions lean on: jumps cost time and turns change the grip, "
        "borders need an even blend. Height has no say of its own, and an edge that faces another one is left out.",
        ("height", "opposite_unfinished", "opposite_finished"),
        (Interaction("orientation", "curvature"), Interaction("jump", "curvature")),
        "quantile",
    ),
    ProcessTemplate(
        "spraying",
        "Spraying",
        "Overspray and drips fall on what lies below, and a wet edge must be met before it dries: height, borders and gaps count. "
        "The gun turns freely in the air, so turning towards neighbours has no say of its own.",
        ("orientation",),
        (Interaction("height", "curvature"), Interaction("height", "jump")),
        "range",
    ),
)


def template_of(key: str) -> ProcessTemplate | None:
    """The built-in template with this key."""
    return next((t for t in BUILT_IN if t.key == key), None)
