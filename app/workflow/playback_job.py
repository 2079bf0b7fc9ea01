"""The job that simulates the arm on a plan."""

from dataclasses import dataclass
from functools import partial
from typing import Any

from sqlmodel import Session

from app.errors import InvalidInput
from app.geometry.tool import Tool
from app.jobs.dispatcher import Handler
from app.jobs.worker import Report
from app.robot.parameters import RobotParameters
from app.robot.playback import Playback, playback_to_bytes, simulate
from app.storage import Store, emit
from app.storage.artifacts import keep
from app.storage.conversions import MEDIA_TYPE
from app.storage.tables import JobRow, Plan, PlaybackRow, Segmentation
from app.workflow.lookup import found
from app.workflow.values import Values

Json = dict[str, Any]

KIND = "playback"
MOST_POINTS = 600  # of a curve on the page


@dataclass(frozen=True)
class Order:
    """What the arm has to do."""

    tool: Tool
    sequence: tuple[int, ...]
    parameters: RobotParameters


@dataclass(frozen=True)
class Result:
    """The recording and the figures that pages show."""

    content: bytes
    summary: Json


def handler(store: Store, values: Values) -> Handler:
    """How playback jobs are done."""
    return Handler(partial(prepare, values), compute, partial(finish, store), fail, begin)


def begin(session: Session, job: JobRow) -> None:
    """The simulation runs from here on."""
    _go(session, job, "running")


def prepare(values: Values, session: Session, job: JobRow) -> Order | None:
    """The plan and its tool."""
    row = session.get(PlaybackRow, job.subject_id)
    if row is None:
        return None
    plan = found(session, Plan, row.plan_id, "plan")
    tool = values.tool(session, found(session, Segmentation, plan.segmentation_id, "segmentation"))
    return Order(tool, tuple(plan.sequence), RobotParameters(**row.parameters))


def compute(order: Order, report: Report) -> Result:
    """Simulate; pure.

    Raises:
        InvalidInput: The plan leaves regions out.
    """
    left_out = [region.name for a, region in enumerate(order.tool.regions) if a not in order.sequence]
    if left_out:
        names = ", ".join(left_out)
        raise InvalidInput(f"This order leaves out {names}. The arm's preview needs every region: make a plan that leaves none out.")
    playback = simulate(order.tool, order.sequence, order.parameters, report)
    return Result(playback_to_bytes(playback), summary(playback, order.sequence))


def finish(store: Store, session: Session, job: JobRow, result: Result) -> None:
    """Store the recording."""
    row = session.get(PlaybackRow, job.subject_id)
    if row is not None:
        row.artifact_sha = keep(session, store.artifacts.put(result.content), len(result.content), MEDIA_TYPE)
        row.summary, row.error = result.summary, None
        _go(session, job, "ready")


def fail(session: Session, job: JobRow, error: dict[str, str]) -> None:
    """Show why there is no recording."""
    row = session.get(PlaybackRow, job.subject_id)
    if row is not None:
        row.error = error
        _go(session, job, "failed")


def summary(playback: Playback, sequence: tuple[int, ...]) -> Json:
    """The figures of a playback, plain."""
    stride = max(1, len(playback.times) // MOST_POINTS + 1)
    return {
        "cycle_s": float(playback.cycle_s),
        "in_contact_share": float(playback.in_contact_share),
        "force_error_n": float(playback.force_error_n),
        "covered": float(playback.covered),
        "force_target_n": float(playback.force_target_n),
        "regions": [
            {
                "region": int(r.region),
                "step": sequence.index(r.region) + 1,
                "start_s": float(r.start_s),
                "end_s": float(r.end_s),
                "force_rms_n": float(r.force_rms_n),
                "force_max_n": float(r.force_max_n),
                "off_path_mm": float(r.off_path_max_mm),
                "covered": float(r.covered),
                "problems": [{"kind": kind, "text": text} for kind, text in r.problems],
            }
            for r in playback.region_reports
        ],
        "series": {
            "t": [round(float(x), 3) for x in playback.times[::stride]],
            "force_n": [round(float(x), 3) for x in playback.force_n[::stride]],
            "off_path_mm": [round(float(x), 4) for x in playback.off_path_mm[::stride]],
        },
    }


def _go(session: Session, job: JobRow, state: str) -> None:
    row = session.get(PlaybackRow, job.subject_id)
    if row is not None:
        row.state = state
        session.add(row)
        session.flush()
        emit(session, "playback.changed", row.project_id, playback_id=row.id)
