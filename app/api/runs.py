"""Runs: a learner's life from the first gradient step to the policy."""

from typing import Annotated, Literal

from fastapi import APIRouter, File, Query, Response, UploadFile
from pydantic import BeforeValidator, Field

from app.api.dependencies import Body, Ctx, Json, Name, Paging, Row, Seed, located, page
from app.api.idempotency import ActionRoute, IdempotencyKey
from app.workflow import question_files
from app.workflow import runs as workflow

router = APIRouter(tags=["runs"], route_class=ActionRoute)

Kind = Literal["performance", "effort"]
Mode = Literal["certified", "paper"]
ParameterName = Annotated[str, Field(max_length=60)]


def _number_or_switch(value: object) -> object:
    if not isinstance(value, bool | int | float):
        raise ValueError("it should be a number, or true or false")
    return value


ParameterValue = Annotated[bool | int | float, BeforeValidator(_number_or_switch)]


class NewRun(Body):
    """What to learn; parameters left out take the values of /run-defaults."""

    kind: Kind
    mode: Annotated[Mode, Field(description="How a performance run learns: with proof, or Algorithm 1 as printed.")] = "certified"
    params: Annotated[dict[ParameterName, ParameterValue], Field(default_factory=dict)]
    seed: Seed | None = None
    authors: Annotated[
        list[Name],
        Field(default_factory=list, max_length=50, description="Experts whose orders it learns from, pooled; none: all of them."),
    ]


class Parameter(Row):
    """A hyperparameter with the paper's symbol."""

    key: str
    symbol: str
    label: str
    value: ParameterValue | None
    default: ParameterValue | None


class ParameterList(Row):
    """The hyperparameters a new run would have."""

    parameters: list[Parameter]


class Run(Row):
    """Where a learner stands."""

    id: str
    project_id: str
    kind: Literal["performance", "effort", "exception"]
    authors: list[str]  # where there are several experts
    mode: Mode | None
    state: str
    round: int
    iteration: int
    loss: float | None
    terms: dict[str, float] | None  # parts of the loss (Eq. 7), or of what a certified run has still open
    violations: int | None
    seed: int
    params: Json
    parameters: list[Parameter]
    open_queries: int
    asked: int
    answered: int
    policy_id: str | None
    message: str
    error: Json | str | None
    report: Json | None  # certified: what is proved, and how sure each tool is
    tools: list[str]
    about: str | None  # exception: the tool it asks about
    to_show: list[Json]  # certified: tools whose order it waits for, since both orders of a question were wrong
    version: int
    created_at: str
    updated_at: str


class RunPage(Row):
    """Part of the list of runs."""

    items: list[Run]
    next: str | None


class Metric(Row):
    """One iteration."""

    iteration: int
    loss: float
    terms: dict[str, float]
    violations: int


class MetricList(Row):
    """The learning curve behind an iteration."""

    items: list[Metric]
    next: None = None


class AppliedAnswer(Row):
    """A row of the file that counts."""

    line: int
    query_id: str
    tool_name: str
    value: str
    id: str  # of the answer, to take it back


class RowFault(Row):
    """A row of the file that doesn't count, and why."""

    line: int
    text: str


class AnswersReport(Row):
    """What a file of answers did."""

    applied: list[AppliedAnswer]
    already: list[RowFault]  # answered before
    faults: list[RowFault]
    left_open: int  # rows without an answer
    run_state: str


QUESTION_POLICY = "default-src 'none'; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'; frame-ancestors 'self'"


@router.get("/projects/{project_id}/runs")
def list_runs(ctx: Ctx, project_id: str, paging: Paging) -> RunPage:
    """The runs of a project."""
    return RunPage.model_validate(page(workflow.list_runs(ctx, project_id), paging))


@router.get("/projects/{project_id}/run-defaults", response_model=ParameterList)
def run_defaults(ctx: Ctx, project_id: str, kind: Kind, mode: Mode = "certified") -> Json:
    """The hyperparameters with symbols, words and default values."""
    return workflow.run_defaults(ctx, project_id, kind, mode)


@router.post("/projects/{project_id}/runs", status_code=202, response_model=Run)
def start_run(ctx: Ctx, project_id: str, body: NewRun, response: Response, _key: IdempotencyKey = None) -> Json:
    """Start a learner in the background."""
    return located(response, "runs", workflow.start_run(ctx, project_id, body.kind, body.params, body.seed, body.mode, body.authors))


@router.get("/runs/{run_id}", response_model=Run)
def get_run(ctx: Ctx, run_id: str) -> Json:
    """One run."""
    return workflow.get_run(ctx, run_id)


@router.get("/runs/{run_id}/metrics")
def metrics(ctx: Ctx, run_id: str, after: Annotated[int, Query(ge=0, lt=2**31, description="Last iteration known.")] = 0) -> MetricList:
    """Loss, its terms and violations per iteration."""
    return MetricList(items=[Metric.model_validate(row) for row in workflow.metrics(ctx, run_id, after=after)])


@router.post("/runs/{run_id}/cancel", status_code=202, response_model=Run)
def cancel_run(ctx: Ctx, run_id: str, response: Response, _key: IdempotencyKey = None) -> Json:
    """Stop the run; open queries are withdrawn."""
    return located(response, "runs", workflow.cancel(ctx, run_id))


@router.post("/runs/{run_id}/resume", status_code=202, response_model=Run)
def resume_run(ctx: Ctx, run_id: str, response: Response, _key: IdempotencyKey = None) -> Json:
    """Go on from the last checkpoint of a failed run."""
    return located(response, "runs", workflow.resume(ctx, run_id))


@router.post("/runs/{run_id}/finish", status_code=202, response_model=Run)
def finish_run(ctx: Ctx, run_id: str, response: Response, _key: IdempotencyKey = None) -> Json:
    """Accept the weights of a stalled run: everything it could still ask about was called similar."""
    return located(response, "runs", workflow.finish_run(ctx, run_id))


@router.get("/runs/{run_id}/questions.csv", response_class=Response, responses={200: {"content": {"text/csv": {}}}})
def questions_csv(ctx: Ctx, run_id: str) -> Response:
    """The open questions as a table; fill in the last column and send it to /answers."""
    headers = {"Content-Disposition": 'attachment; filename="questions.csv"'}
    return Response(question_files.questions_csv(ctx, run_id), media_type="text/csv; charset=utf-8", headers=headers)


@router.get("/runs/{run_id}/questions.html", response_class=Response, responses={200: {"content": {"text/html": {}}}})
def questions_html(ctx: Ctx, run_id: str) -> Response:
    """The open questions as one page to print, with pictures and boxes to tick."""
    headers = {"Content-Security-Policy": QUESTION_POLICY}
    return Response(question_files.questions_page(ctx, run_id), media_type="text/html; charset=utf-8", headers=headers)


@router.post("/runs/{run_id}/answers", response_model=AnswersReport)
def read_answers(
    ctx: Ctx,
    run_id: str,
    file: Annotated[UploadFile, File(description="CSV with the columns `query id` and `answer`; others are not read.")],
    _key: IdempotencyKey = None,
) -> Json:
    """Answer questions from a file. Each row counts or is named with its fault; what was answered before stays."""
    return question_files.read_answers(ctx, run_id, file.file.read(question_files.MOST_BYTES + 1))
