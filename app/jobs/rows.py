"""Job rows inside someone's transaction: adding, cancelling, telling how far one is."""

from datetime import UTC, datetime
from typing import Any

from sqlmodel import Session, col, select

from app.storage.identity import now
from app.storage.outbox import emit
from app.storage.tables import JobRow

UNFINISHED = ("queued", "running")


def add_job(session: Session, kind: str, project_id: str, subject_id: str, title: str, args: dict[str, Any] | None = None) -> str:
    """Queue a piece of work with the change that needs it; it starts after the commit."""
    row = JobRow(kind=kind, project_id=project_id, subject_id=subject_id, title=title, args=args or {})
    session.add(row)
    tell(session, row)
    return row.id


def cancel_jobs(session: Session, subject_id: str) -> None:
    """Cancel what is unfinished for a subject; a result that still arrives is dropped."""
    for row in session.exec(select(JobRow).where(JobRow.subject_id == subject_id, col(JobRow.state).in_(UNFINISHED))):
        row.state, row.finished_at = "cancelled", now()
        session.add(row)
        tell(session, row)


def unfinished_job(session: Session, subject_id: str) -> JobRow | None:
    """The latest queued or running job of a subject."""
    wanted = select(JobRow).where(JobRow.subject_id == subject_id, col(JobRow.state).in_(UNFINISHED))
    return session.exec(wanted.order_by(col(JobRow.id).desc())).first()


def job_json(row: JobRow | None) -> dict[str, Any] | None:
    """How far a job is."""
    return None if row is None else {"id": row.id, "fraction": row.fraction, "message": row.message}


def running_jobs(session: Session, project_id: str) -> list[dict[str, Any]]:
    """All unfinished work of a project, for its pages."""
    wanted = select(JobRow).where(JobRow.project_id == project_id, col(JobRow.state).in_(UNFINISHED)).order_by(col(JobRow.id))
    return [
        {"job_id": row.id, "title": row.title, "fraction": row.fraction, "message": row.message, "seconds_left": seconds_left(row)}
        for row in session.exec(wanted)
    ]


def seconds_left(row: JobRow) -> float | None:
    """Time left if it goes on as it did; None while that is a guess."""
    if row.started_at is None or row.fraction < 0.05:
        return None
    elapsed = (datetime.now(UTC) - datetime.fromisoformat(row.started_at)).total_seconds()
    return round(max(0.0, elapsed * (1 - row.fraction) / row.fraction), 1)


def tell(session: Session, row: JobRow) -> None:
    """Emit how far the job is."""
    emit(
        session,
        "job.progress",
        row.project_id,
        job_id=row.id,
        subject_id=row.subject_id,
        state=row.state,
        fraction=row.fraction,
        message=row.message,
    )
