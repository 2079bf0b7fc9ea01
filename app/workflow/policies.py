"""Policies, and the plans they make: the lowest-cost order for a tool, its reasons, and what another order would cost."""

import math
import time
from collections.abc import Callable
from dataclasses import asdict, replace
from typing import Any

import numpy as np
from sqlmodel import Session, col, select

from app.errors import IncompleteSequence
from app.learning.effort_features import ALL_COLUMNS, effort_penalty
from app.learning.policy import Policy
from app.learning.prediction import Prediction, predict
from app.sequencing.constraints import Constraints, resolve
from app.sequencing.features import Feature, base_name, interaction_column
from app.sequencing.problem import SequencingProblem, check_sequence
from app.sequencing.shortest import gap_between
from app.storage import emit
from app.storage.tables import Plan, PolicyRow, Project, Segmentation, ToolRow
from app.workflow.context import Context
from app.workflow.exceptions import standing_exception
from app.workflow.feature_choice import ANY_TOOL, stored_features
from app.workflow.lookup import found, present, ready_segmentation, standing
from app.workflow.values import interactions_from

Json = dict[str, Any]

BOUND_SECONDS = 3.0  # for how far an order that is not proved may be above the cheapest


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


def policy_value(row: PolicyRow) -> Policy:
    """The policy as the core sees it."""
    effort = None if row.effort_weights is None else np.array(row.effort_weights)
    interactions = interactions_from(row.interactions)
    return Policy(np.array(row.weights), row.feature_set, row.feature_version, interactions, effort, tuple(row.identifiable))


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
            result=_result(prediction, milliseconds) | {"constraints": asdict(constraints) if constraints else None, "exception": wanted},
        )
        session.add(row)
        session.flush()
        emit(session, "plan.changed", policy.project_id, plan_id=row.id)
        return plan_json(ctx, session, row)

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
        proved=False,
        method=method,
        effort=effort,
        step_parts=parts,
        tie_settled_by=None,
    )


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


def policy_json(session: Session, row: PolicyRow) -> Json:
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
            {"key": c.key, "label": c.label, "symbol": c.symbol, "value": value, "identifiable": sure, "share": share, "interval": interval}
            for c, value, sure, (share, interval) in zip(_columns(session, row), row.weights, row.identifiable, _shares(row), strict=True)
        ],
        "effort_weights": None
        if effort is None
        else [{"key": key, "label": label, "value": value} for (key, label), value in zip(ALL_COLUMNS, effort, strict=False)],
        "converged": row.converged,
        "certificate": row.certificate,
        "learned_from": row.learned_from,
        "created_at": row.created_at,
    }


def _shares(row: PolicyRow) -> list[tuple[float | None, list[float] | None]]:
    """Per weight its share of all and where 90 % of the weights lie that agree with what was shown; nothing where it wasn't measured."""
    certificate = row.certificate or {}
    shares, intervals = certificate.get("shares", []), certificate.get("intervals", [])
    if not len(shares) == len(intervals) == len(row.weights):
        return [(None, None)] * len(row.weights)
    return list(zip(shares, intervals, strict=True))


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
        **_sureness(row.result),
        "constraints": row.result.get("constraints"),
        "exception": row.result.get("exception"),
        "orders": f"{math.factorial(len(row.sequence)):,}",
        "features": [{"key": c.key, "label": c.label, "symbol": c.symbol} for c in _columns(session, policy)],
        "steps": [
            {"region": a, "name": tool.regions[a].name, "total": math.fsum(step), "parts": step}
            for a, step in zip(row.sequence, parts, strict=True)
        ],
        "demonstrated": row.tool_id in {d.tool_id for d in standing(session, row.project_id)},
        "created_at": row.created_at,
    }


def _columns(session: Session, row: PolicyRow) -> tuple[Feature, ...]:
    features = stored_features(session, row.feature_set)
    added = tuple(interaction_column(k, i, features) for k, i in enumerate(interactions_from(row.interactions)))
    return features.columns + added


def _sureness(result: Json) -> Json:
    """The bound, the gap and one sentence; plans made before there were bounds have none."""
    bound = result.get("bound", result["cost"] if result["proved"] else None)
    gap = None if bound is None else gap_between(result["cost"], bound)
    if gap is not None and not math.isfinite(gap):
        gap = None
    own = result.get("exception") is not None
    words = "Your order for this tool" if own else sureness_words(cost=result["cost"], proved=result["proved"], bound=bound)
    return {"bound": bound, "gap": gap, "sureness": words}


def sureness_words(cost: float, proved: bool, bound: float | None) -> str:
    """'Proved optimal', or how far the order may be above the optimum at most; in units of cost where a share means nothing."""
    if proved:
        return "Proved optimal"
    if bound is None:
        return "Best found, no limit known"
    if bound > 0.01 * abs(cost):
        percent = 100 * (cost - bound) / bound
        shown = f"{math.ceil(10 * percent) / 10:.1f}" if percent < 10 else f"{math.ceil(percent)}"
        return f"Best found, at most {shown} % above the optimum"
    return f"Best found, at most {cost - bound:.3g} above the optimum"


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
        "proved": bool(prediction.proved),
        "bound": float(prediction.bound) if math.isfinite(prediction.bound) else None,
        "method": prediction.method,
        "effort": None if prediction.effort is None else float(prediction.effort),
        "tie_settled_by": prediction.tie_settled_by,
        "milliseconds": round(milliseconds, 1),
        "parts": [[float(x) for x in step] for step in prediction.step_parts],
    }
