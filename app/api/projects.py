"""Projects: everything that belongs to one process and its expert."""

from typing import Annotated, Literal

from fastapi import APIRouter, Response
from pydantic import StringConstraints

from app.api.dependencies import Body, Ctx, Json, Name, Paging, Row, Version, located, page, tagged
from app.api.idempotency import ActionRoute, IdempotencyKey
from app.workflow import projects as workflow

router = APIRouter(tags=["projects"], route_class=ActionRoute)

Process = Annotated[str, StringConstraints(strip_whitespace=True, max_length=200)]


class NewProject(Body):
    """What a project starts from."""

    name: Name
    process: Process = ""


class ProjectChanges(Body):
    """Fields left out stay as they are."""

    name: Name | None = None
    process: Process | None = None


class NamedInteraction(Row):
    """Two features whose product the expert suspects to matter."""

    first: str
    second: str
    label: str


class Stage(Row):
    """One of the six stages as the navigation shows it."""

    key: Literal["tools", "demonstrations", "coverage", "teach", "policy", "robot"]
    state: Literal["done", "doing", "wait", "todo"]
    meta: str


class NextStep(Row):
    """What the person should do now."""

    title: str
    text: str
    label: str
    page: str
    tool_id: str | None


class RunningJob(Row):
    """Background work of the project."""

    job_id: str
    title: str
    fraction: float
    message: str
    seconds_left: float | None


class Counts(Row):
    """How much the project holds."""

    tools: int
    demonstrations: int
    open_queries: int


class Project(Row):
    """A project and how far it is."""

    id: str
    name: str
    process: str
    sample: bool
    interactions: list[NamedInteraction]
    interaction_choices: list[NamedInteraction]
    version: int
    created_at: str
    updated_at: str
    counts: Counts
    rho: float | None
    stages: list[Stage]
    next_step: NextStep
    running: list[RunningJob]


class ProjectPage(Row):
    """Part of the list of projects."""

    items: list[Project]
    next: str | None


@router.get("/projects")
def list_projects(ctx: Ctx, paging: Paging) -> ProjectPage:
    """All projects."""
    return ProjectPage.model_validate(page(workflow.list_projects(ctx), paging))


@router.post("/projects", status_code=201, response_model=Project)
def create_project(ctx: Ctx, body: NewProject, response: Response, _key: IdempotencyKey = None) -> Json:
    """Make an empty project."""
    return located(response, "projects", workflow.create_project(ctx, body.name, body.process))


@router.post("/projects/sample", status_code=201, response_model=Project)
def create_sample_project(ctx: Ctx, response: Response, _key: IdempotencyKey = None) -> Json:
    """Make a project with parametric moulds and a half-taught expert."""
    return located(response, "projects", workflow.create_sample_project(ctx))


@router.get("/projects/{project_id}", response_model=Project)
def get_project(ctx: Ctx, project_id: str, response: Response) -> Json:
    """One project."""
    return tagged(response, workflow.get_project(ctx, project_id))


@router.patch("/projects/{project_id}", response_model=Project)
def update_project(ctx: Ctx, project_id: str, body: ProjectChanges, version: Version, response: Response) -> Json:
    """Rename the project or its process."""
    changes = body.model_dump(exclude_none=True)
    return tagged(response, workflow.update_project(ctx, project_id, changes, version))


@router.delete("/projects/{project_id}", status_code=204)
def delete_project(ctx: Ctx, project_id: str, version: Version) -> None:
    """Put the project away."""
    workflow.delete_project(ctx, project_id, version)
