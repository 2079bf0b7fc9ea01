"""Tools: adding parts, answering what their import asks, cutting them, naming regions, putting them away."""

import io
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from sqlmodel import Session

from app.errors import Conflict, InvalidInput, NotFound, RunActive
from app.geometry.importing import ACCEPTED, METRES, UP, read_file
from app.geometry.parsed import ParsedFile
from app.geometry.preview import Preview, preview
from app.geometry.region_table import read_region_table
from app.geometry.segmentation import SegmentationParameters
from app.geometry.tool import Tool
from app.jobs.rows import add_job, cancel_jobs, unfinished_job
from app.sequencing.features import feature_set_for
from app.storage import emit
from app.storage.artifacts import keep
from app.storage.conversions import MEDIA_TYPE, tool_to_bytes
from app.storage.identity import now
from app.storage.tables import Demonstration, Project, Segmentation, ToolRow
from app.workflow import import_job
from app.workflow.context import Context
from app.workflow.import_questions import bodies_json, check_body, notes, still_open, to_ask
from app.workflow.lookup import check_version, found, present, ready_segmentation, run_training_on, tools_of
from app.workflow.project_rows import checked_name
from app.workflow.tool_rows import add_cut, tool_json, touch_tool

Json = dict[str, Any]

__all__ = ["ACCEPTED", "tool_json"]


def list_tools(ctx: Context, project_id: str) -> list[Json]:
    """The tools of a project, oldest first."""

    def query(session: Session) -> list[Json]:
        present(session, Project, project_id)
        return [tool_json(session, row) for row in tools_of(session, project_id)]

    return ctx.store.read(query)


def get_tool(ctx: Context, tool_id: str) -> Json:
    """One tool."""
    return ctx.store.read(lambda session: tool_json(session, present(session, ToolRow, tool_id)))


def upload_tool(
    ctx: Context,
    project_id: str,
    path: Path,
    file_name: str,
    name: str | None = None,
    units: str | None = None,
    up: str | None = None,
    body: str | None = None,
) -> Json:
    """Add a part from a file; a file that can't be read is refused and nothing is stored.

    Units are asked for where neither the file nor the caller says them, the up-direction where the caller doesn't, the body
    where the file holds several.
    """
    _check_choices(units, up)
    name = checked_name(name if name is not None else Path(file_name).stem)
    ctx.store.read(lambda session: present(session, Project, project_id).id)
    parsed = read_file(path, file_name)
    parsed.chosen(body)
    content, triangles = path.read_bytes(), parsed.to_bytes()
    sha, parsed_sha = ctx.store.artifacts.put(content), ctx.store.artifacts.put(triangles)

    def change(session: Session) -> Json:
        present(session, Project, project_id)
        row = ToolRow(
            project_id=project_id,
            name=name,
            kind="cad",
            state="asking",
            questions=to_ask(parsed, units, up, body),
            units=units or parsed.units,
            up=up,
            body=body if len(parsed.bodies) > 1 else None,
            bodies=bodies_json(parsed),
            file_name=file_name,
            source_sha=keep(session, sha, len(content), "application/octet-stream"),
            parsed_sha=keep(session, parsed_sha, len(triangles), MEDIA_TYPE),
            report=notes(parsed),
        )
        return _next(session, row, {})

    return ctx.store.write(change)


def answer_tool(ctx: Context, tool_id: str, changes: Json, version: int | None = None) -> Json:
    """Rename a tool, or say its units, up-direction or body; once all are known it is read in (again)."""
    _check_choices(changes.get("units"), changes.get("up"))

    def change(session: Session) -> Json:
        row = present(session, ToolRow, tool_id)
        check_version(row, version)
        if changes.get("name") is not None:
            row.name = checked_name(changes["name"])
        frame = {key: changes[key] for key in ("units", "up", "body") if changes.get(key) is not None}
        if not frame:
            touch_tool(session, row)
            return tool_json(session, row)
        if row.kind != "cad":
            raise InvalidInput(f"{row.name} was not made from a CAD file, so it has no units, up-direction or body to choose.")
        check_body(row, frame.get("body"))
        _refuse_while_training(session, row)
        row.units, row.up = frame.get("units", row.units), frame.get("up", row.up)
        row.body = frame.get("body", row.body)
        row.part_sha, row.tree_sha, row.error = None, None, None
        cancel_jobs(session, row.id)
        return _next(session, row, {})

    return ctx.store.write(change)


def segment_tool(ctx: Context, tool_id: str, parameters: Json) -> Json:
    """Cut the tool again; demonstrations keep the cut they were clicked on."""
    known = SegmentationParameters(**parameters)

    def change(session: Session) -> Json:
        row = present(session, ToolRow, tool_id)
        if row.part_sha is None:
            raise InvalidInput(f"{row.name} comes with its regions; only tools made from a CAD file can be cut anew.")
        _refuse_while_training(session, row)
        if unfinished_job(session, row.id):
            raise Conflict(f"{row.name} is being cut already. Wait until that is done.")
        return _next(session, row, vars(known))

    return ctx.store.write(change)


def import_region_table(ctx: Context, project_id: str, text: str, file_name: str, layout: Any = None) -> Json:
    """Add a tool from a region table; the expert's sequence in it becomes a demonstration."""
    table = read_region_table(text, layout, file_name)
    content = tool_to_bytes(table.tool)

    def change(session: Session) -> Json:
        present(session, Project, project_id)
        report = [{"level": level, "text": text} for level, text in table.lines]
        row = ToolRow(
            project_id=project_id, name=checked_name(Path(file_name).stem), kind="table", state="ready", file_name=file_name, report=report
        )
        session.add(row)
        session.flush()
        cut = add_cut(session, ctx.store, row, content, table.tool.n, feature_set_for(table.tool.graph).name, {"layout": table.layout})
        emit(session, "tool.changed", project_id, tool_id=row.id)
        if table.expert is not None:
            sequence = [int(a) for a in table.expert]
            shown = Demonstration(
                project_id=project_id,
                tool_id=row.id,
                segmentation_id=cut.id,
                name=row.name,
                sequence=sequence,
                source="table",
                author="Expert",
            )
            session.add(shown)
            session.flush()
            emit(session, "demonstration.changed", project_id, demonstration_id=shown.id, tool_id=row.id)
        emit(session, "coverage.changed", project_id)
        return tool_json(session, row)

    return ctx.store.write(change)


def delete_tool(ctx: Context, tool_id: str, version: int | None = None) -> None:
    """Put the tool away.

    Raises:
        RunActive: A run trains on it.
    """

    def change(session: Session) -> None:
        row = present(session, ToolRow, tool_id)
        check_version(row, version)
        _refuse_while_training(session, row)
        cancel_jobs(session, row.id)
        row.deleted_at = now()
        touch_tool(session, row)
        emit(session, "coverage.changed", row.project_id)

    ctx.store.write(change)


def restore_tool(ctx: Context, tool_id: str) -> Json:
    """Undo the deletion; an import that was under way starts again."""

    def change(session: Session) -> Json:
        row = found(session, ToolRow, tool_id, "tool")
        present(session, Project, row.project_id)
        if row.deleted_at is not None:
            row.deleted_at = None
            if row.state == "importing":
                add_job(session, import_job.KIND, row.project_id, row.id, f"Reading {row.name}")
            touch_tool(session, row)
            emit(session, "coverage.changed", row.project_id)
        return tool_json(session, row)

    return ctx.store.write(change)


def tool_value(ctx: Context, tool_id: str) -> Tool:
    """The tool as the core sees it, kept in memory."""
    return ctx.store.read(lambda session: ctx.values.tool(session, ready_segmentation(session, present(session, ToolRow, tool_id))))


def file_preview(ctx: Context, tool_id: str, up: str) -> Preview:
    """The bodies of the file a tool was made from, before it is cleaned.

    Raises:
        NotFound: The tool has no file, or is from before its triangles were kept.
        TooLarge: Too many triangles to be drawn.
    """
    sha = ctx.store.read(lambda session: present(session, ToolRow, tool_id).parsed_sha)
    if sha is None:
        raise NotFound("There is no file to show.")
    return preview(ParsedFile.from_bytes(ctx.store.artifacts.get(sha)), up)


def segmentation_value(ctx: Context, segmentation_id: str) -> Tool:
    """An earlier or current cut: what a sequence was clicked on."""
    return ctx.store.read(lambda session: ctx.values.tool(session, found(session, Segmentation, segmentation_id, "segmentation")))


def check_region(row: ToolRow, cut: Segmentation, region: int) -> None:
    """Refuse a region id that the tool doesn't have."""
    if not 0 <= region < cut.region_count:
        raise InvalidInput(f"{row.name} has {cut.region_count} regions, numbered 0 to {cut.region_count - 1}; there is no region {region}.")


def region_json(tool: Tool, a: int) -> Json:
    """A region as REST shows it, in millimetres."""
    region = tool.regions[a]
    return {
        "id": a,
        "name": region.name,
        "description": region.description,
        "area_mm2": region.area * 1e6,
        "curvature_per_m": float(region.curvature),
        "kind": region.kind,
        "centroid_mm": [float(x) * 1e3 for x in region.centroid],
        "normal": [float(x) for x in region.normal],
        "height": float(tool.graph.height[a]),
        "neighbours": [int(b) for b in np.flatnonzero(tool.graph.neighbour[a])],
    }


def mesh_glb(ctx: Context, tool_id: str) -> bytes:
    """The cleaned surface as GLB: nodes `region_0`, `region_1`, ... and `body` for the rest, metres, in the tool frame (+Z up)."""
    tool = tool_value(ctx, tool_id)
    scene = trimesh.Scene()
    for label in range(-1, tool.n):
        faces = tool.mesh.faces[tool.labels == label]
        if len(faces):
            used, index = np.unique(faces, return_inverse=True)
            part = trimesh.Trimesh(tool.mesh.vertices[used], index.reshape(-1, 3), process=False)
            name = f"region_{label}" if label >= 0 else "body"
            scene.add_geometry(part, node_name=name, geom_name=name)
    file = io.BytesIO()
    scene.export(file, file_type="glb")
    return file.getvalue()


def _next(session: Session, row: ToolRow, params: Json) -> Json:
    """Ask what is still open, or start reading."""
    open_now = still_open(row)
    if open_now is None:
        row.state, row.questions = "importing", None
        session.add(row)
        session.flush()
        add_job(
            session,
            import_job.KIND,
            row.project_id,
            row.id,
            f"Reading {row.name}" if row.part_sha is None else f"Cutting {row.name}",
            params,
        )
    else:
        row.questions = open_now
    touch_tool(session, row)
    return tool_json(session, row)


def _check_choices(units: str | None, up: str | None) -> None:
    if units is not None and units not in METRES:
        raise InvalidInput(f"Units are {', '.join(METRES)}, not {units!r}.")
    if up is not None and up not in UP:
        raise InvalidInput(f"The up-direction is {', '.join(UP)}, not {up!r}.")


def _refuse_while_training(session: Session, row: ToolRow) -> None:
    if run_training_on(session, row.id):
        raise RunActive(f"A run is learning from {row.name}. Cancel the run first, or wait until it is done.")
