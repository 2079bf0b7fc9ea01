"""Demonstrations: complete orders, each expert's newest of a tool counts, deleting can be undone."""

from typing import Any

from sqlmodel import Session, col, select

from app.errors import RunActive
from app.sequencing.problem import check_sequence
from app.storage import emit
from app.storage.identity import now
from app.storage.tables import ACTIVE_RUN_STATES, Demonstration, Project, Run, RunDemonstration, Segmentation, ToolRow
from app.workflow.authors import expert_key, tidy_author
from app.workflow.carry_over import carried_over, standing_of
from app.workflow.context import Context
from app.workflow.lookup import check_version, found, present, ready_segmentation
from app.workflow.project_rows import checked_name
from app.workflow.shown_orders import take_up
from app.workflow.values import Values

Json = dict[str, Any]


def list_demonstrations(ctx: Context, project_id: str | None = None, tool_id: str | None = None) -> list[Json]:
    """Demonstrations of a project or a tool, superseded ones too, deleted ones not."""

    def query(session: Session) -> list[Json]:
        wanted = select(Demonstration).join(ToolRow, col(ToolRow.id) == col(Demonstration.tool_id))
        wanted = wanted.where(col(Demonstration.deleted_at).is_(None), col(ToolRow.deleted_at).is_(None))
        if tool_id is not None:
            present(session, ToolRow, tool_id)
            wanted = wanted.where(Demonstration.tool_id == tool_id)
        if project_id is not None:
            present(session, Project, project_id)
            wanted = wanted.where(Demonstration.project_id == project_id)
        return [demonstration_json(ctx.values, session, row) for row in session.exec(wanted.order_by(col(Demonstration.id))).all()]

    return ctx.store.read(query)


def get_demonstration(ctx: Context, demonstration_id: str) -> Json:
    """One demonstration."""
    return ctx.store.read(lambda session: demonstration_json(ctx.values, session, present(session, Demonstration, demonstration_id)))


def create_demonstration(
    ctx: Context, tool_id: str, sequence: list[int], name: str | None = None, author: str | None = None, source: str = "rest"
) -> Json:
    """Store a complete order; it supersedes the same expert's earlier demonstration of the tool.

    Raises:
        IncompleteSequence: Names the regions that are missing, repeated or unknown.
    """

    def change(session: Session) -> Json:
        row = present(session, ToolRow, tool_id)
        cut = ready_segmentation(session, row)
        order = list(check_sequence(sequence, cut.region_count))
        return demonstration_json(ctx.values, session, add_demonstration(session, row, cut, order, source, name=name, author=author))

    return ctx.store.write(change)


def add_demonstration(
    session: Session,
    tool: ToolRow,
    cut: Segmentation,
    sequence: list[int],
    source: str,
    *,
    name: str | None = None,
    author: str | None = None,
    click_times: list[float] | None = None,
) -> Demonstration:
    """The row of a new demonstration; the same expert's that stood so far is superseded."""
    row = Demonstration(
        project_id=tool.project_id,
        tool_id=tool.id,
        segmentation_id=cut.id,
        name=checked_name(name if name is not None else tool.name),
        sequence=sequence,
        click_times=click_times,
        author=tidy_author(author),
        source=source,
    )
    session.add(row)
    session.flush()
    _supersede_others(session, row)
    take_up(session, row)
    _tell(session, row)
    return row


def update_demonstration(ctx: Context, demonstration_id: str, changes: Json, version: int | None = None) -> Json:
    """Rename a demonstration, or say whose it is; of two orders that then are one expert's, the newer one counts."""

    def change(session: Session) -> Json:
        row = present(session, Demonstration, demonstration_id)
        check_version(row, version)
        row.name = checked_name(changes.get("name", row.name))
        row.author = tidy_author(changes.get("author", row.author))
        _count(session, row)
        _supersede_older(session, row)
        return demonstration_json(ctx.values, session, row)

    return ctx.store.write(change)


def delete_demonstration(ctx: Context, demonstration_id: str, version: int | None = None) -> None:
    """Put a demonstration away.

    Raises:
        RunActive: A run learns from it.
    """

    def change(session: Session) -> None:
        row = present(session, Demonstration, demonstration_id)
        check_version(row, version)
        wanted = select(Run).join(RunDemonstration, col(RunDemonstration.run_id) == col(Run.id))
        if session.exec(wanted.where(RunDemonstration.demonstration_id == row.id, col(Run.state).in_(ACTIVE_RUN_STATES))).first():
            raise RunActive(f"A run is learning from {row.name}. Cancel the run first, or wait until it is done.")
        row.deleted_at = now()
        _count(session, row)

    ctx.store.write(change)


def restore_demonstration(ctx: Context, demonstration_id: str) -> Json:
    """Undo the deletion; the restored one counts again, unless it was superseded before."""

    def change(session: Session) -> Json:
        row = found(session, Demonstration, demonstration_id, "demonstration")
        present(session, ToolRow, row.tool_id)
        if row.deleted_at is not None:
            row.deleted_at = None
            session.add(row)
            if row.superseded_by is None:
                _supersede_others(session, row)
            _count(session, row)
        return demonstration_json(ctx.values, session, row)

    return ctx.store.write(change)


def carry_over_demonstration(ctx: Context, demonstration_id: str) -> Json:
    """A new demonstration with the same order on the current regions; the older one is superseded.

    Raises:
        Conflict: The regions don't map one to one, or it is on the current ones.
    """

    def change(session: Session) -> Json:
        row = present(session, Demonstration, demonstration_id)
        tool, cut, order = carried_over(ctx, session, row)
        times, author = row.click_times, row.author
        fresh = add_demonstration(session, tool, cut, order, row.source, name=row.name, author=author, click_times=times)
        return demonstration_json(ctx.values, session, fresh)

    get_demonstration(ctx, demonstration_id)  # compares the cuts, if they weren't yet, beside the thread that writes
    return ctx.store.write(change)


def demonstration_json(values: Values, session: Session, row: Demonstration) -> Json:
    """The demonstration as REST shows it."""
    return {
        "id": row.id,
        "tool_id": row.tool_id,
        "tool_name": found(session, ToolRow, row.tool_id, "tool").name,
        "name": row.name,
        "sequence": row.sequence,
        "click_times": row.click_times,
        "author": row.author,
        "source": row.source,
        "superseded_by": row.superseded_by,
        "deleted": row.deleted_at is not None,
        "segmentation_id": row.segmentation_id,
        **standing_of(values, session, row),
        "version": row.version,
        "created_at": row.created_at,
    }


def _supersede_others(session: Session, row: Demonstration) -> None:
    for other in _standing_with(session, row):
        if other.id != row.id:
            other.superseded_by = row.id
            _count(session, other)


def _supersede_older(session: Session, row: Demonstration) -> None:
    """Let only the newest of an expert's orders of a tool stand."""
    if row.superseded_by is None:
        _supersede_others(session, max(_standing_with(session, row), key=lambda d: d.id))


def _standing_with(session: Session, row: Demonstration) -> list[Demonstration]:
    """The orders of the same tool by the same expert that weren't superseded, deleted ones left out."""
    wanted = select(Demonstration).where(
        Demonstration.tool_id == row.tool_id,
        col(Demonstration.superseded_by).is_(None),
        col(Demonstration.deleted_at).is_(None),
    )
    return [other for other in session.exec(wanted).all() if expert_key(other.author) == expert_key(row.author)]


def _count(session: Session, row: Demonstration) -> None:
    row.version += 1
    session.add(row)
    session.flush()
    _tell(session, row)


def _tell(session: Session, row: Demonstration) -> None:
    emit(session, "demonstration.changed", row.project_id, demonstration_id=row.id, tool_id=row.tool_id)
    emit(session, "tool.changed", row.project_id, tool_id=row.tool_id)
    emit(session, "coverage.changed", row.project_id)
