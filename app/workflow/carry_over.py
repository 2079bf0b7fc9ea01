"""Orders clicked on an older cut of a tool: whether they still hold, and taking them over to the current one."""

from typing import Any

from sqlmodel import Session

from app.errors import Conflict
from app.geometry.carry_over import why_not
from app.storage import emit
from app.storage.tables import Demonstration, Draft, Segmentation, ToolRow
from app.workflow.context import Context
from app.workflow.lookup import current_segmentation, found, present, ready_segmentation, refuse_training_on, same_regions
from app.workflow.values import Values

Json = dict[str, Any]


def standing_of(values: Values, session: Session, row: Demonstration) -> Json:
    """Whether a demonstration is on the current regions of its tool; if not, whether it can be taken over, and why not."""
    cut = current_segmentation(session, row.tool_id)
    if cut is None or same_regions(session, row.segmentation_id, cut):
        return {"on_current_cut": cut is not None, "can_carry_over": False, "why": ""}
    order, why = _moved(values, session, row.segmentation_id, cut, row.sequence, whole=True)
    return {"on_current_cut": False, "can_carry_over": order is not None, "why": why}


def carried_over(ctx: Context, session: Session, row: Demonstration) -> tuple[ToolRow, Segmentation, list[int]]:
    """The demonstration's order in the regions of today.

    Raises:
        Conflict: It is on them already, or the regions don't map one to one; says which.
        RunActive: A run learns from the tool.
    """
    tool = present(session, ToolRow, row.tool_id)
    cut = ready_segmentation(session, tool)
    if same_regions(session, row.segmentation_id, cut):
        raise Conflict(f"{row.name} was recorded on the current regions; there is nothing to carry over.")
    refuse_training_on(session, tool)
    order, why = _moved(ctx.values, session, row.segmentation_id, cut, row.sequence, whole=True)
    if order is None:
        raise Conflict(f"{row.name} can't be carried over: {why} Record the order again.")
    return tool, cut, order


def older_draft(values: Values, session: Session, cut: Segmentation) -> Json | None:
    """What is left of clicks on an older cut of the tool."""
    draft = session.get(Draft, cut.tool_id)
    if draft is None or not draft.sequence or same_regions(session, draft.segmentation_id, cut):
        return None
    order, why = _moved(values, session, draft.segmentation_id, cut, draft.sequence, whole=False)
    return {"placed": len(draft.sequence), "can_carry_over": order is not None, "why": why}


def carry_over_draft(ctx: Context, tool_id: str) -> None:
    """Go on with the clicks made on an older cut.

    Raises:
        Conflict: There are none, or a clicked region is no longer what it was.
    """

    def change(session: Session) -> None:
        row = present(session, ToolRow, tool_id)
        cut = ready_segmentation(session, row)
        draft = session.get(Draft, tool_id)
        if draft is None or not draft.sequence or same_regions(session, draft.segmentation_id, cut):
            raise Conflict(f"There are no clicks on older regions of {row.name}.")
        order, why = _moved(ctx.values, session, draft.segmentation_id, cut, draft.sequence, whole=False)
        if order is None:
            raise Conflict(f"The clicks can't be carried over: {why} Click the order again.")
        draft.segmentation_id, draft.sequence, draft.past, draft.future = cut.id, order, [], []
        session.add(draft)
        emit(session, "draft.changed", row.project_id, tool_id=tool_id)

    ctx.store.read(lambda session: older_draft(ctx.values, session, ready_segmentation(session, present(session, ToolRow, tool_id))))
    ctx.store.write(change)


def _moved(
    values: Values, session: Session, segmentation_id: str, cut: Segmentation, sequence: list[int], *, whole: bool
) -> tuple[list[int] | None, str]:
    """A sequence in the regions of another cut, or None and the reason in words.

    Args:
        values: Core values.
        session: Of the database.
        segmentation_id: What the sequence was clicked on.
        cut: What it should hold on.
        sequence: The regions in order.
        whole: Whether all regions of both cuts have to map, or only those in the sequence.
    """
    old = found(session, Segmentation, segmentation_id, "segmentation")
    if values.tool(session, old).graph.source != "mesh" or values.tool(session, cut).graph.source != "mesh":
        return None, "It belongs to another version of the region table."
    mapped = values.region_map(session, old, cut)
    order = [int(mapped.new_of[a]) for a in sequence]
    if (mapped.complete or not whole) and min(order, default=0) >= 0:
        return order, "The regions are the same; only their numbers differ."
    return None, why_not(values.tool(session, old), values.tool(session, cut), mapped)
