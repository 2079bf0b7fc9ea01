"""Coverage: how much of the suspected interactions the demonstrations show."""

from typing import Annotated, Literal

from fastapi import APIRouter, Path, Response
from pydantic import Field

from app.api.dependencies import Body, Ctx, Json, Row, tagged
from app.api.idempotency import ActionRoute
from app.api.projects import Project
from app.workflow import coverage as workflow

router = APIRouter(prefix="/projects/{project_id}", tags=["coverage"], route_class=ActionRoute)

FeatureKey = Annotated[str, Field(min_length=1, max_length=60)]


class InteractionChoice(Body):
    """Two factors of the project's `interaction_choices`."""

    first: FeatureKey
    second: FeatureKey


class InteractionChoices(Body):
    """All interactions the expert suspects."""

    interactions: Annotated[list[InteractionChoice], Field(max_length=20)]


class CellTool(Row):
    """A tool that has transitions of a cell."""

    tool_id: str
    name: str
    regions: list[int]


class Cell(Row):
    """One combination of levels."""

    state: Literal["captured", "uneven", "missing", "impossible"]
    count: int
    p_value: float | None
    tools: list[CellTool]
    text: str
    request: str  # what to do about it, empty when captured or on no tool
    need: str  # what a new tool needs to have it


class InteractionTable(Row):
    """The 3x3 table of an interaction."""

    first: str
    second: str
    label: str
    row_title: str
    column_title: str
    row_words: list[str]
    column_words: list[str]
    cells: list[list[Cell]]


class CoverageRequest(Row):
    """What a demonstration of a tool would add."""

    text: str
    tool_id: str | None
    tool_name: str | None
    regions: list[int]
    gain: float  # rise of rho by the best of a few orders
    expected: float  # change of rho, mean over these orders
    useful: bool


class Threshold(Row):
    """Where a feature's middle level begins and ends, and how its values are spread over the project's tools."""

    feature: str
    label: str
    low: float
    high: float
    rule: Literal["quantile", "range", "expert"]
    suspected: bool  # a part of an interaction
    least: float
    most: float
    counts: list[int]  # in equal slices from the least to the most


class LevelChoice(Body):
    """How the levels of a feature are found: thirds of the values, thirds of their range, or thresholds of one's own."""

    rule: Literal["quantile", "range", "expert"]
    low: Annotated[float, Field(allow_inf_nan=False)] | None = None
    high: Annotated[float, Field(allow_inf_nan=False)] | None = None

    @property
    def thresholds(self) -> tuple[float, float] | None:
        """Both, or None."""
        return None if self.low is None or self.high is None else (self.low, self.high)


class Coverage(Row):
    """rho (Eq. 6) and what stands behind it."""

    rho: float | None
    occurrence: float | None  # the same by plain occurrence: shown / possible
    captured: int
    shown: int
    possible: int
    demonstrations: int
    steps: int
    rule: str
    thresholds: list[Threshold]
    tables: list[InteractionTable]
    requests: list[CoverageRequest]


@router.get("/coverage", response_model=Coverage)
def get_coverage(ctx: Ctx, project_id: str) -> Json:
    """The coverage of the current demonstrations."""
    return workflow.get_coverage(ctx, project_id)


@router.put("/interactions", response_model=Project)
def set_interactions(ctx: Ctx, project_id: str, body: InteractionChoices, response: Response) -> Json:
    """Say which feature interactions the expert suspects."""
    return tagged(response, workflow.set_interactions(ctx, project_id, [choice.model_dump() for choice in body.interactions]))


@router.put("/levels/{feature}", response_model=Coverage)
def set_levels(ctx: Ctx, project_id: str, feature: Annotated[str, Path(max_length=60)], body: LevelChoice) -> Json:
    """Say where small values of a feature end and large ones begin."""
    return workflow.set_levels(ctx, project_id, feature, body.rule, body.thresholds)


@router.delete("/levels/{feature}", response_model=Coverage)
def reset_levels(ctx: Ctx, project_id: str, feature: Annotated[str, Path(max_length=60)]) -> Json:
    """Back to the project's usual rule."""
    return workflow.set_levels(ctx, project_id, feature, None)
