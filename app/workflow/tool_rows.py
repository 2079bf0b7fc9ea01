"""Tools as REST shows them, and adding a cut to one."""

from typing import Any

from sqlmodel import Session, col, select

from app.jobs.rows import job_json, unfinished_job
from app.storage import Store, emit
from app.storage.artifacts import keep
from app.storage.conversions import MEDIA_TYPE
from app.storage.tables import Demonstration, Segmentation, ToolRow
from app.workflow.lookup import current_segmentation

Json = dict[str, Any]


def tool_json(session: Session, row: ToolRow) -> Json:
    """The tool as REST shows it."""
    cut = current_segmentation(session, row.id)
    shown = tool_demonstration(session, cut) if cut else None
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
        "demonstrated": shown is not None,
        "demonstration_id": shown.id if shown else None,
        "feature_set": cut.feature_set if cut else None,
        "segmentation_id": cut.id if cut else None,
        "job": job_json(unfinished_job(session, row.id)),
        "report": row.report,
        "error": row.error,
        "version": row.version,
        "created_at": row.created_at,
    }


def tool_demonstration(session: Session, cut: Segmentation) -> Demonstration | None:
    """The demonstration that counts for a tool's current cut."""
    wanted = select(Demonstration).where(
        Demonstration.segmentation_id == cut.id, col(Demonstration.deleted_at).is_(None), col(Demonstration.superseded_by).is_(None)
    )
    return session.exec(wanted.order_by(col(Demonstration.id).desc())).first()


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
