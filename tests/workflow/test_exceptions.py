"""Orders for one tool: asked about, kept with the tool, used by plans, dropped, and taken back with the answer."""

from typing import Any

import pytest

from app.errors import Conflict, InvalidInput
from app.workflow import demonstrations, doubts, policies, runs
from app.workflow.context import Context
from tests.workflow.conftest import open_questions, project_of, settle, tool_without_order

Json = dict[str, Any]
QUICK = {"samples": 8, "most": 1}


def learned(ctx: Context) -> Json:
    """A run that has a policy."""
    run = settle(ctx, runs.start_run(ctx, project_of(ctx)["id"], "performance", QUICK, 1))
    while run["state"] == "waiting_for_expert":
        for query in open_questions(ctx, run):
            runs.answer(ctx, query["id"], "cant_tell")
        run = settle(ctx, run)
    assert run["policy_id"] is not None, run
    return run


def test_orders_for_one_tool(sample: Context) -> None:
    """One policy for all of it: learning takes the longest."""
    policy, tool = learned(sample)["policy_id"], tool_without_order(sample)
    check_my_way_counts_until_it_is_dropped(sample, policy, tool)
    check_a_recorded_order_is_not_asked_about(sample, policy)


def check_my_way_counts_until_it_is_dropped(sample: Context, policy: str, tool: Json) -> None:
    before = policies.make_plan(sample, policy, tool["id"])
    run = settle(sample, doubts.ask_about(sample, policy, tool["id"]))
    (query,) = open_questions(sample, run)
    assert (query["kind"], query["tool_id"], run["about"]) == ("closer", tool["id"], tool["id"])
    answer = runs.answer(sample, query["id"], "right_mine")
    assert settle(sample, run)["state"] == "converged"
    plan = policies.make_plan(sample, policy, tool["id"])
    assert plan["sequence"] == query["right"]["sequence"]
    assert plan["exception"]["extra"] == pytest.approx(plan["cost"] - before["cost"])
    assert (plan["exception"]["probability"], plan["sureness"]) == (1, "Your order for this tool")
    assert sum(step["total"] for step in plan["steps"]) == pytest.approx(plan["cost"])

    runs.undo_answer(sample, answer["id"])
    assert policies.make_plan(sample, policy, tool["id"])["sequence"] == before["sequence"]
    runs.answer(sample, query["id"], "left_mine")
    settle(sample, run)
    assert policies.make_plan(sample, policy, tool["id"])["sequence"] == query["left"]["sequence"]
    doubts.drop_exception(sample, tool["id"])
    assert policies.make_plan(sample, policy, tool["id"])["sequence"] == before["sequence"]
    with pytest.raises(Conflict, match="no order of its own"):
        doubts.drop_exception(sample, tool["id"])


def check_a_recorded_order_is_not_asked_about(sample: Context, policy: str) -> None:
    shown = demonstrations.list_demonstrations(sample, project_id=project_of(sample)["id"])[0]
    with pytest.raises(InvalidInput, match="Record it again"):
        doubts.ask_about(sample, policy, shown["tool_id"])
