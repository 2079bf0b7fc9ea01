"""Playbacks: the arm executing a plan in simulation."""

from typing import Literal

from fastapi import APIRouter, Response

from app.api.dependencies import Body, Ctx, Json, Paging, Row, located, page
from app.api.idempotency import ActionRoute, IdempotencyKey
from app.api.tools import Failure, JobState
from app.workflow import robot as workflow

router = APIRouter(tags=["playbacks"], route_class=ActionRoute)


class NewPlayback(Body):
    """The robot's own defaults are used; there is nothing to choose yet."""


class RegionProblem(Row):
    """Why a region can't be worked on as planned."""

    kind: str
    text: str


class PlaybackRegion(Row):
    """How the sweep over one region went."""

    region: int
    name: str
    step: int
    start_s: float
    end_s: float
    force_rms_n: float
    force_max_n: float
    off_path_mm: float
    covered: float
    problems: list[RegionProblem]


class Series(Row):
    """Measurements along the playback."""

    t: list[float]
    force_n: list[float]
    off_path_mm: list[float | None]


class Playback(Row):
    """A simulated execution; figures are null until it is ready."""

    id: str
    plan_id: str
    tool_id: str
    state: Literal["queued", "running", "ready", "failed"]
    job: JobState | None
    cycle_s: float | None
    in_contact_share: float | None
    force_error_n: float | None
    covered: float | None
    force_target_n: float | None
    regions: list[PlaybackRegion] | None
    series: Series | None
    error: Failure | None


class PlaybackPage(Row):
    """Part of the list of playbacks."""

    items: list[Playback]
    next: str | None


@router.get("/plans/{plan_id}/playbacks")
def list_playbacks(ctx: Ctx, plan_id: str, paging: Paging) -> PlaybackPage:
    """The playbacks of a plan."""
    return PlaybackPage.model_validate(page(workflow.list_playbacks(ctx, plan_id), paging))


@router.post("/plans/{plan_id}/playbacks", status_code=202, response_model=Playback)
def start_playback(ctx: Ctx, plan_id: str, response: Response, body: NewPlayback | None = None, _key: IdempotencyKey = None) -> Json:
    """Simulate the arm on the plan's sequence."""
    return located(response, "playbacks", workflow.start_playback(ctx, plan_id, {}))


@router.get("/playbacks/{playback_id}", response_model=Playback)
def get_playback(ctx: Ctx, playback_id: str) -> Json:
    """One playback."""
    return workflow.get_playback(ctx, playback_id)
