"""Policies, and the plans they make: the lowest-cost order for a tool, its reasons, and what another order would cost."""

import math
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from sqlmodel import Session, col, select

from app.errors import IncompleteSequence
from app.learning.effort_features import effort_penalty
from app.learning.policy import Policy
from app.learning.prediction import Prediction, predict
from app.sequencing.constraints import Constraints, resolve
from app.sequencing.features import base_name
from app.sequencing.problem import SequencingProblem, check_sequence
from app.storage import emit
from app.storage.tables import Plan, PolicyRow, Project, Segmentation, ToolRow
from app.workflow.bound_job import as_stored, go_on_looking
from app.workflow.context import Context
from app.workflow.exceptions import standing_exception
from app.workflow.feature_choice import ANY_TOOL, stored_features
from app.workflow.lookup import found, present, ready_segmentation
from app.workflow.policy_rows import plan_json, policy_json, policy_value
from app.workflow.values import interactions_from

Json = dict[str, Any]

BOUND_SECONDS = 0.3  # for a first limit of how far an order that is not proved may be off; `bound_job` looks for closer ones


def list_policies(ctx: Context, project_id: str) -> list[Json]:
    """The policies of a project, newest first."""

    def query(session: Session) -> list[Json]:
        present(session, Project, project_id)
        rows = session.exec(select(PolicyRow).where(PolicyRow.project_id == project_id).order_by(col(PolicyRow.id).desc())).all()
        return [policy_json(session, row) for row in rows]

    return ctx.store.read(query)


def get_policy(ctx: Context, policy_id: str) -> Json:
    """One policy."""
    return ctx.store.read(lambda session: policy_json(session, found(session, PolicyRow, policy_id, "policy")))


def make_plan(ctx: Context, policy_id: str, tool_id: str, constraints: Constraints | None = None) -> Json:
    """The lowest-cost sequence for a tool, computed now; the expert's own order where the tool has one and nothing else is asked for.

    Raises:
        ContradictoryConstraints: The constraints on the order can't hold together; names them.
        StalePolicy: The tool has another feature set than the policy was learned with.
    """
    cut_id, problem, policy_of_plan, names = ctx.store.read(lambda session: _to_predict(ctx, session, policy_id, tool_id))
    resolve(constraints, problem.n, names)  # refused in the names the user gave
    started = time.perf_counter()
    prediction = predict(problem, policy_of_plan, _deadline(BOUND_SECONDS), constraints)
    milliseconds = 1000 * (time.perf_counter() - started)
    wanted = None if constraints is not None and constraints != Constraints() else _exception(ctx, cut_id)
    if wanted is not None:
        cheapest, prediction = prediction.cost, _wanted(problem, policy_of_plan, prediction, tuple(wanted["sequence"]))
        wanted = {**wanted, "extra": prediction.cost - cheapest}

    def change(session: Session) -> Json:
        policy = found(session, PolicyRow, policy_id, "policy")
        present(session, ToolRow, tool_id)
        row = Plan(
            project_id=policy.project_id,
            policy_id=policy_id,
            tool_id=tool_id,
            segmentation_id=cut_id,
            sequence=[int(a) for a in prediction.sequence],
            result=_result(prediction, milliseconds) | {"constraints": as_stored(constraints), "exception": wanted},
        )
        session.add(row)
        session.flush()
        go_on_looking(session, row)
        emit(session, "plan.changed", policy.project_id, plan_id=row.id)
        return plan_json(ctx.values, session, row)

    return ctx.store.write(change)


def _exception(ctx: Context, cut_id: str) -> Json | None:
    """The order an expert wants on these regions."""

    def query(session: Session) -> Json | None:
        row = standing_exception(session, found(session, Segmentation, cut_id, "segmentation"))
        return None if row is None else {"sequence": row.sequence, "answers": row.answers, "probability": row.probability}

    return ctx.store.read(query)


def _wanted(problem: SequencingProblem, policy: Policy, cheapest: Prediction, order: tuple[int, ...]) -> Prediction:
    """The expert's own order with its cost under the policy."""
    parts = problem.steps_of(order) * policy.weights
    effort = None if policy.effort_weights is None else effort_penalty(problem, policy.effort_weights, order)
    method = "your answers about this tool"
    return replace(
        cheapest,
        sequence=order,
        cost=float(parts.sum()),
        ties=1,
        counted=True,
        proved=False,
        method=method,
        effort=effort,
        step_parts=parts,
        tie_settled_by=None,
    )


def get_plan(ctx: Context, plan_id: str) -> Json:
    """One plan."""
    return ctx.store.read(lambda session: plan_json(ctx.values, session, found(session, Plan, plan_id, "plan")))


def list_plans(ctx: Context, policy_id: str) -> list[Json]:
    """The plans made with a policy, newest first."""

    def query(session: Session) -> list[Json]:
        found(session, PolicyRow, policy_id, "policy")
        rows = session.exec(select(Plan).where(Plan.policy_id == policy_id).order_by(col(Plan.id).desc())).all()
        return [plan_json(ctx.values, session, row) for row in rows]

    return ctx.store.read(query)


def what_if(ctx: Context, plan_id: str, sequence: list[int]) -> Json:
    """What another order of the same tool costs under the same policy, and through which features.

    Raises:
        IncompleteSequence: The order misses or repeats regions.
    """

    def query(session: Session) -> Json:
        row = found(session, Plan, plan_id, "plan")
        cut = found(session, Segmentation, row.segmentation_id, "segmentation")
        order = _of_the_same_regions(sequence, row.sequence, cut.region_count)
        policy = policy_value(found(session, PolicyRow, row.policy_id, "policy"))
        problem = ctx.values.problem(session, cut, policy.interactions, stored_features(session, policy.features))
        parts = policy.weights * (problem.steps_of(order).sum(axis=0) - problem.steps_of(row.sequence).sum(axis=0))
        delta = float(parts.sum())
        features = [{"label": column.label, "delta": float(part)} for column, part in zip(problem.columns, parts, strict=True)]
        return {"cost": row.result["cost"] + delta, "delta": delta, "features": features}

    return ctx.store.read(query)


def _of_the_same_regions(sequence: list[int], planned: list[int], count: int) -> tuple[int, ...]:
    """The sequence, if it holds what the plan holds: all regions, or all that are not left out."""
    if len(planned) == count:
        return check_sequence(sequence, count)
    if sorted(sequence) != sorted(planned):
        raise IncompleteSequence("The order must hold every region of the plan once, and none of those left out.")
    return tuple(sequence)


def _to_predict(ctx: Context, session: Session, policy_id: str, tool_id: str) -> tuple[str, SequencingProblem, Policy, list[str]]:
    policy = found(session, PolicyRow, policy_id, "policy")
    cut = ready_segmentation(session, present(session, ToolRow, tool_id))
    # of a tool with another feature set: `predict` refuses it in words
    suits = base_name(policy.feature_set) in (cut.feature_set, ANY_TOOL)
    counted = (interactions_from(policy.interactions), stored_features(session, policy.feature_set)) if suits else ((), None)
    problem = ctx.values.problem(session, cut, *counted)
    names = [region.name for region in ctx.values.tool(session, cut).regions]
    return cut.id, problem, policy_value(policy), names


def _deadline(seconds: float) -> Callable[[], bool]:
    """True from `seconds` after its first use."""
    end: list[float] = []

    def over() -> bool:
        if not end:
            end.append(time.monotonic() + seconds)
        return time.monotonic() > end[0]

    return over


def _result(prediction: Prediction, milliseconds: float) -> Json:
    return {
        "cost": float(prediction.cost),
        "ties": int(prediction.ties),
        "counted": bool(prediction.counted),
        "proved": bool(prediction.proved),
        "bound": float(prediction.bound) if math.isfinite(prediction.bound) else None,
        "method": prediction.method,
        "effort": None if prediction.effort is None else float(prediction.effort),
        "tie_settled_by": prediction.tie_settled_by,
        "milliseconds": round(milliseconds, 1),
        "parts": [[float(x) for x in step] for step in prediction.step_parts],
    }
