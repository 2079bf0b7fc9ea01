"""Orders for one tool that the weights don't express: kept with the tool until they are dropped. They are asked for in `doubts`."""

from typing import Any

from sqlmodel import Session, col, select

from app.storage import emit
from app.storage.identity import now
from app.storage.tables import Run, Segmentation, ToolException
from app.workflow.lookup import found, same_regions

Json = dict[str, Any]


def standing_exception(session: Session, cut: Segmentation) -> ToolException | None:
    """The order that counts on these regions; None when the policy decides."""
    return next((row for row in kept_orders(session, cut.tool_id) if same_regions(session, row.segmentation_id, cut)), None)


def settle(session: Session, run: Run, state: Json, answers: int) -> None:
    """Keep what a run about one tool found; nothing where the answers said nothing."""
    cut = found(session, Segmentation, run.interest[0], "segmentation")
    if not state["order"]:
        return
    drop(session, kept_orders(session, cut.tool_id))
    session.add(
        ToolException(
            project_id=run.project_id,
            tool_id=cut.tool_id,
            segmentation_id=cut.id,
            run_id=run.id,
            sequence=state["order"],
            answers=answers,
            probability=state["probability"],
        )
    )
    session.flush()
    emit(session, "policy.changed", run.project_id, policy_id=run.based_on)


def forget(session: Session, run: Run) -> None:
    """Drop what a run found, because an answer was taken back."""
    drop(session, list(session.exec(select(ToolException).where(ToolException.run_id == run.id, col(ToolException.dropped_at).is_(None)))))


def kept_orders(session: Session, tool_id: str) -> list[ToolException]:
    """Orders of a tool that weren't dropped, the newest first; one at most but for a tool that was cut anew."""
    wanted = select(ToolException).where(ToolException.tool_id == tool_id, col(ToolException.dropped_at).is_(None))
    return list(session.exec(wanted.order_by(col(ToolException.id).desc())))


def drop(session: Session, rows: list[ToolException]) -> None:
    """Let the policy decide again."""
    for row in rows:
        row.dropped_at = now()
        session.add(row)
        emit(session, "policy.changed", row.project_id, policy_id=None)
    session.flush()
