"""Drafts: the sequence being clicked on a tool, shared with the 3D view."""

from typing import Annotated

from fastapi import APIRouter, Query, Response
from pydantic import Field

from app.api.demonstrations import Demonstration
from app.api.dependencies import Body, Ctx, Json, Name, RegionId, RegionOrder, Row, located
from app.api.idempotency import ActionRoute, IdempotencyKey
from app.workflow import record as workflow

router = APIRouter(prefix="/tools/{tool_id}/draft", tags=["drafts"], route_class=ActionRoute)


class Pick(Body):
    """The region worked on next."""

    region: RegionId


class Order(Body):
    """The whole draft at once."""

    sequence: RegionOrder


class DemonstrationName(Body):
    """How the saved demonstration is called, after the tool if left out; and whose order it is."""

    name: Name | None = None
    author: Annotated[Name | None, Field(description="It takes the place of this author's earlier order of the tool.")] = None


class CoverageGain(Row):
    """What saving this draft would add to rho."""

    before: float
    after: float
    text: str


class OlderDraft(Row):
    """Clicks made before the regions were edited."""

    placed: int
    can_carry_over: bool
    why: str


class Draft(Row):
    """The sequence as far as it is clicked."""

    tool_id: str
    sequence: list[int]
    click_times: Annotated[list[float], Field(description="Seconds since the first click.")]
    can_undo: bool
    can_redo: bool
    complete: bool
    older: OlderDraft | None
    coverage_gain: CoverageGain | None


@router.get("", response_model=Draft)
def get_draft(
    ctx: Ctx, tool_id: str, author: Annotated[str | None, Query(max_length=120, description="For the coverage it would bring.")] = None
) -> Json:
    """The draft; empty before the first click."""
    return workflow.get_draft(ctx, tool_id, author)


@router.put("", response_model=Draft)
def place(ctx: Ctx, tool_id: str, body: Order) -> Json:
    """Replace or reorder the draft in one undoable step."""
    return workflow.place(ctx, tool_id, body.sequence)


@router.post("/pick", response_model=Draft)
def pick(ctx: Ctx, tool_id: str, body: Pick, _key: IdempotencyKey = None) -> Json:
    """Add a region, as a click in the 3D view does."""
    return workflow.pick(ctx, tool_id, body.region)


@router.post("/undo", response_model=Draft)
def undo(ctx: Ctx, tool_id: str, _key: IdempotencyKey = None) -> Json:
    """Take the last step back."""
    return workflow.undo(ctx, tool_id)


@router.post("/redo", response_model=Draft)
def redo(ctx: Ctx, tool_id: str, _key: IdempotencyKey = None) -> Json:
    """Do again what was undone."""
    return workflow.redo(ctx, tool_id)


@router.post("/clear", response_model=Draft)
def clear(ctx: Ctx, tool_id: str, _key: IdempotencyKey = None) -> Json:
    """Empty the draft; undo brings it back."""
    return workflow.clear(ctx, tool_id)


@router.post("/carry-over", response_model=Draft)
def carry_over(ctx: Ctx, tool_id: str, _key: IdempotencyKey = None) -> Json:
    """Go on with the clicks made before the regions were edited."""
    return workflow.carry_over(ctx, tool_id)


@router.post("/save", status_code=201, response_model=Demonstration)
def save(ctx: Ctx, tool_id: str, response: Response, body: DemonstrationName | None = None, _key: IdempotencyKey = None) -> Json:
    """Make a complete draft a demonstration of the tool."""
    about = body or DemonstrationName()
    return located(response, "demonstrations", workflow.save(ctx, tool_id, name=about.name, author=about.author))
