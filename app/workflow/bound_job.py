"""The job that goes on looking for how cheap an order could be, after a plan was made that could not be proved the cheapest.

It works in short parts, so that a question or an import that comes meanwhile never waits for long; what a part found is
stored and told, and the next part takes its place at the end of the queue.
"""

import json
import time
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any

from sqlmodel import Session, col, select

from app.jobs.dispatcher import Handler
from app.jobs.rows import add_job, cancel_jobs
from app.jobs.worker import Report
from app.learning.qp import Array
from app.sequencing.bounds import COARSE, FINE, MIDDLE, STRIDE, TINY, Ascent
from app.sequencing.constraints import Constraints, resolve
from app.sequencing.parts import split
from app.sequencing.problem import SequencingProblem
from app.storage import emit
from app.storage.tables import JobRow, Plan, PolicyRow, Segmentation, ToolRow
from app.workflow.feature_choice import stored_features
from app.workflow.lookup import found
from app.workflow.policy_rows import policy_value
from app.workflow.values import Kept, Values

Json = dict[str, Any]

KIND = "bound"
SECONDS = 30.0  # of computing for one plan, in all
PART_SECONDS = 1.5  # of one part
ROUGH_SECONDS = 15.0  # with small tables, unless they give nothing more before
STEPS = 100_000  # the clock ends a part
_searches = Kept(4)  # of a worker process: how far each search is; losing it costs only time


@dataclass(frozen=True)
class Search:
    """What one part needs."""

    key: tuple[str, ...]  # to recognise the search it belongs to
    problem: SequencingProblem
    weights: Array
    constraints: Constraints | None
    cost: float  # of the best order known
    seconds: float  # spent by the parts before


@dataclass
class Progress:
    """A search between two parts."""

    ascent: Ascent
    spent: float  # cost of the regions finished before
    fine: bool = False  # the larger tables have taken over


@dataclass(frozen=True)
class Found:
    """What a part gave."""

    bound: float
    seconds: float  # spent so far
    over: bool


def handler(values: Values) -> Handler:
    """How these jobs are done."""
    return Handler(partial(prepare, values), compute, finish, lambda _session, _job, _error: None)


def go_on_looking(session: Session, plan: Plan) -> None:
    """Queue the search for a new plan; what an earlier plan of the same order learned counts, and its search ends."""
    wanted = select(Plan).where(Plan.policy_id == plan.policy_id, Plan.tool_id == plan.tool_id, Plan.id != plan.id)
    before = session.exec(wanted.order_by(col(Plan.id).desc()).limit(1)).first()
    if before is not None:
        cancel_jobs(session, before.id)
    if plan.result["proved"] or plan.result["bound"] is None or plan.result["exception"] is not None:
        return
    seconds = 0.0
    if before is not None and _same(before, plan):
        bound, seconds = max(plan.result["bound"], before.result["bound"]), before.result.get("searched", 0.0)
        plan.result = {**plan.result, "bound": bound, "searched": seconds}
        session.add(plan)
        session.flush()
    if seconds < SECONDS:
        _queue(session, plan)


def _same(before: Plan, plan: Plan) -> bool:
    """Whether a bound of the one plan holds for the other."""
    if before.segmentation_id != plan.segmentation_id or before.sequence != plan.sequence:
        return False
    return before.result.get("bound") is not None and before.result.get("constraints") == plan.result["constraints"]


def _queue(session: Session, plan: Plan) -> None:
    name = found(session, ToolRow, plan.tool_id, "tool").name
    add_job(session, KIND, plan.project_id, plan.id, f"How good the order for {name} is at least")


def prepare(values: Values, session: Session, job: JobRow) -> Search | None:
    """The next part; None when the tool is gone."""
    plan = session.get(Plan, job.subject_id)
    tool = session.get(ToolRow, plan.tool_id) if plan is not None else None
    if plan is None or tool is None or tool.deleted_at is not None:
        return None
    cut = found(session, Segmentation, plan.segmentation_id, "segmentation")
    policy = policy_value(found(session, PolicyRow, plan.policy_id, "policy"))
    asked = plan.result["constraints"]
    return Search(
        key=(cut.id, plan.policy_id, repr(asked), repr(plan.result["cost"])),
        problem=values.problem(session, cut, policy.interactions, stored_features(session, policy.features)),
        weights=policy.weights,
        constraints=None if asked is None else constraints_from(asked),
        cost=plan.result["cost"],
        seconds=plan.result.get("searched", 0.0),
    )


def constraints_from(stored: Json) -> Constraints:
    """Constraints as a plan keeps them."""
    before = tuple((tuple(a), tuple(b)) for a, b in stored["before"])
    pairs = tuple((a, b) for a, b in stored["never_next"])
    return Constraints(before, stored["first"], stored["last"], pairs, tuple(stored["skip"]), tuple(stored["done"]))


def compute(search: Search, report: Report) -> Found:
    """Steps until the part is over."""
    report(search.seconds / SECONDS, "Looking for a closer limit")
    progress: Progress = _searches.get(search.key, lambda: _begun(search))
    ascent, began = progress.ascent, time.monotonic()
    rough = search.seconds < ROUGH_SECONDS and not progress.fine
    done = ascent.climb(COARSE if rough else MIDDLE, STEPS, lambda: time.monotonic() > began + PART_SECONDS)
    seconds = search.seconds + time.monotonic() - began
    idle = ascent.far < TINY or (done and ascent.bound >= ascent.best)
    over = seconds >= SECONDS or (idle and not rough)
    if (idle or seconds >= ROUGH_SECONDS) and rough:
        progress.fine, ascent.far = True, STRIDE
    if over:
        ascent.try_out(FINE)
    return Found(min(search.cost, ascent.bound + progress.spent), SECONDS if over else seconds, over)


def _begun(search: Search) -> Progress:
    resolved = resolve(search.constraints, search.problem.n)
    weights = search.problem.check_weights(search.weights)
    spent = search.problem.cost_of(weights, resolved.done)
    return Progress(Ascent(split(search.problem, weights, resolved), search.cost - spent, lambda _bound: None), spent)


def finish(session: Session, job: JobRow, found_now: Found) -> None:
    """Keep the bound if it is closer, tell it, and go on."""
    plan = session.get(Plan, job.subject_id)
    if plan is None:
        return
    bound = max(plan.result["bound"], found_now.bound)
    closer = bound > plan.result["bound"]
    plan.result = {**plan.result, "bound": bound, "searched": found_now.seconds}
    session.add(plan)
    session.flush()
    if closer or found_now.over:
        emit(session, "plan.changed", plan.project_id, plan_id=plan.id)
    if not found_now.over:
        _queue(session, plan)


def as_stored(constraints: Constraints | None) -> Json | None:
    """Constraints as a plan keeps them."""
    return json.loads(json.dumps(asdict(constraints))) if constraints else None
