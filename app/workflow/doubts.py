"""The expert doubts the order for one tool: questions about it, and dropping what they found. The orders are kept in `exceptions`."""

from typing import Any

from sqlmodel import Session

from app.errors import Conflict, InvalidInput, NotFound
from app.learning.soft_graph import MOST_REGIONS
from app.storage.tables import PolicyRow, Project, Run, RunDemonstration, Segmentation, ToolRow
from app.workflow.context import Context
from app.workflow.exceptions import drop, kept_orders
from app.workflow.lookup import check_tools, found, present, ready_segmentation, refuse_while_training, standing
from app.workflow.run_rows import demonstrations_of, run_json, train_on

Json = dict[str, Any]

KIND = "exception"  # of a run


def ask_about(ctx: Context, policy_id: str, tool_id: str, seed: int | None = None) -> Json:
    """Start asking which order the expert wants on one tool.

    Raises:
        InvalidInput: The tool has a recorded order, other features than the policy, or too many regions.
        RunActive: Another run of the project is not at its end.
    """

    def change(session: Session) -> Json:
        policy, tool = found(session, PolicyRow, policy_id, "policy"), present(session, ToolRow, tool_id)
        if tool.project_id != policy.project_id:
            raise NotFound(f"There is no tool with the id {tool_id!r} in the project of this policy.")
        refuse_while_training(session, found(session, Project, policy.project_id, "project"))
        cut, learned = ready_segmentation(session, tool), found(session, Run, policy.run_id, "run")
        shown = _suitable(session, tool, cut, learned)
        row = Run(
            project_id=policy.project_id,
            kind=KIND,
            mode="certified",
            authors=learned.authors,
            interest=[cut.id],
            seed=1 if seed is None else seed,
            params={},
            interactions=[],
            features=learned.features,
            based_on=policy.id,
        )
        session.add(row)
        session.flush()
        for position, demonstration_id, of_tool in shown:
            session.add(RunDemonstration(run_id=row.id, position=position, demonstration_id=demonstration_id, tool_id=of_tool))
        session.flush()
        check_tools(session, row)
        train_on(session, row, f"Looking for orders you may want on {tool.name}.")
        return run_json(session, row)

    return ctx.store.write(change)


def drop_exception(ctx: Context, tool_id: str) -> None:
    """Let the policy decide on a tool again.

    Raises:
        Conflict: The tool has no order of its own.
    """

    def change(session: Session) -> None:
        tool = present(session, ToolRow, tool_id)
        rows = kept_orders(session, tool.id)
        if not rows:
            raise Conflict(f"{tool.name} has no order of its own; the policy decides.")
        drop(session, rows)

    ctx.store.write(change)


def _suitable(session: Session, tool: ToolRow, cut: Segmentation, learned: Run) -> list[tuple[int, str, str]]:
    """Position, id and tool of the demonstrations a policy was learned from that likelihood can be computed on."""
    if any(d.tool_id == tool.id for d in standing(session, tool.project_id)):
        raise InvalidInput(f"{tool.name} has a recorded order. Record it again instead of answering questions about it.")
    if cut.region_count > MOST_REGIONS:
        raise InvalidInput(
            f"Questions about one tool work up to {MOST_REGIONS} regions; {tool.name} has {cut.region_count}. Record its order instead."
        )
    cuts = [(d, found(session, Segmentation, d.segmentation_id, "segmentation")) for d in demonstrations_of(session, learned.id)]
    if any(c.feature_set != cut.feature_set for _, c in cuts):
        raise InvalidInput(f"{tool.name} is described by other features than the tools this policy was learned from.")
    kept = [(d.id, d.tool_id) for d, c in cuts if c.region_count <= MOST_REGIONS]
    if not kept:
        raise InvalidInput(
            f"Questions about one tool need a recorded order on a tool of at most {MOST_REGIONS} regions; this policy has none."
        )
    return [(position, *ids) for position, ids in enumerate(kept)]
