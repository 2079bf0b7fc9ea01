"""Reports of studies on the learners: tables, plots and the command that makes them."""

from fastapi import APIRouter
from fastapi.responses import FileResponse

from app.api.dependencies import Ctx, Json, Paging, Row, page
from app.workflow import studies as workflow

router = APIRouter(prefix="/studies", tags=["studies"])

PICTURE_POLICY = "default-src 'none'; style-src 'unsafe-inline'; sandbox"  # a plot opened by itself runs and loads nothing


class Study(Row):
    """A folder with a report."""

    id: str
    name: str
    study: str
    title: str
    command: str | None  # makes it again
    made_at: str | None
    table_count: int
    plots: list[str]
    fault: str | None  # why its report can't be shown


class StudyPage(Row):
    """Part of the list of studies."""

    items: list[Study]
    next: str | None
    folder: str  # where they are looked for


class StudyTable(Row):
    """A table in words."""

    title: str
    columns: list[str]
    rows: list[list[str | int | float | None]]
    note: str


class StudyReport(Study):
    """A study with its tables."""

    tables: list[StudyTable]


@router.get("")
def list_studies(ctx: Ctx, paging: Paging) -> StudyPage:
    """The studies saved in the data folder."""
    return StudyPage.model_validate({**page(workflow.list_studies(ctx), paging), "folder": str(workflow.studies_folder(ctx))})


@router.get("/{name}", response_model=StudyReport)
def get_study(ctx: Ctx, name: str) -> Json:
    """One study with its tables."""
    return workflow.get_study(ctx, name)


@router.get("/{name}/{plot}.svg", response_class=FileResponse, responses={200: {"content": {"image/svg+xml": {}}}})
def get_plot(ctx: Ctx, name: str, plot: str) -> FileResponse:
    """A plot of a study."""
    file = workflow.plot_file(ctx, name, plot)
    return FileResponse(file, media_type="image/svg+xml", headers={"Content-Security-Policy": PICTURE_POLICY})
