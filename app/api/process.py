"""The kind of work of a project: features that count, levels, templates to start from."""

from typing import Annotated, Literal

from fastapi import APIRouter, Response
from pydantic import Field

from app.api.coverage import InteractionChoice
from app.api.dependencies import Body, Ctx, Json, Name, Paging, Row, Version, page, tagged
from app.api.idempotency import ActionRoute, IdempotencyKey
from app.api.projects import NamedInteraction
from app.workflow import process as workflow

router = APIRouter(tags=["process"], route_class=ActionRoute)

Key = Annotated[str, Field(min_length=1, max_length=60)]
Keys = Annotated[list[Key], Field(max_length=100)]
Why = Annotated[str, Field(max_length=600, description="A sentence that tells the next engineer why.")]
Levels = Literal["quantile", "range"]
FiniteNumber = Annotated[float, Field(allow_inf_nan=False)]


class LevelsByHand(Body):
    """What was set on the coverage page, by feature; others have the usual rule."""

    chosen: Annotated[dict[Key, Levels], Field(default_factory=dict, max_length=60)]
    expert: Annotated[dict[Key, tuple[FiniteNumber, FiniteNumber]], Field(default_factory=dict, max_length=60)]


class ProcessChanges(Body):
    """Fields left out stay as they are."""

    template: Annotated[Key, Field(description="Key or id of the process template to start from.")] | None = None
    without: Annotated[Keys, Field(description="Features switched off.")] | None = None
    own: Annotated[Keys, Field(description="Own features switched on, by KEY.")] | None = None
    interactions: Annotated[list[InteractionChoice], Field(max_length=20)] | None = None
    levels: Annotated[Levels, Field(description="Thirds of the values at hand, or of their range.")] | None = None
    by_hand: (
        Annotated[LevelsByHand, Field(description="In place of all levels set by hand; starting from a template drops them.")] | None
    ) = None


class NewTemplate(Body):
    """Keep a project's choice under a name."""

    project_id: str
    name: Name
    why: Why = ""


class TemplateChanges(Body):
    """Fields left out stay as they are."""

    name: Name | None = None
    why: Why | None = None


class FeatureSwitch(Row):
    """A built-in feature and whether it counts."""

    key: str
    label: str
    symbol: str
    sentence: str
    on: bool


class OwnFeature(Row):
    """A feature that an engineer wrote; `faults` say why it can't be used."""

    file: str | None
    key: str | None
    label: str | None
    version: str | None
    on: bool
    faults: list[str]


class Process(Row):
    """What counts in a project."""

    project_id: str
    version: int
    template: str | None
    feature_set: str
    features: list[FeatureSwitch]
    own: list[OwnFeature]
    own_folder: str
    levels: Levels
    by_hand: LevelsByHand
    interactions: list[NamedInteraction]


class Pair(Row):
    """Two features whose product is suspected to matter."""

    first: str
    second: str


class ProcessTemplate(Row):
    """A named starting point."""

    id: str
    name: str
    why: str
    built_in: bool
    without: list[str]
    own: list[str]
    interactions: list[Pair]
    levels: Levels


class TemplatePage(Row):
    """Part of the list of templates."""

    items: list[ProcessTemplate]
    next: str | None


@router.get("/projects/{project_id}/process", response_model=Process)
def get_process(ctx: Ctx, project_id: str, response: Response) -> Json:
    """Which features count."""
    return tagged(response, workflow.get_process(ctx, project_id))


@router.patch("/projects/{project_id}/process", response_model=Process)
def set_process(ctx: Ctx, project_id: str, body: ProcessChanges, version: Version, response: Response) -> Json:
    """Start from a template, or switch single features."""
    return tagged(response, workflow.set_process(ctx, project_id, body.model_dump(exclude_none=True), version))


@router.get("/process-templates")
def list_templates(ctx: Ctx, paging: Paging) -> TemplatePage:
    """Built-in and saved templates."""
    return TemplatePage.model_validate(page(workflow.list_templates(ctx), paging))


@router.post("/process-templates", status_code=201, response_model=ProcessTemplate)
def save_template(ctx: Ctx, body: NewTemplate, _key: IdempotencyKey = None) -> Json:
    """Save a project's choice as a template."""
    return workflow.save_template(ctx, body.project_id, body.name, body.why)


@router.patch("/process-templates/{template_id}", response_model=ProcessTemplate)
def change_template(ctx: Ctx, template_id: str, body: TemplateChanges) -> Json:
    """Rename a saved template."""
    return workflow.change_template(ctx, template_id, body.model_dump(exclude_none=True))


@router.delete("/process-templates/{template_id}", status_code=204)
def delete_template(ctx: Ctx, template_id: str) -> None:
    """Put a saved template away."""
    workflow.delete_template(ctx, template_id)
