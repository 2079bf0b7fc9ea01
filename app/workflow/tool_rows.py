"""Tools as REST shows them, and adding a cut to one."""

from typing import Any

from sqlmodel import Session, col, select

from app.geometry.segmentation import MOST_TARGET
from app.jobs.rows import job_json, unfinished_job
from app.storage import Store, emit
from app.storage.artifacts import keep
from app.storage.conversions import MEDIA_TYPE
from app.storage.tables import Demonstration, Segmentation, ToolRow
from app.workflow.authors import expert_key, shown_name
from app.workflow.lookup import current_segmentation, run_training_on

Json = dict[str, Any]


def tool_json(session: Session, row: ToolRow) -> Json:
    """The tool as REST shows it."""
    cut = current_segmentation(session, row.id)
    orders = tool_demonstrations(session, cut) if cut else []
    return {
        "id": row.id,
        "project_id": row.project_id,
        "name": row.name,
        "kind": row.kind,
        "state": row.state,
        "questions": row.questions,
        "units": row.units,
        "up": row.up,
        "body": row.body,
        "bodies": row.bodies or [],
        "file_name": row.file_name,
        "split": row.split,
        "region_count": cut.region_count if cut else None,
        "demonstrated": bool(orders),
        "demonstration_id": orders[0].id if orders else None,
        "demonstrated_by": [{"name": shown_name(d.author), "own": not expert_key(d.author)} for d in orders],
        "feature_set": cut.feature_set if cut else None,
        "segmentation_id": cut.id if cut else None,
        "edit": edit_json(session, row, cut),
        "job": job_json(unfinished_job(session, row.id)),
        "report": row.report,
        "error": row.error,
        "version": row.version,
        "created_at": row.created_at,
    }


def edit_json(session: Session, row: ToolRow, cut: Segmentation | None) -> Json:
    """Whether the regions can be edited, what undo and redo would do, and what is locked or hidden."""
    why_not = None
    if cut is None or unfinished_job(session, row.id):
        why_not = f"{row.name} is not read in yet." if cut is None else f"{row.name} is being cut."
    elif row.kind == "table":
        why_not = f"{row.name} comes from a region table, which says what its regions are. Change the table and import it again."
    elif run_training_on(session, row.id):
        why_not = f"A run is learning from {row.name}. Cancel the run first, or wait until it is done."
    ahead = session.get(Segmentation, cut.redo_id) if cut and cut.redo_id else None
    return {
        "can_undo": bool(cut and cut.parent_id),
        "can_redo": ahead is not None,
        "undo": cut.words if cut and cut.parent_id else None,
        "redo": ahead.words if ahead else None,
        "locked": cut.locked if cut else [],
        "hidden": cut.hidden if cut else [],
        "editable": why_not is None,
        "why_not": why_not,
        "step": steps_before(session, cut) if cut else 0,
        "slider": slider_json(row, cut),
    }


def slider_json(row: ToolRow, cut: Segmentation | None) -> Json | None:
    """From how few to how many regions the tool can be cut; None where the regions came with it."""
    if cut is None or row.part_sha is None:
        return None
    return {"least": 1, "most": MOST_TARGET, "current": cut.region_count, "now": row.tree_sha is not None}


def steps_before(session: Session, cut: Segmentation) -> int:
    """How many edits led to a cut."""
    count = 0
    while cut.parent_id is not None and (above := session.get(Segmentation, cut.parent_id)):
        cut, count = above, count + 1
    return count


def tool_demonstrations(session: Session, cut: Segmentation) -> list[Demonstration]:
    """The demonstrations that count for a tool's current cut, one per expert, the newest first."""
    wanted = (
        select(Demonstration)
        .join(Segmentation, col(Segmentation.id) == col(Demonstration.segmentation_id))
        .where(
            Segmentation.tool_id == cut.tool_id,
            Segmentation.tool_sha == cut.tool_sha,
            col(Demonstration.deleted_at).is_(None),
            col(Demonstration.superseded_by).is_(None),
        )
    )
    newest: dict[str, Demonstration] = {}
    for row in session.exec(wanted.order_by(col(Demonstration.id).desc())):
        newest.setdefault(expert_key(row.author), row)
    return list(newest.values())


def touch_tool(session: Session, row: ToolRow) -> None:
    """Count a change and tell of it."""
    row.version += 1
    session.add(row)
    session.flush()
    emit(session, "tool.changed", row.project_id, tool_id=row.id)


def add_cut(
    session: Session, store: Store, row: ToolRow, content: bytes, region_count: int, feature_set: str, params: Json
) -> Segmentation:
    """Make `content` (a Tool value) the current cut of the tool; earlier ones stay for what refers to them."""
    before = current_segmentation(session, row.id)
    if before is not None:
        before.current = False
        session.add(before)
        session.flush()
    sha = keep(session, store.artifacts.put(content), len(content), MEDIA_TYPE)
    cut = Segmentation(tool_id=row.id, params=params, tool_sha=sha, region_count=region_count, feature_set=feature_set)
    session.add(cut)
    session.flush()
    return cut
