"""Recording: the draft that is clicked on a tool, and the demonstrations made of it."""

from datetime import UTC, datetime
from typing import Any

from sqlmodel import Session

from app.errors import IncompleteSequence
from app.storage import emit
from app.storage.identity import now
from app.storage.tables import Draft, Project, Segmentation, ToolRow
from app.workflow.authors import expert_key
from app.workflow.carry_over import carry_over_draft, older_draft
from app.workflow.context import Context
from app.workflow.demonstrations import (
    add_demonstration,
    create_demonstration,
    delete_demonstration,
    demonstration_json,
    get_demonstration,
    list_demonstrations,
    restore_demonstration,
    update_demonstration,
)
from app.workflow.lookup import present, ready_segmentation, same_regions
from app.workflow.reports import report_of
from app.workflow.tools import check_region

__all__ = [
    "carry_over",
    "clear",
    "create_demonstration",
    "delete_demonstration",
    "get_demonstration",
    "get_draft",
    "list_demonstrations",
    "pick",
    "place",
    "redo",
    "restore_demonstration",
    "save",
    "undo",
    "update_demonstration",
]

Json = dict[str, Any]

KEPT_STEPS = 200  # of undo


def get_draft(ctx: Context, tool_id: str, author: str | None = None) -> Json:
    """The draft; empty before the first click. What saving it brings is told for an order by `author`."""

    def query(session: Session) -> Json:
        row = present(session, ToolRow, tool_id)
        cut = ready_segmentation(session, row)
        return draft_json(ctx, session, row, cut, _draft(session, cut), author)

    return ctx.store.read(query)


def pick(ctx: Context, tool_id: str, region: int) -> Json:
    """Put a region at the end of the draft.

    Raises:
        InvalidInput: No such region.
        IncompleteSequence: The region has its number already.
    """

    def step(session: Session, row: ToolRow, cut: Segmentation, draft: Draft) -> None:
        check_region(row, cut, region)
        if region in draft.sequence:
            name = ctx.values.tool(session, cut).regions[region].name
            raise IncompleteSequence(f"{name} is number {draft.sequence.index(region) + 1} already. Undo, or move it in the list.")
        _set(draft, [*draft.sequence, region], [*draft.click_times, _seconds()])

    return _change(ctx, tool_id, step)


def place(ctx: Context, tool_id: str, sequence: list[int]) -> Json:
    """Replace or reorder the draft in one undoable step."""

    def step(session: Session, row: ToolRow, cut: Segmentation, draft: Draft) -> None:
        for region in sequence:
            check_region(row, cut, region)
        twice = [a for a in sequence if sequence.count(a) > 1]
        if twice:
            raise IncompleteSequence(
                f"{ctx.values.tool(session, cut).regions[twice[0]].name} is in the order twice; every region comes once."
            )
        known = dict(zip(draft.sequence, draft.click_times, strict=True))
        _set(draft, list(sequence), [known.get(a, _seconds()) for a in sequence])

    return _change(ctx, tool_id, step)


def undo(ctx: Context, tool_id: str) -> Json:
    """Take the last step back; nothing happens when there is none."""

    def step(_session: Session, _row: ToolRow, _cut: Segmentation, draft: Draft) -> None:
        if draft.past:
            draft.future = [*draft.future, [draft.sequence, draft.click_times]]
            _restore(draft, draft.past[-1])
            draft.past = draft.past[:-1]

    return _change(ctx, tool_id, step)


def redo(ctx: Context, tool_id: str) -> Json:
    """Do again what was undone; nothing happens when there is nothing."""

    def step(_session: Session, _row: ToolRow, _cut: Segmentation, draft: Draft) -> None:
        if draft.future:
            draft.past = [*draft.past, [draft.sequence, draft.click_times]]
            _restore(draft, draft.future[-1])
            draft.future = draft.future[:-1]

    return _change(ctx, tool_id, step)


def clear(ctx: Context, tool_id: str) -> Json:
    """Empty the draft; undo brings it back."""

    def step(_session: Session, _row: ToolRow, _cut: Segmentation, draft: Draft) -> None:
        if draft.sequence:
            _set(draft, [], [])

    return _change(ctx, tool_id, step)


def carry_over(ctx: Context, tool_id: str) -> Json:
    """Go on with the clicks made before the regions were edited.

    Raises:
        Conflict: There are none, or a clicked region is no longer what it was.
    """
    carry_over_draft(ctx, tool_id)
    return get_draft(ctx, tool_id)


def save(ctx: Context, tool_id: str, name: str | None = None, author: str | None = None) -> Json:
    """Make a complete draft the demonstration of the tool by an expert; other experts' stay.

    Raises:
        IncompleteSequence: Names the regions without a number.
    """

    def change(session: Session) -> Json:
        row = present(session, ToolRow, tool_id)
        cut = ready_segmentation(session, row)
        draft = _draft(session, cut, change=True)
        missing = [r.name for a, r in enumerate(ctx.values.tool(session, cut).regions) if a not in draft.sequence]
        if missing:
            raise IncompleteSequence(
                f"{', '.join(missing)} {'has' if len(missing) == 1 else 'have'} no number yet; an order holds every region once."
            )
        times = _relative(draft.click_times)
        shown = add_demonstration(session, row, cut, draft.sequence, "recorded", name=name, author=author, click_times=times)
        if draft in session:
            session.delete(draft)
        emit(session, "draft.changed", row.project_id, tool_id=tool_id)
        return demonstration_json(ctx.values, session, shown)

    return ctx.store.write(change)


def draft_json(ctx: Context, session: Session, row: ToolRow, cut: Segmentation, draft: Draft, author: str | None = None) -> Json:
    """The draft as REST shows it."""
    complete = len(draft.sequence) == cut.region_count
    return {
        "tool_id": row.id,
        "sequence": draft.sequence,
        "click_times": _relative(draft.click_times),
        "can_undo": bool(draft.past),
        "can_redo": bool(draft.future),
        "complete": complete,
        "older": older_draft(ctx.values, session, cut),
        "coverage_gain": _gain(ctx, session, row, draft, author) if complete else None,
    }


def _gain(ctx: Context, session: Session, row: ToolRow, draft: Draft, author: str | None) -> Json:
    """What saving the draft does to rho."""
    project = present(session, Project, row.project_id)
    standing_report = report_of(ctx.values, session, project, ())[1]
    report = report_of(ctx.values, session, project, ((row.id, expert_key(author), tuple(draft.sequence)),))[1]
    before = standing_report.rho if standing_report else 0.0
    after = report.rho if report else 0.0
    covered = f"{report.captured if report else 0} of {report.possible if report else 0} situations covered"
    if after > before:
        text = f"Saving it raises coverage from {before:.2f} to {after:.2f}: {covered}."
    else:
        text = f"Saving it leaves coverage at {after:.2f}: {covered}."
    return {"before": before, "after": after, "text": text}


def _change(ctx: Context, tool_id: str, step: Any) -> Json:
    """Change the draft in one transaction."""

    def change(session: Session) -> None:
        row = present(session, ToolRow, tool_id)
        cut = ready_segmentation(session, row)
        draft = _draft(session, cut, change=True)
        step(session, row, cut, draft)
        draft.updated_at = now()
        session.add(draft)
        emit(session, "draft.changed", row.project_id, tool_id=tool_id)

    ctx.store.write(change)
    return get_draft(ctx, tool_id)


def _draft(session: Session, cut: Segmentation, *, change: bool = False) -> Draft:
    """The draft on these regions; one on earlier regions counts for nothing, and a change takes its place."""
    draft = session.get(Draft, cut.tool_id)
    if draft is not None and same_regions(session, draft.segmentation_id, cut):
        return draft
    if draft is None or not change:
        return Draft(tool_id=cut.tool_id, segmentation_id=cut.id, sequence=[], click_times=[], past=[], future=[])
    draft.segmentation_id = cut.id
    draft.sequence, draft.click_times, draft.past, draft.future = [], [], [], []
    return draft


def _set(draft: Draft, sequence: list[int], times: list[float]) -> None:
    draft.past = [*draft.past, [draft.sequence, draft.click_times]][-KEPT_STEPS:]
    draft.future = []
    draft.sequence, draft.click_times = sequence, times


def _restore(draft: Draft, step: list[list[float]]) -> None:
    draft.sequence, draft.click_times = [int(a) for a in step[0]], list(step[1])


def _seconds() -> float:
    return datetime.now(UTC).timestamp()


def _relative(times: list[float]) -> list[float]:
    return [round(t - min(times), 3) for t in times]
