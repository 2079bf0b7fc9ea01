"""Finding rows: what is missing or put away is NotFound, an old version is refused."""

from typing import TypeVar

from sqlalchemy.orm import aliased
from sqlmodel import Session, SQLModel, col, func, select

from app.errors import Conflict, NotFound, RunActive, StaleVersion
from app.storage.tables import (
    ACTIVE_RUN_STATES,
    Demonstration,
    Project,
    Query,
    Run,
    RunDemonstration,
    Segmentation,
    ToolRow,
)
from app.workflow.authors import expert_key

Row = TypeVar("Row", bound=SQLModel)
Versioned = TypeVar("Versioned", Project, ToolRow, Demonstration)


def found(session: Session, table: type[Row], key: str, noun: str) -> Row:
    """The row with this id.

    Raises:
        NotFound: There is none.
    """
    row = session.get(table, key)
    if row is None:
        raise NotFound(f"There is no {noun} with the id {key!r}.")
    return row


def present(session: Session, table: type[Versioned], key: str) -> Versioned:
    """Like `found`, for what can be deleted and restored; a tool or demonstration goes with its project."""
    noun = {"ToolRow": "tool"}.get(table.__name__, table.__name__.lower())
    row = found(session, table, key, noun)
    if row.deleted_at is not None:
        raise NotFound(f"The {noun} {row.name!r} was deleted.")
    if not isinstance(row, Project):
        present(session, Project, row.project_id)
    return row


def check_version(row: Project | ToolRow | Demonstration, version: int | None) -> None:
    """Refuse a change that was made on an older version; None doesn't check."""
    if version is not None and version != row.version:
        raise StaleVersion(
            f"{row.name!r} was changed meanwhile (version {row.version}, not {version}). Look at it again, then repeat the change."
        )


def tools_of(session: Session, project_id: str) -> list[ToolRow]:
    """Tools that are not deleted, oldest first."""
    wanted = select(ToolRow).where(ToolRow.project_id == project_id, col(ToolRow.deleted_at).is_(None))
    return list(session.exec(wanted.order_by(col(ToolRow.id))))


def current_segmentation(session: Session, tool_id: str) -> Segmentation | None:
    """The cut that is shown and trained on."""
    return session.exec(select(Segmentation).where(Segmentation.tool_id == tool_id, col(Segmentation.current))).first()


def ready_segmentation(session: Session, tool: ToolRow) -> Segmentation:
    """The current cut of a tool.

    Raises:
        Conflict: The tool is still being read in, or could not be.
    """
    row = current_segmentation(session, tool.id)
    if row is None:
        waits = "could not be read in" if tool.state == "failed" else "is not read in yet"
        raise Conflict(f"{tool.name} {waits}, so it has no regions.")
    return row


def same_regions(session: Session, segmentation_id: str, cut: Segmentation) -> bool:
    """Whether a sequence clicked on one segmentation holds on another as it is: locks, names and what is hidden don't matter."""
    if segmentation_id == cut.id:
        return True
    row = session.get(Segmentation, segmentation_id)
    return row is not None and row.tool_id == cut.tool_id and row.tool_sha == cut.tool_sha


def standing(session: Session, project_id: str) -> list[Demonstration]:
    """The demonstrations that count: each expert's newest of each tool, on its current regions, nothing deleted; in order of the tools."""
    now = aliased(Segmentation)
    wanted = (
        select(Demonstration)
        .join(ToolRow, col(ToolRow.id) == col(Demonstration.tool_id))
        .join(Segmentation, col(Segmentation.id) == col(Demonstration.segmentation_id))
        .join(now, (col(now.tool_id) == col(Demonstration.tool_id)) & (col(now.tool_sha) == col(Segmentation.tool_sha)))
        .where(
            Demonstration.project_id == project_id,
            col(Demonstration.deleted_at).is_(None),
            col(Demonstration.superseded_by).is_(None),
            col(ToolRow.deleted_at).is_(None),
            col(now.current),
        )
    )
    newest = {(row.tool_id, expert_key(row.author)): row for row in session.exec(wanted.order_by(col(Demonstration.id)))}
    return [newest[key] for key in sorted(newest)]


def active_run(session: Session, project_id: str) -> Run | None:
    """The run of a project that is not at its end."""
    wanted = select(Run).where(Run.project_id == project_id, col(Run.state).in_(ACTIVE_RUN_STATES))
    return session.exec(wanted.order_by(col(Run.id).desc())).first()


def run_training_on(session: Session, tool_id: str) -> Run | None:
    """An active run that learns from the tool, or has an open question about it."""
    wanted = select(Run).join(RunDemonstration, col(RunDemonstration.run_id) == col(Run.id))
    learns = session.exec(wanted.where(RunDemonstration.tool_id == tool_id, col(Run.state).in_(ACTIVE_RUN_STATES))).first()
    asks = select(Run).join(Query, col(Query.run_id) == col(Run.id)).where(Query.tool_id == tool_id, Query.state == "open")
    return learns or session.exec(asks.where(col(Run.state).in_(ACTIVE_RUN_STATES))).first()


def refuse_training_on(session: Session, tool: ToolRow) -> None:
    """A tool stays as it is while a run learns from it.

    Raises:
        RunActive: There is such a run.
    """
    if run_training_on(session, tool.id):
        raise RunActive(f"A run is learning from {tool.name}. Cancel the run first, or wait until it is done.")


def open_query_count(session: Session, project_id: str) -> int:
    """Questions that wait for the expert."""
    return session.exec(select(func.count()).select_from(Query).where(Query.project_id == project_id, Query.state == "open")).one()


def refuse_while_training(session: Session, project: Project) -> None:
    """One run per project at a time.

    Raises:
        RunActive: There is one.
    """
    if active_run(session, project.id):
        raise RunActive(f"A run of {project.name} is not at its end. Answer its questions, or stop it first.")


def check_tools(session: Session, run: Run) -> None:
    """A run can only go on while its tools are there.

    Raises:
        Conflict: One was deleted.
    """
    gone = select(ToolRow.name).join(RunDemonstration, col(RunDemonstration.tool_id) == col(ToolRow.id))
    name = session.exec(gone.where(RunDemonstration.run_id == run.id, col(ToolRow.deleted_at).is_not(None))).first()
    if name is not None:
        raise Conflict(f"{name}, which this run learned from, was deleted. Restore it, or start a new run.")
