"""Experts: who has recorded orders, compared with each other; and pictures of a tool with an order."""

from typing import Annotated

from fastapi import APIRouter, Query, Response

from app.api.dependencies import Ctx, Row
from app.api.idempotency import ActionRoute
from app.workflow import experts as workflow

router = APIRouter(tags=["experts"], route_class=ActionRoute)

Order = Annotated[str, Query(max_length=6000, pattern=r"^\d{1,6}(,\d{1,6})*$", description="Region ids in working order, with commas.")]
PICTURE_POLICY = "default-src 'none'; style-src 'unsafe-inline'"


class Expert(Row):
    """Somebody with orders that count."""

    name: str
    own: bool  # the project's own expert: orders without a name, or those of a table or the sample
    demonstrations: list[str]
    tools: list[str]
    explained: bool | None  # one set of weights explains all of this expert's orders; null: not tried
    orders_again: int  # orders that took the place of an earlier one of the same expert
    orders_same: int  # of them, exactly the same order
    orders_agreement: float | None  # mean Kendall tau of both


class ExpertPair(Row):
    """Two experts on the tools both have recorded."""

    first: str
    second: str
    tools: int
    same: int
    just_as_good: int  # another order, of which both would say that it costs no more than their own
    agreement: float | None  # mean Kendall tau
    expected_agreement: float | None  # of the orders that what each taught leads to, on all tools
    text: str


class ExpertOrder(Row):
    """One side of a comparison."""

    author: str
    sequence: list[int]


class ToolAgreement(Row):
    """One tool, two experts."""

    tool_id: str
    tool_name: str
    recorded: bool  # false: at least one order is what the expert's other orders lead to
    first: ExpertOrder
    second: ExpertOrder
    agreement: float  # Kendall tau
    just_as_good: bool | None
    extra: float | None  # how much dearer one's order is to the other, relative, whichever is more
    differs: list[int]
    text: str


class ClashingOrder(Row):
    """One of a smallest set of orders that no weights explain together."""

    tool_id: str
    tool_name: str
    author: str


class Pooling(Row):
    """Whether learning from everybody at once is safe."""

    safe: bool | None
    text: str
    clash: list[ClashingOrder]


class ExpertReport(Row):
    """Experts side by side; empty comparisons with fewer than two."""

    experts: list[Expert]
    pairs: list[ExpertPair]
    tools: list[ToolAgreement]
    pooling: Pooling


@router.get("/projects/{project_id}/experts")
def compare_experts(ctx: Ctx, project_id: str) -> ExpertReport:
    """Who has recorded what, where experts agree and differ, and whether their orders can be pooled."""
    return ExpertReport.model_validate(workflow.experts(ctx, project_id))


@router.get("/tools/{tool_id}/picture.svg", response_class=Response, responses={200: {"content": {"image/svg+xml": {}}}})
def tool_picture(ctx: Ctx, tool_id: str, sequence: Order, beside: Order | None = None) -> Response:
    """The tool with its regions numbered in an order; those at another step in `beside` have a thick ring."""
    orders = [[int(a) for a in text.split(",")] if text else None for text in (sequence, beside)]
    svg = workflow.tool_picture(ctx, tool_id, orders[0] or [], orders[1])
    return Response(svg, media_type="image/svg+xml", headers={"Content-Security-Policy": PICTURE_POLICY})
