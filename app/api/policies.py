"""Policies and the plans they make for tools."""

from typing import Annotated, Any, Literal

from fastapi import APIRouter, Response
from pydantic import Field

from app.api.dependencies import Body, Ctx, Json, Paging, RegionOrder, Row, Seed, located, page
from app.api.idempotency import ActionRoute, IdempotencyKey
from app.api.runs import Run
from app.sequencing.constraints import Constraints
from app.workflow import doubts
from app.workflow import policies as workflow

router = APIRouter(tags=["policies"], route_class=ActionRoute)


class Weight(Row):
    """What one feature costs."""

    key: str
    label: str
    symbol: str | None = None
    value: float
    identifiable: bool = True
    share: float | None = None  # of all weights, each in the unit of its feature
    interval: list[float] | None = None  # where 90 % of the shares lie that agree with what was shown


class LearnedFrom(Row):
    """What the policy saw."""

    demonstrations: int
    answers: int


class Policy(Row):
    """Learned weights and the feature set they belong to."""

    id: str
    project_id: str
    run_id: str
    name: str
    feature_set: str
    interactions: list[Json]
    weights: list[Weight]
    effort_weights: list[Weight] | None
    converged: bool
    certificate: Json | None  # of a certified run: what is proved, and how sure each tool is
    learned_from: LearnedFrom
    created_at: str


class PolicyPage(Row):
    """Part of the list of policies."""

    items: list[Policy]
    next: str | None


RegionId = Annotated[int, Field(ge=0, le=999)]
Regions = Annotated[list[RegionId], Field(default_factory=list, max_length=200)]

Group = Annotated[list[RegionId], Field(min_length=1, max_length=200)]


class OrderConstraints(Body):
    """Wishes about an order; regions by id. Wishes that contradict each other are refused and named."""

    before: Annotated[list[tuple[Group, Group]], Field(default_factory=list, max_length=400)]  # groups: the first before the second
    first: RegionId | None = None
    last: RegionId | None = None
    never_next: Annotated[list[tuple[RegionId, RegionId]], Field(default_factory=list, max_length=400)]  # b never right after a
    skip: Regions  # left undone
    done: Regions  # finished already, in this order

    def value(self) -> Constraints:
        """As the core sees it."""
        before = tuple((tuple(first), tuple(second)) for first, second in self.before)
        return Constraints(before, self.first, self.last, tuple(self.never_next), tuple(self.skip), tuple(self.done))


class NewPlan(Body):
    """The tool to plan for, and what the order must respect."""

    tool_id: Annotated[str, Field(max_length=64)]
    constraints: OrderConstraints | None = None


class Doubt(Body):
    """The tool whose order is doubted."""

    tool_id: Annotated[str, Field(max_length=64)]
    seed: Seed | None = None


class WantedOrder(Row):
    """The order an expert wants on one tool, instead of the policy's."""

    answers: int
    probability: float  # given the answers; 1: the expert said that it is theirs
    extra: float  # cost above the policy's cheapest order


class WhatIf(Body):
    """Another order of the same tool."""

    sequence: RegionOrder


class PlanFeature(Row):
    """A column of the cost chart."""

    key: str
    label: str
    symbol: str


class PlanStep(Row):
    """A task and what it costs per feature."""

    region: int
    name: str
    total: float
    parts: list[float]


class Plan(Row):
    """The lowest-cost sequence for a tool, and how sure that is."""

    id: str
    policy_id: str
    tool_id: str
    tool_name: str
    sequence: list[int]
    cost: float
    ties: int  # orders of this cost, this one included
    counted: Literal["exactly", "at least"]  # how `ties` is meant
    proved: bool
    bound: float | None  # no order costs less; null when nothing can be said
    gap: float | None  # (cost - bound) / |cost|: 0 when proved
    looking: bool  # a closer bound is being looked for, half a minute at most; each one is told as plan.changed
    sureness: str  # "Proved optimal", or "Best found, at most x % above the optimum"
    method: str
    orders: str
    milliseconds: float
    effort: float | None
    tie_settled_by: str | None
    exception: WantedOrder | None = None
    constraints: dict[str, Any] | None = None  # what the order respects, as asked
    features: list[PlanFeature]
    steps: list[PlanStep]
    demonstrated: bool
    created_at: str


class PlanPage(Row):
    """Part of the list of plans."""

    items: list[Plan]
    next: str | None


class FeatureDelta(Row):
    """How much more one feature costs."""

    label: str
    delta: float


class Comparison(Row):
    """Another order against the plan."""

    cost: float
    delta: float
    features: list[FeatureDelta]


@router.get("/projects/{project_id}/policies")
def list_policies(ctx: Ctx, project_id: str, paging: Paging) -> PolicyPage:
    """The policies of a project."""
    return PolicyPage.model_validate(page(workflow.list_policies(ctx, project_id), paging))


@router.get("/policies/{policy_id}", response_model=Policy)
def get_policy(ctx: Ctx, policy_id: str) -> Json:
    """One policy."""
    return workflow.get_policy(ctx, policy_id)


@router.get("/policies/{policy_id}/plans")
def list_plans(ctx: Ctx, policy_id: str, paging: Paging) -> PlanPage:
    """The plans made with a policy."""
    return PlanPage.model_validate(page(workflow.list_plans(ctx, policy_id), paging))


@router.post("/policies/{policy_id}/plans", status_code=201, response_model=Plan)
def make_plan(ctx: Ctx, policy_id: str, body: NewPlan, response: Response, _key: IdempotencyKey = None) -> Json:
    """The lowest-cost sequence for a tool."""
    return located(response, "plans", workflow.make_plan(ctx, policy_id, body.tool_id, body.constraints and body.constraints.value()))


@router.post("/policies/{policy_id}/questions", status_code=202, response_model=Run)
def ask_about(ctx: Ctx, policy_id: str, body: Doubt, response: Response, _key: IdempotencyKey = None) -> Json:
    """Ask the expert about one tool whose order they doubt: at most three questions, then an order for that tool."""
    return located(response, "runs", doubts.ask_about(ctx, policy_id, body.tool_id, body.seed))


@router.delete("/tools/{tool_id}/exception", status_code=204)
def drop_exception(ctx: Ctx, tool_id: str) -> None:
    """Let the policy decide on the tool again."""
    doubts.drop_exception(ctx, tool_id)


@router.get("/plans/{plan_id}", response_model=Plan)
def get_plan(ctx: Ctx, plan_id: str) -> Json:
    """One plan."""
    return workflow.get_plan(ctx, plan_id)


@router.post("/plans/{plan_id}/what-if", response_model=Comparison)
def what_if(ctx: Ctx, plan_id: str, body: WhatIf, _key: IdempotencyKey = None) -> Json:
    """What another order would cost under the same policy."""
    return workflow.what_if(ctx, plan_id, body.sequence)
