"""Demonstrations: complete orders by an expert."""

from typing import Annotated, Literal

from fastapi import APIRouter, Response
from pydantic import Field

from app.api.dependencies import Body, Ctx, Json, Name, Paging, RegionOrder, Row, Version, located, page, tagged
from app.api.idempotency import ActionRoute, IdempotencyKey
from app.workflow import demonstrations as workflow

router = APIRouter(tags=["demonstrations"], route_class=ActionRoute)


class NewDemonstration(Body):
    """An order of all regions of the tool."""

    sequence: RegionOrder
    name: Name | None = None
    author: Name | None = None


class DemonstrationChanges(Body):
    """What may change later; what is left out stays."""

    name: Name | None = None
    author: Annotated[Name | None, Field(description="Whose order it is; null: the project's own expert's.")] = None


class Demonstration(Row):
    """A stored order and the segmentation it was clicked on."""

    id: str
    tool_id: str
    tool_name: str
    name: str
    sequence: list[int]
    click_times: list[float] | None
    author: str | None
    source: Literal["recorded", "table", "scripted", "rest"]
    superseded_by: str | None
    deleted: bool
    segmentation_id: str
    on_current_cut: bool
    can_carry_over: bool
    why: str
    version: int
    created_at: str


class DemonstrationPage(Row):
    """Part of a list of demonstrations."""

    items: list[Demonstration]
    next: str | None


@router.get("/projects/{project_id}/demonstrations")
def list_project_demonstrations(ctx: Ctx, project_id: str, paging: Paging) -> DemonstrationPage:
    """The demonstrations of a project."""
    return DemonstrationPage.model_validate(page(workflow.list_demonstrations(ctx, project_id=project_id), paging))


@router.get("/tools/{tool_id}/demonstrations")
def list_tool_demonstrations(ctx: Ctx, tool_id: str, paging: Paging) -> DemonstrationPage:
    """The demonstrations of a tool, superseded ones too."""
    return DemonstrationPage.model_validate(page(workflow.list_demonstrations(ctx, tool_id=tool_id), paging))


@router.post("/tools/{tool_id}/demonstrations", status_code=201, response_model=Demonstration)
def create_demonstration(ctx: Ctx, tool_id: str, body: NewDemonstration, response: Response, _key: IdempotencyKey = None) -> Json:
    """Store a complete order; it supersedes the same author's earlier demonstration of the tool."""
    row = workflow.create_demonstration(ctx, tool_id, body.sequence, body.name, body.author)
    return located(response, "demonstrations", row)


@router.get("/demonstrations/{demonstration_id}", response_model=Demonstration)
def get_demonstration(ctx: Ctx, demonstration_id: str, response: Response) -> Json:
    """One demonstration."""
    return tagged(response, workflow.get_demonstration(ctx, demonstration_id))


@router.patch("/demonstrations/{demonstration_id}", response_model=Demonstration)
def update_demonstration(ctx: Ctx, demonstration_id: str, body: DemonstrationChanges, version: Version, response: Response) -> Json:
    """Rename a demonstration, or say whose it is."""
    changes = body.model_dump(exclude_unset=True)
    if changes.get("name") is None:
        changes.pop("name", None)
    return tagged(response, workflow.update_demonstration(ctx, demonstration_id, changes, version))


@router.delete("/demonstrations/{demonstration_id}", status_code=204)
def delete_demonstration(ctx: Ctx, demonstration_id: str, version: Version) -> None:
    """Put a demonstration away."""
    workflow.delete_demonstration(ctx, demonstration_id, version)


@router.post("/demonstrations/{demonstration_id}/carry-over", status_code=201, response_model=Demonstration)
def carry_over_demonstration(ctx: Ctx, demonstration_id: str, response: Response, _key: IdempotencyKey = None) -> Json:
    """Take an order from before an edit over to the current regions, where they map one to one."""
    return located(response, "demonstrations", workflow.carry_over_demonstration(ctx, demonstration_id))


@router.post("/demonstrations/{demonstration_id}/restore", response_model=Demonstration)
def restore_demonstration(ctx: Ctx, demonstration_id: str, response: Response, _key: IdempotencyKey = None) -> Json:
    """Undo the deletion."""
    return tagged(response, workflow.restore_demonstration(ctx, demonstration_id))
