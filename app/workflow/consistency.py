"""How alike the same expert decides twice: orders recorded again, questions answered again, and answers that sit ill with the others."""

from itertools import pairwise
from typing import Any

from sqlmodel import Session, col, select

from app.sequencing.comparison import kendall_tau
from app.storage.tables import Demonstration, Query, Run, Segmentation, ToolRow
from app.workflow.authors import expert_key
from app.workflow.lookup import found
from app.workflow.run_rows import current_answer

Json = dict[str, Any]

BY_HAND = ("recorded", "rest")  # orders that a person gave; those of tables and the sample are no repeats of anything


def recorded_again(session: Session, shown: list[Demonstration]) -> Json:
    """Orders among `shown` that took the place of earlier ones by the same expert on the same regions, and how alike both are.

    An earlier order that was deleted was a mistake and doesn't count.
    """
    found_alike = [tau for d in shown for tau in _agreements(session, d)]
    count = len(found_alike)
    return {
        "orders_again": count,
        "orders_same": sum(tau == 1 for tau in found_alike),
        "orders_agreement": round(sum(found_alike) / count, 4) if count else None,
    }


def _agreements(session: Session, shown: Demonstration) -> list[float]:
    """Kendall's tau of each order of a tool with the one recorded before, up to `shown`."""
    wanted = (
        select(Demonstration)
        .join(Segmentation, col(Segmentation.id) == col(Demonstration.segmentation_id))
        .where(
            Demonstration.tool_id == shown.tool_id,
            Segmentation.tool_sha == found(session, Segmentation, shown.segmentation_id, "segmentation").tool_sha,
            col(Demonstration.deleted_at).is_(None),
            col(Demonstration.source).in_(BY_HAND),
            col(Demonstration.id) <= shown.id,
        )
        .order_by(col(Demonstration.id))
    )
    orders = [d.sequence for d in session.exec(wanted) if expert_key(d.author) == expert_key(shown.author)]
    return [kendall_tau(a, b) for a, b in pairwise(orders)]


def consistency(session: Session, shown: list[Demonstration], answered: int, alike: int) -> Json:
    """What repeats say, in figures and in words.

    Args:
        session: Of the database.
        shown: The orders learned from.
        answered: Questions of the run answered twice.
        alike: Of them, with the same answer.
    """
    orders = recorded_again(session, shown)
    return {"answers_twice": answered, "answers_alike": alike, **orders, "text": _words(answered, alike, orders)}


def _words(answered: int, alike: int, orders: Json) -> str:
    parts = []
    if answered == 1:
        parts.append(f"One question was asked twice and answered {'the same way' if alike else 'differently'}.")
    elif answered:
        parts.append(f"{answered} questions were asked twice, and {alike} of them answered the same way.")
    if count := orders["orders_again"]:
        times = "One order was recorded a second time" if count == 1 else f"{count} orders were recorded again"
        same = "exactly as before" if orders["orders_same"] == count else f"agreement {orders['orders_agreement']:.2f}, where 1 is the same"
        parts.append(f"{times}: {same}.")
    return " ".join(parts)


def ill_fitting(session: Session, row: Run, fingerprints: list[str]) -> list[Json]:
    """The answers of a run that sit ill with the others, each with what is needed to look at it and to take it back."""
    told = []
    for name in fingerprints:
        query = session.exec(select(Query).where(Query.run_id == row.id, Query.fingerprint == name)).first()
        given = None if query is None else current_answer(session, query.id)
        if query is not None and given is not None:
            told.append(
                {
                    "query_id": query.id,
                    "answer_id": given.id,
                    "value": given.value,
                    "tool_id": query.tool_id,
                    "tool_name": found(session, ToolRow, query.tool_id, "tool").name,
                    "difference": query.difference,
                    "chosen": query.right if given.value == "right" else query.left,
                    "other": query.left if given.value == "right" else query.right,
                }
            )
    return told
