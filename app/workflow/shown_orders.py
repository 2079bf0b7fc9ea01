"""An order recorded because both orders of a question were wrong: the run that asked goes on with it."""

from sqlmodel import Session, col, func, select

from app.storage.tables import Demonstration, Run, RunDemonstration, ToolRow
from app.workflow.authors import expert_key
from app.workflow.lookup import active_run, current_segmentation, found, same_regions
from app.workflow.run_rows import train_on, wrong_both


def take_up(session: Session, shown: Demonstration) -> None:
    """Let the newest certified run learn from an order on a tool it asked about, where both of its orders were wrong."""
    wanted = select(Run).where(Run.project_id == shown.project_id, Run.kind == "performance", Run.mode == "certified")
    run = session.exec(wanted.order_by(col(Run.id).desc())).first()
    if run is None or run.state not in ("queued", "training", "waiting_for_expert", "converged") or not _waited_for(session, run, shown):
        return
    active = active_run(session, run.project_id)
    if active is not None and active.id != run.id:
        return
    _learn_from(session, run, shown)
    if run.state in ("waiting_for_expert", "converged"):  # a step under way is done again when it ends
        name = found(session, ToolRow, shown.tool_id, "tool").name
        train_on(session, run, f"Going on with the order you recorded for {name}.")


def _waited_for(session: Session, run: Run, shown: Demonstration) -> bool:
    by_others = run.authors and expert_key(shown.author) not in {expert_key(name) for name in run.authors}
    cut = current_segmentation(session, shown.tool_id)
    if by_others or cut is None or not same_regions(session, shown.segmentation_id, cut):
        return False
    return shown.tool_id in wrong_both(session, run) and any(same_regions(session, key, cut) for key in run.interest)


def _learn_from(session: Session, run: Run, shown: Demonstration) -> None:
    """Add the demonstration behind those the run was started with; recorded again, it takes the place of the one before."""
    mine = select(RunDemonstration).where(RunDemonstration.run_id == run.id)
    row = session.exec(mine.where(RunDemonstration.tool_id == shown.tool_id)).first()
    if row is None:
        count = session.exec(select(func.max(RunDemonstration.position)).where(RunDemonstration.run_id == run.id)).one()
        row = RunDemonstration(run_id=run.id, position=(count or 0) + 1, demonstration_id=shown.id, tool_id=shown.tool_id)
    row.demonstration_id = shown.id
    session.add(row)
    session.flush()
