"""The robot's preview of a plan."""

from dataclasses import fields
from typing import Any

from sqlmodel import Session, col, select

from app.errors import Conflict, InvalidInput
from app.jobs.rows import add_job, job_json, unfinished_job
from app.robot.parameters import RobotParameters
from app.robot.playback import Playback, playback_from_bytes
from app.storage import emit
from app.storage.tables import Plan, PlaybackRow, Segmentation, ToolRow
from app.workflow import playback_job
from app.workflow.context import Context
from app.workflow.lookup import found, present

Json = dict[str, Any]

FIGURES = ("cycle_s", "in_contact_share", "force_error_n", "covered", "force_target_n", "series")


def start_playback(ctx: Context, plan_id: str, parameters: Json | None = None) -> Json:
    """Simulate the arm on the plan's sequence in the background."""
    given = parameters or {}
    known = [f.name for f in fields(RobotParameters)]
    for key in given:
        if key not in known:
            raise InvalidInput(f"The robot has no setting {key!r}. Known are: {', '.join(known)}.")

    def change(session: Session) -> Json:
        plan = found(session, Plan, plan_id, "plan")
        tool = present(session, ToolRow, plan.tool_id)
        row = PlaybackRow(project_id=plan.project_id, plan_id=plan.id, tool_id=plan.tool_id, parameters=given)
        session.add(row)
        session.flush()
        add_job(session, playback_job.KIND, plan.project_id, row.id, f"Robot on {tool.name}")
        session.flush()
        emit(session, "playback.changed", plan.project_id, playback_id=row.id)
        return playback_json(ctx, session, row)

    return ctx.store.write(change)


def get_playback(ctx: Context, playback_id: str) -> Json:
    """One playback."""
    return ctx.store.read(lambda session: playback_json(ctx, session, found(session, PlaybackRow, playback_id, "playback")))


def list_playbacks(ctx: Context, plan_id: str) -> list[Json]:
    """The playbacks of a plan, newest first."""

    def query(session: Session) -> list[Json]:
        found(session, Plan, plan_id, "plan")
        rows = session.exec(select(PlaybackRow).where(PlaybackRow.plan_id == plan_id).order_by(col(PlaybackRow.id).desc())).all()
        return [playback_json(ctx, session, row) for row in rows]

    return ctx.store.read(query)


def playback_value(ctx: Context, playback_id: str) -> Playback:
    """The recording itself.

    Raises:
        Conflict: It is not computed yet.
    """
    sha = ctx.store.read(lambda session: found(session, PlaybackRow, playback_id, "playback").artifact_sha)
    if sha is None:
        raise Conflict("This preview is not computed yet.")
    return ctx.values.reports.get(("playback", sha), lambda: playback_from_bytes(ctx.store.artifacts.get(sha)))


def playback_series(ctx: Context, playback_id: str) -> Json | None:
    """Force and path error over time, None until it is ready."""
    return get_playback(ctx, playback_id)["series"]


def playback_json(ctx: Context, session: Session, row: PlaybackRow) -> Json:
    """The playback as REST shows it; figures are null until it is ready."""
    figures = row.summary or {}
    regions = None
    if row.summary is not None:
        plan = found(session, Plan, row.plan_id, "plan")
        tool = ctx.values.tool(session, found(session, Segmentation, plan.segmentation_id, "segmentation"))
        regions = [{**region, "name": tool.regions[region["region"]].name} for region in row.summary["regions"]]
    return {
        "id": row.id,
        "plan_id": row.plan_id,
        "tool_id": row.tool_id,
        "state": row.state,
        "job": job_json(unfinished_job(session, row.id)),
        **{key: figures.get(key) for key in FIGURES},
        "regions": regions,
        "error": row.error,
    }
