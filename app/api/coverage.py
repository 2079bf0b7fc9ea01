"""Coverage: how much of the suspected interactions the demonstrations show."""

from typing import Annotated, Literal

from fastapi import APIRouter, Response
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
    request: str | None


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
    """A demonstration that would help."""

    text: str
    tool_id: str | None
    tool_name: str | None
    regions: list[int]
    gain: float  # rise of rho by the best of a few orders
    expected: float  # change of rho, mean over these orders


class Threshold(Row):
    """Where a feature's middle level begins and ends."""

    feature: str
    low: float
    high: float
    rule: Literal["quantile", "range", "expert"]


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
