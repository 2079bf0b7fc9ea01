"""Policies and plans as REST shows them, and as the core sees them."""

import math
from typing import Any

import numpy as np
from sqlmodel import Session

from app.jobs.rows import unfinished_job
from app.learning.effort_features import ALL_COLUMNS
from app.learning.policy import Policy
from app.sequencing.features import Feature, interaction_column
from app.sequencing.shortest import gap_between
from app.storage.tables import Plan, PolicyRow, Segmentation, ToolRow
from app.workflow.feature_choice import stored_features
from app.workflow.lookup import found, standing
from app.workflow.values import Values, interactions_from

Json = dict[str, Any]


def policy_value(row: PolicyRow) -> Policy:
    """The policy as the core sees it."""
    effort = None if row.effort_weights is None else np.array(row.effort_weights)
    interactions = interactions_from(row.interactions)
    return Policy(np.array(row.weights), row.feature_set, row.feature_version, interactions, effort, tuple(row.identifiable))


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


def plan_json(values: Values, session: Session, row: Plan) -> Json:
    """The plan as REST shows it."""
    cut = found(session, Segmentation, row.segmentation_id, "segmentation")
    tool = values.tool(session, cut)
    policy = found(session, PolicyRow, row.policy_id, "policy")
    parts: list[list[float]] = row.result["parts"]
    return {
        "id": row.id,
        "policy_id": row.policy_id,
        "tool_id": row.tool_id,
        "tool_name": found(session, ToolRow, row.tool_id, "tool").name,
        "sequence": row.sequence,
        **{key: row.result[key] for key in ("cost", "ties", "proved", "method", "effort", "tie_settled_by", "milliseconds")},
        "counted": _counted(row.result),
        **_sureness(row.result),
        "looking": not row.result["proved"] and unfinished_job(session, row.id) is not None,
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


def _counted(result: Json) -> str:
    """Whether all orders of this cost are counted in `ties`; plans made before that was kept say it in words."""
    everything = result.get("counted", result["proved"] and "At least" not in result["method"])
    return "exactly" if everything else "at least"


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
