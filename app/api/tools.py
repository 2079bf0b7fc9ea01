"""Tools: uploads, what their import asks, segmentation, regions."""

import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Literal

from fastapi import APIRouter, File, Form, Response, UploadFile
from pydantic import Field

from app import errors
from app.api.dependencies import Body, Ctx, Json, Name, Paging, Row, Version, located, page, tagged
from app.api.idempotency import ActionRoute, IdempotencyKey
from app.geometry.own_table import TEMPLATE_CSV, template_json
from app.geometry.table_text import decode_table
from app.workflow import tools as workflow
from app.workflow.context import Context

router = APIRouter(tags=["tools"], route_class=ActionRoute)

Units = Literal["mm", "cm", "m", "in"]
Up = Literal["+x", "-x", "+y", "-y", "+z", "-z"]
BodyId = Annotated[str, Field(pattern="^([1-9][0-9]?|all)$", description="Which body of the file: 1 is the largest; or all.")]
MOST_TABLE_BYTES = 5_000_000


class ToolChanges(Body):
    """Fields left out stay as they are; units, up and body answer the import questions."""

    name: Name | None = None
    units: Units | None = None
    up: Up | None = None
    body: BodyId | None = None


class JobState(Row):
    """Progress of background work."""

    id: str
    fraction: float
    message: str


class ReportLine(Row):
    """What the import saw or did."""

    level: Literal["info", "repaired", "refused", "warning"]
    text: str


class Failure(Row):
    """Why background work failed."""

    error: str
    detail: str


class FileBody(Row):
    """One body of the file a tool was made from."""

    id: str
    name: str
    extents: list[float]
    faces: int
    up_guess: str


class SliderRange(Row):
    """From how few to how many regions a tool can be cut; `now`: at once, from its kept merges."""

    least: int
    most: int
    current: int
    now: bool


class EditState(Row):
    """Whether the regions can be edited, what undo and redo would do, what is locked or hidden."""

    can_undo: bool
    can_redo: bool
    undo: str | None
    redo: str | None
    locked: list[int]
    hidden: list[int]
    editable: bool
    why_not: str | None
    step: int
    slider: SliderRange | None


class ToolAuthor(Row):
    """An expert whose order of the tool counts."""

    name: str
    own: bool  # the project's own expert: no name, or the one a table or the sample came with


class Tool(Row):
    """A part and where its import stands."""

    id: str
    project_id: str
    name: str
    kind: Literal["cad", "table", "sample"]
    state: Literal["asking", "importing", "ready", "failed"]
    questions: Json | None
    units: str | None
    up: str | None
    body: str | None
    bodies: list[FileBody]
    file_name: str | None
    split: Literal["train", "test"] | None
    region_count: int | None
    demonstrated: bool
    demonstration_id: str | None  # the newest, whoever's it is
    demonstrated_by: list[ToolAuthor]
    feature_set: str | None
    segmentation_id: str | None
    edit: EditState
    job: JobState | None
    report: list[ReportLine]
    error: Failure | None
    version: int
    created_at: str


class ToolPage(Row):
    """Part of the list of tools."""

    items: list[Tool]
    next: str | None


@contextmanager
def stored_upload(ctx: Context, file: UploadFile) -> Iterator[tuple[Path, str]]:
    """The upload as a file that exists for the duration, and its bare name. The name is never used as a path."""
    name = Path((file.filename or "").replace("\\", "/")).name or "upload"
    folder = ctx.settings.data / "uploads"
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.NamedTemporaryFile(dir=folder, suffix=Path(name).suffix[:16]) as stored:
        shutil.copyfileobj(file.file, stored, 1 << 20)
        stored.flush()
        if stored.tell() > ctx.settings.max_upload_mb * 1_000_000:
            raise errors.TooLarge(f"{name} is larger than {ctx.settings.max_upload_mb} MB, the largest file that is accepted.")
        yield Path(stored.name), name


@router.get("/projects/{project_id}/tools")
def list_tools(ctx: Ctx, project_id: str, paging: Paging) -> ToolPage:
    """The tools of a project."""
    return ToolPage.model_validate(page(workflow.list_tools(ctx, project_id), paging))


@router.post("/projects/{project_id}/tools", status_code=201, response_model=Tool)
def upload_tool(
    ctx: Ctx,
    project_id: str,
    response: Response,
    file: Annotated[UploadFile, File(description="STEP, IGES, STL, OBJ, PLY, OFF, GLB or 3MF.")],
    name: Annotated[Name | None, Form()] = None,
    units: Annotated[Units | None, Form()] = None,
    up: Annotated[Up | None, Form()] = None,
    body: Annotated[BodyId | None, Form()] = None,
    _key: IdempotencyKey = None,
) -> Json:
    """Upload CAD. Units, up-direction and body are asked for where the file leaves them open."""
    with stored_upload(ctx, file) as (path, file_name):
        tool = workflow.upload_tool(ctx, project_id, path, file_name, name=name, units=units, up=up, body=body)
    return located(response, "tools", tool)


@router.post("/projects/{project_id}/tools/region-table", status_code=201, response_model=Tool)
def import_region_table(
    ctx: Ctx,
    project_id: str,
    response: Response,
    file: Annotated[
        UploadFile, File(description="CSV or JSON: the product's own layout (see the template), or the CSV layouts of the paper's authors.")
    ],
    layout: Annotated[Literal["synthetic", "real", "apprentice"] | None, Form(description="Left out: recognised.")] = None,
    _key: IdempotencyKey = None,
) -> Json:
    """Import a region table; the expert's sequence in it becomes a demonstration."""
    with stored_upload(ctx, file) as (path, file_name):
        text = table_text(path, file_name)
    return located(response, "tools", workflow.import_region_table(ctx, project_id, text, file_name, layout=layout))


def table_text(path: Path, file_name: str) -> str:
    """The table as text.

    Raises:
        InvalidInput: Too long for a table, or not text.
    """
    if path.stat().st_size > MOST_TABLE_BYTES:
        raise errors.TooLarge(f"{file_name} is larger than {MOST_TABLE_BYTES // 1_000_000} MB; a region table is a short CSV or JSON file.")
    return decode_table(path.read_bytes(), file_name)


@router.get("/region-table-template", response_class=Response, responses={200: {"content": {"text/csv": {}, "application/json": {}}}})
def region_table_template(format: Literal["csv", "json"] = "csv") -> Response:
    """A small region table to start from: two by two regions with an order."""
    text, media_type = (TEMPLATE_CSV, "text/csv") if format == "csv" else (template_json(), "application/json")
    headers = {"Content-Disposition": f'attachment; filename="region-table.{format}"'}
    return Response(text, media_type=media_type, headers=headers)


@router.get("/tools/{tool_id}", response_model=Tool)
def get_tool(ctx: Ctx, tool_id: str, response: Response) -> Json:
    """One tool."""
    return tagged(response, workflow.get_tool(ctx, tool_id))


@router.patch("/tools/{tool_id}", response_model=Tool)
def answer_tool(ctx: Ctx, tool_id: str, body: ToolChanges, version: Version, response: Response) -> Json:
    """Rename the tool, or answer what its import asks."""
    changes = body.model_dump(exclude_none=True)
    return tagged(response, workflow.answer_tool(ctx, tool_id, changes, version))


@router.delete("/tools/{tool_id}", status_code=204)
def delete_tool(ctx: Ctx, tool_id: str, version: Version) -> None:
    """Put the tool away; refused while a run trains on it."""
    workflow.delete_tool(ctx, tool_id, version)


@router.post("/tools/{tool_id}/restore", response_model=Tool)
def restore_tool(ctx: Ctx, tool_id: str, response: Response, _key: IdempotencyKey = None) -> Json:
    """Undo the deletion."""
    return tagged(response, workflow.restore_tool(ctx, tool_id))


@router.get("/tools/{tool_id}/mesh.glb", response_class=Response, responses={200: {"content": {"model/gltf-binary": {}}}})
def mesh_glb(ctx: Ctx, tool_id: str) -> Response:
    """The cleaned surface, one node per region, in metres."""
    return Response(workflow.mesh_glb(ctx, tool_id), media_type="model/gltf-binary")
