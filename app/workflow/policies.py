"""Policies, and the plans they make: the lowest-cost order for a tool, its reasons, and what another order would cost."""

import math
import time
from typing import Any

import numpy as np
from sqlmodel import Session, col, select

from app.learning.effort_features import EFFORT_COLUMNS
from app.learning.policy import Policy
from app.learning.prediction import Prediction, predict
from app.sequencing.features import FEATURE_SETS, Feature, interaction_column
from app.sequencing.problem import check_sequence
from app.storage import emit
from app.storage.tables import Plan, PolicyRow, Project, Segmentation, ToolRow
from app.workflow.context import Context
from app.workflow.lookup import found, present, ready_segmentation, standing
from app.workflow.values import interactions_from

Json = dict[str, Any]


def list_policies(ctx: Context, project_id: str) -> list[Json]:
    """The policies of a project, newest first."""

    def query(session: Session) -> list[Json]:
        present(session, Project, project_id)
        rows = session.exec(select(PolicyRow).where(PolicyRow.project_id == project_id).order_by(col(PolicyRow.id).desc())).all()
        return [policy_json(row) for row in rows]

    return ctx.store.read(query)


def get_policy(ctx: Context, policy_id: str) -> Json:
    """One policy."""
    return ctx.store.read(lambda session: policy_json(found(session, PolicyRow, policy_id, "policy")))


def policy_value(row: PolicyRow) -> Policy:
    """The policy as the core sees it."""
    effort = None if row.effort_weights is None else np.array(row.effort_weights)
    interactions = interactions_from(row.interactions)
    return Policy(np.array(row.weights), row.feature_set, row.feature_version, interactions, effort, tuple(row.identifiable))


def make_plan(ctx: Context, policy_id: str, tool_id: str) -> Json:
    """The lowest-cost sequence for a tool, computed now.

    Raises:
        StalePolicy: The tool has another feature set than the policy was learned with.
    """
    found_plan = ctx.store.read(lambda session: _predict(ctx, session, policy_id, tool_id))
    cut_id, prediction, milliseconds = found_plan

    def change(session: Session) -> Json:
        policy = found(session, PolicyRow, policy_id, "policy")
        present(session, ToolRow, tool_id)
        row = Plan(
            project_id=policy.project_id,
            policy_id=policy_id,
            tool_id=tool_id,
            segmentation_id=cut_id,
            sequence=[int(a) for a in prediction.sequence],
            result=_result(prediction, milliseconds),
        )
        session.add(row)
        session.flush()
        emit(session, "plan.changed", policy.project_id, plan_id=row.id)
        return plan_json(ctx, session, row)

    return ctx.store.write(change)


def get_plan(ctx: Context, plan_id: str) -> Json:
    """One plan."""
    return ctx.store.read(lambda session: plan_json(ctx, session, found(session, Plan, plan_id, "plan")))


def list_plans(ctx: Context, policy_id: str) -> list[Json]:
    """The plans made with a policy, newest first."""

    def query(session: Session) -> list[Json]:
        found(session, PolicyRow, policy_id, "policy")
        rows = session.exec(select(Plan).where(Plan.policy_id == policy_id).order_by(col(Plan.id).desc())).all()
        return [plan_json(ctx, session, row) for row in rows]

    return ctx.store.read(query)


def what_if(ctx: Context, plan_id: str, sequence: list[int]) -> Json:
    """What another order of the same tool costs under the same policy, and through which features.

    Raises:
        IncompleteSequence: The order misses or repeats regions.
    """

    def query(session: Session) -> Json:
        row = found(session, Plan, plan_id, "plan")
        cut = found(session, Segmentation, row.segmentation_id, "segmentation")
        order = check_sequence(sequence, cut.region_count)
        policy = policy_value(found(session, PolicyRow, row.policy_id, "policy"))
        problem = ctx.values.problem(session, cut, policy.interactions)
        parts = policy.weights * (problem.feature_sum(order) - problem.feature_sum(tuple(row.sequence)))
        delta = float(parts.sum())
        features = [{"label": column.label, "delta": float(part)} for column, part in zip(problem.columns, parts, strict=True)]
        return {"cost": row.result["cost"] + delta, "delta": delta, "features": features}

    return ctx.store.read(query)


def policy_json(row: PolicyRow) -> Json:
    """The policy as REST shows it."""
    effort = row.effort_weights
    return {
        "id": row.id,
        "project_id": row.project_id,
        "run_id": row.run_id,
        "name": row.name,
        "feature_set": row.feature_set,
        "interactions": row.interactions,
        "weights": [
            {"key": c.key, "label": c.label, "symbol": c.symbol, "value": value, "identifiable": sure}
            for c, value, sure in zip(_columns(row), row.weights, row.identifiable, strict=True)
        ],
        "effort_weights": None
        if effort is None
        else [{"key": key, "label": label, "value": value} for (key, label), value in zip(EFFORT_COLUMNS, effort, strict=True)],
        "converged": row.converged,
        "learned_from": row.learned_from,
        "created_at": row.created_at,
    }


def plan_json(ctx: Context, session: Session, row: Plan) -> Json:
    """The plan as REST shows it."""
    cut = found(session, Segmentation, row.segmentation_id, "segmentation")
    tool = ctx.values.tool(session, cut)
    policy = found(session, PolicyRow, row.policy_id, "policy")
    parts: list[list[float]] = row.result["parts"]
    return {
        "id": row.id,
        "policy_id": row.policy_id,
        "tool_id": row.tool_id,
        "tool_name": found(session, ToolRow, row.tool_id, "tool").name,
        "sequence": row.sequence,
        **{key: row.result[key] for key in ("cost", "ties", "proved", "method", "effort", "tie_settled_by", "milliseconds")},
        "orders": f"{math.factorial(len(row.sequence)):,}",
        "features": [{"key": c.key, "label": c.label, "symbol": c.symbol} for c in _columns(policy)],
        "steps": [
            {"region": a, "name": tool.regions[a].name, "total": math.fsum(step), "parts": step}
            for a, step in zip(row.sequence, parts, strict=True)
        ],
        "demonstrated": row.tool_id in {d.tool_id for d in standing(session, row.project_id)},
        "created_at": row.created_at,
    }


def _columns(row: PolicyRow) -> tuple[Feature, ...]:
    features = FEATURE_SETS[row.feature_set]
    added = tuple(interaction_column(k, i, features) for k, i in enumerate(interactions_from(row.interactions)))
    return features.columns + added


def _predict(ctx: Context, session: Session, policy_id: str, tool_id: str) -> tuple[str, Prediction, float]:
    policy = found(session, PolicyRow, policy_id, "policy")
    cut = ready_segmentation(session, present(session, ToolRow, tool_id))
    started = time.perf_counter()
    problem = ctx.values.problem(session, cut, interactions_from(policy.interactions)) if cut.feature_set == policy.feature_set else None
    if problem is None:
        problem = ctx.values.problem(session, cut, ())  # another feature set: `predict` refuses it in words
    prediction = predict(problem, policy_value(policy))
    return cut.id, prediction, 1000 * (time.perf_counter() - started)


def _result(prediction: Prediction, milliseconds: float) -> Json:
    return {
        "cost": float(prediction.cost),
        "ties": int(prediction.ties),
        "proved": bool(prediction.proved),
        "method": prediction.method,
        "effort": None if prediction.effort is None else float(prediction.effort),
        "tie_settled_by": prediction.tie_settled_by,
        "milliseconds": round(milliseconds, 1),
        "parts": [[float(x) for x in step] for step in prediction.step_parts],
    }
