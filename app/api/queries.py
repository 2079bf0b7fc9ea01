"""Queries: what a learner asks the expert, and the answers."""

from typing import Annotated, Literal

from fastapi import APIRouter, Query, Response

from app.api.dependencies import Body, Ctx, Json, Paging, Row, page
from app.api.idempotency import ActionRoute, IdempotencyKey
from app.workflow import queries as workflow

router = APIRouter(tags=["queries"], route_class=ActionRoute)

State = Literal["open", "answered", "withdrawn"]
WantedState = Annotated[State | None, Query(description="Only queries in this state.")]


class Side(Row):
    """One of the two sequences compared."""

    label: str
    note: str
    sequence: list[int]


class Choice(Row):
    """A possible answer and its key."""

    value: str
    label: str
    hint: str
    key: str


class GivenAnswer(Row):
    """The current answer."""

    id: str
    value: str
    created_at: str


class ExpertQuery(Row):
    """A question with everything needed to show it."""

    id: str
    run_id: str
    project_id: str
    kind: Literal["similarity", "preference", "pair", "closer"]
    state: State
    tool_id: str
    tool_name: str
    title: str
    left: Side
    right: Side
    difference: str
    why: str
    differs: list[int]  # regions at another step
    marked: list[int]  # where to look: these, or where most differ those that `difference` names
    number: int
    of: int
    choices: list[Choice]
    answer: GivenAnswer | None


class QueryPage(Row):
    """Part of a list of queries."""

    items: list[ExpertQuery]
    next: str | None


class NewAnswer(Body):
    """One of the query's choices."""

    value: Literal["similar", "not_similar", "cant_tell", "left", "right", "equal", "both_wrong", "left_mine", "right_mine"]


class Answer(Row):
    """A stored answer and what the run does now."""

    id: str
    query_id: str
    value: str
    created_at: str
    run_state: str


@router.get("/projects/{project_id}/queries")
def list_project_queries(ctx: Ctx, project_id: str, paging: Paging, state: WantedState = None) -> QueryPage:
    """The questions of all runs of a project."""
    return QueryPage.model_validate(page(workflow.list_queries(ctx, project_id=project_id, state=state), paging))


@router.get("/runs/{run_id}/queries")
def list_run_queries(ctx: Ctx, run_id: str, paging: Paging, state: WantedState = None) -> QueryPage:
    """The questions of a run."""
    return QueryPage.model_validate(page(workflow.list_queries(ctx, run_id=run_id, state=state), paging))


@router.get("/queries/{query_id}", response_model=ExpertQuery)
def get_query(ctx: Ctx, query_id: str) -> Json:
    """One question."""
    return workflow.get_query(ctx, query_id)


@router.post("/queries/{query_id}/answer", status_code=201, response_model=Answer)
def answer_query(ctx: Ctx, query_id: str, body: NewAnswer, response: Response, key: IdempotencyKey = None) -> Json:
    """Answer. The first answer counts; a second client gets 409 AlreadyAnswered."""
    row = workflow.answer(ctx, query_id, body.value, client_key=key)
    response.headers["Location"] = f"/api/v1/queries/{query_id}"
    return row


@router.post("/answers/{answer_id}/undo", response_model=ExpertQuery)
def undo_answer(
    ctx: Ctx,
    answer_id: str,
    keep_later: Annotated[bool, Query(description="Let answers given later stay; only for queries of kind pair.")] = False,
    _key: IdempotencyKey = None,
) -> Json:
    """Take an answer back; the query is asked again."""
    return workflow.undo_answer(ctx, answer_id, keep_later)
