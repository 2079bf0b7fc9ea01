"""Views in which regions are edited: what is selected, the points clicked, and how both follow the edits."""

import gc
from functools import cache
from typing import Any

import numpy as np
from sqlmodel import Session, select

from app.errors import AppError, InvalidInput
from app.geometry.cad_faces import Colour
from app.geometry.pieces import Piece, piece_under
from app.geometry.regions import warm_up
from app.geometry.segmentation import SegmentationParameters
from app.geometry.slicing import nearest_face
from app.geometry.tool import Tool
from app.storage import emit
from app.storage.tables import Segmentation, ToolRow, ViewSession
from app.workflow.context import Context
from app.workflow.edits import After, metres
from app.workflow.lookup import found, present, ready_segmentation
from app.workflow.values import Values

Json = dict[str, Any]

EDITING: Json = {"pointing": "select", "selection": [], "points": [], "level": 1, "path": None, "closed": False, "colours": "regions"}
MOST_POINTS = 100


def editing_scene(session: Session, before: Json, scene: Json) -> Json:
    """A scene in the mode edit: what it leaves out stays while the tool is the same.

    Raises:
        InvalidInput: It selects regions the tool doesn't have.
    """
    same = before.get("mode") == "edit" and before.get("tool_id") == scene["tool_id"]
    kept = {key: before[key] for key in EDITING if key in before} if same else {}
    full = {**EDITING, **kept, **{k: v for k, v in scene.items() if k in (*EDITING, "mode", "tool_id", "dark") and v is not None}}
    for name in ("path", "closed"):  # may be taken back
        if name in scene:
            full[name] = scene[name]
    row = present(session, ToolRow, scene["tool_id"])
    _check_selection(row, ready_segmentation(session, row), full["selection"])
    if len(full["points"]) > MOST_POINTS:
        raise InvalidInput(f"A line has at most {MOST_POINTS} points.")
    return full


def change_editing(ctx: Context, session_id: str, changes: Json) -> None:
    """Change what a view in the mode edit shows, and tell everybody.

    Raises:
        InvalidInput: The view is in another mode, or a value can't be used.
    """
    changes = {key: value for key, value in changes.items() if key in EDITING}
    # the merge tree may have to be built first; not on the thread that writes
    ctx.store.read(lambda session: piece_of(ctx.values, session, {**EDITING, **_editing(session, session_id).scene, **changes}))

    def change(session: Session) -> None:
        row = _editing(session, session_id)
        if changes:
            row.scene = editing_scene(session, row.scene, {**row.scene, **changes})
            session.add(row)
        tell_editing(ctx.values, session, row)

    ctx.store.write(change)


def pick_region(ctx: Context, session_id: str, region: int | None, *, toggle: bool) -> None:
    """A click: only that region, or turned over with a modifier; beside the regions nothing is selected."""
    selection: list[int] = get_editing(ctx, session_id)["selection"]
    if toggle:
        selection = sorted(set(selection) ^ ({region} if region is not None else set()))
    else:
        selection = [] if region is None else [region]
    change_editing(ctx, session_id, {"selection": selection})


def add_regions(ctx: Context, session_id: str, regions: list[int]) -> None:
    """Regions in a box."""
    selection: list[int] = get_editing(ctx, session_id)["selection"]
    change_editing(ctx, session_id, {"selection": sorted({*selection, *regions})})


def pick_point(ctx: Context, session_id: str, point_mm: list[float], region: int | None) -> None:
    """A clicked point: the next one of a line or plane, or the place whose piece is meant.

    Raises:
        InvalidInput: A line leaves its region.
    """
    scene = get_editing(ctx, session_id)
    point = {"point_mm": [round(float(x), 6) for x in point_mm], "region": region}
    if scene["pointing"] == "piece":
        level = _next_level(ctx, scene, point_mm)
        change_editing(ctx, session_id, {"points": [point], "level": level})
        return
    points: list[Json] = scene["points"]
    if points and points[0]["region"] != region:
        raise InvalidInput("All points have to lie on one region. Click on the region of the first point, or start again.")
    if region is None:
        raise InvalidInput("This place is not on a region, so there is nothing to divide.")
    change_editing(ctx, session_id, {"points": [*points, point]})


def get_editing(ctx: Context, session_id: str) -> Json:
    """The scene of a view in the mode edit."""
    return ctx.store.read(lambda session: dict(_editing(session, session_id).scene))


def piece_of(values: Values, session: Session, scene: Json) -> tuple[Tool, Piece] | None:
    """The piece that a view points at; None when it points at none."""
    if scene["pointing"] != "piece" or not scene["points"]:
        return None
    row = present(session, ToolRow, scene["tool_id"])
    cut = ready_segmentation(session, row)
    tool = values.tool(session, cut)
    tree = values.tree(tool, cut.tool_sha, row.part_sha, row.tree_sha)
    try:
        return tool, piece_under(tool, tree, metres([scene["points"][0]["point_mm"]])[0], scene["level"])
    except AppError:
        return None


def piece_faces(ctx: Context, session_id: str) -> np.ndarray | None:
    """The faces (F,) of the piece that a view points at."""

    def query(session: Session) -> np.ndarray | None:
        known = piece_of(ctx.values, session, _editing(session, session_id).scene)
        return None if known is None else known[1].faces

    return ctx.store.read(query)


def get_ready(ctx: Context, tool_id: str) -> None:
    """Do now what the first edit of a tool would wait for: its merge tree and patches, and the kernels that measure regions."""

    def query(session: Session) -> tuple[Tool, tuple[str, str | None, str | None]]:
        row = present(session, ToolRow, tool_id)
        cut = ready_segmentation(session, row)
        return ctx.values.tool(session, cut), (cut.tool_sha, row.part_sha, row.tree_sha)

    tool, names = ctx.store.read(query)
    if tool.graph.source == "mesh":
        warm_up()
        _settle()
        ctx.values.tree(tool, *names)
        _, part_sha, tree_sha = names
        part, tree = ctx.values.part(part_sha), ctx.values.part_tree(tree_sha)
        if part_sha is not None and part is not None and tree is not None:
            ctx.values.patches(part_sha, part, tree, SegmentationParameters())


@cache
def _settle() -> None:
    """Look for garbage once and never again among all that is loaded by now: a look takes a fifth of a second of somebody's edit."""
    gc.collect()
    gc.freeze()


def cad_colours(ctx: Context, tool_id: str) -> tuple[Colour | None, ...]:
    """The colours the CAD file gives the regions of a tool."""

    def query(session: Session) -> tuple[Colour | None, ...]:
        row = present(session, ToolRow, tool_id)
        cut = ready_segmentation(session, row)
        return ctx.values.colours(ctx.values.tool(session, cut), cut.tool_sha, row.part_sha)

    return ctx.store.read(query)


def follow_edit(values: Values, session: Session, row: ToolRow, after: After) -> None:
    """Views on an edited tool: what was selected is selected under its new number, or what became of it."""
    moved = {old: new for new, old in enumerate(after.kept) if old >= 0}
    for view in _views_on(session, row):
        selected = view.scene["selection"]
        stays = [moved[a] for a in selected if a in moved]
        touched = len(stays) < len(selected) or bool(after.made)
        _reset(values, session, view, sorted({*(after.made if touched else []), *(stays if not after.made else [])}))


def follow_jump(values: Values, session: Session, row: ToolRow, shaped: bool) -> None:
    """Views on a tool that went back or forward: numbers mean other regions now."""
    for view in _views_on(session, row):
        _reset(values, session, view, [] if shaped else view.scene["selection"])


def _views_on(session: Session, row: ToolRow) -> list[ViewSession]:
    views = session.exec(select(ViewSession).where(ViewSession.project_id == row.project_id)).all()
    return [v for v in views if v.scene.get("mode") == "edit" and v.scene.get("tool_id") == row.id]


def _reset(values: Values, session: Session, view: ViewSession, selection: list[int]) -> None:
    view.scene = {**EDITING, **view.scene, "selection": selection, "points": [], "level": 1}
    session.add(view)
    tell_editing(values, session, view)


def _editing(session: Session, session_id: str) -> ViewSession:
    row = found(session, ViewSession, session_id, "view")
    if row.scene.get("mode") != "edit":
        raise InvalidInput("This view doesn't edit regions; show a scene with the mode edit first.")
    return row


def tell_editing(values: Values, session: Session, row: ViewSession) -> None:
    """One event with everything the page needs."""
    scene = row.scene
    known = piece_of(values, session, scene)
    piece = None
    if known is not None:
        tool, its = known
        piece = {
            "area_mm2": its.area * 1e6,
            "share": its.share,
            "region": its.region,
            "level": its.level,
            "to": its.to,
            "to_name": None if its.to is None else tool.regions[its.to].name,
        }
    told = {key: scene[key] for key in ("selection", "pointing", "points", "level", "path", "closed")}
    emit(session, "session.editing", row.project_id, session_id=row.id, **told, piece=piece)
    emit(session, "scene.changed", row.project_id, session_id=row.id)


def _next_level(ctx: Context, scene: Json, point_mm: list[float]) -> int:
    """One smaller when the click is inside the piece that is shown, else the largest."""

    def query(session: Session) -> int:
        known = piece_of(ctx.values, session, scene)
        if known is None:
            return 1
        tool, piece = known
        face, _ = nearest_face(tool.mesh, metres([point_mm])[0])
        return piece.level + 1 if piece.faces[face] else 1

    return ctx.store.read(query)


def _check_selection(row: ToolRow, cut: Segmentation, selection: list[int]) -> None:
    wrong = [a for a in selection if not 0 <= a < cut.region_count]
    if wrong:
        raise InvalidInput(
            f"{row.name} has {cut.region_count} regions, numbered 0 to {cut.region_count - 1}; there is no region {wrong[0]}."
        )
