"""Sessions: a person's 3D view, and what it shows."""

from typing import Annotated, Literal

from fastapi import APIRouter, Response
from pydantic import Field

from app.api.dependencies import Body, Ctx, Json, RegionId, RegionOrder, Row, located
from app.api.idempotency import ActionRoute, IdempotencyKey
from app.api.segmentations import PointMm
from app.workflow import sessions as workflow

router = APIRouter(prefix="/sessions", tags=["sessions"], route_class=ActionRoute)

Id = Annotated[str, Field(max_length=64)]


class ClickedPoint(Body):
    """A point on the part."""

    point_mm: PointMm
    region: RegionId | None = None


Selection = Annotated[list[RegionId], Field(max_length=200, description="Selected regions.")]
Points = Annotated[list[ClickedPoint], Field(max_length=100, description="Clicked points of a line, a plane or a piece.")]
Level = Annotated[int, Field(ge=1, le=1000, description="1: the largest piece under the click, 2: the next smaller one.")]
Colours = Annotated[Literal["regions", "cad"], Field(description="Tints that tell regions apart, or what the CAD file paints them in.")]
Pointing = Literal["select", "points", "piece"]


class NewSession(Body):
    """Whose view it is."""

    project_id: Id


class Scene(Body):
    """What the view shows."""

    mode: Literal["empty", "file", "tool", "record", "sequence", "robot", "edit"]
    tool_id: Id | None = None
    sequence: RegionOrder | None = None
    step: Annotated[int, Field(ge=0, le=100_000, description="Regions after this step are undone; null: all done.")] | None = None
    differs: list[RegionId] | None = None
    highlight: list[RegionId] | None = None
    playback_id: Id | None = None
    dark: bool | None = None
    body: Annotated[Id | None, Field(description="Mode file: the body that is chosen; `highlight` counts bodies from 0.")] = None
    up: Annotated[Literal["+x", "-x", "+y", "-y", "+z", "-z"] | None, Field(description="Mode file: what of its frame points up.")] = None
    pointing: Pointing | None = None
    selection: Selection | None = None
    points: Points | None = None
    level: Level | None = None
    path: Literal["line", "plane"] | None = None
    closed: bool | None = None
    colours: Colours | None = None


class EditingChanges(Body):
    """What changes in a view that edits regions; the rest stays. `hover` is only painted."""

    pointing: Pointing | None = None
    selection: Selection | None = None
    points: Points | None = None
    level: Level | None = None
    path: Literal["line", "plane"] | None = None
    closed: bool | None = None
    colours: Colours | None = None
    hover: RegionId | None = None


class PlaybackOrder(Body):
    """How the robot's recording runs in the view."""

    action: Literal["play", "pause", "seek"]
    time: Annotated[float, Field(ge=0, description="Seconds.")] | None = None
    speed: Annotated[float, Field(gt=0, le=100)] | None = None


class PlaybackState(Row):
    """Where the recording stands."""

    playing: bool
    time: float
    speed: float
    duration: float | None


class Session(Row):
    """A 3D view; `url` is its page, for an iframe."""

    id: str
    project_id: str
    url: str
    scene: Json
    playback: PlaybackState | None


@router.post("", status_code=201, response_model=Session)
def create_session(ctx: Ctx, body: NewSession, response: Response, _key: IdempotencyKey = None) -> Json:
    """Open a 3D view."""
    return located(response, "sessions", workflow.create_session(ctx, body.project_id))


@router.get("/{session_id}", response_model=Session)
def get_session(ctx: Ctx, session_id: str) -> Json:
    """What a view shows."""
    return workflow.get_session(ctx, session_id)


@router.put("/{session_id}/scene", response_model=Session)
def show(ctx: Ctx, session_id: str, body: Scene) -> Json:
    """Show something else."""
    return workflow.show(ctx, session_id, body.model_dump(exclude_unset=True))


@router.patch("/{session_id}/scene", response_model=Session)
def change_editing(ctx: Ctx, session_id: str, body: EditingChanges) -> Json:
    """Change what is selected or pointed at in a view that edits regions."""
    return workflow.change_editing(ctx, session_id, body.model_dump(exclude_unset=True))


@router.post("/{session_id}/playback", response_model=Session)
def control_playback(ctx: Ctx, session_id: str, body: PlaybackOrder, _key: IdempotencyKey = None) -> Json:
    """Play, pause or seek."""
    return workflow.control_playback(ctx, session_id, body.action, body.time, body.speed)


@router.delete("/{session_id}", status_code=204)
def delete_session(ctx: Ctx, session_id: str) -> None:
    """Close the view."""
    workflow.delete_session(ctx, session_id)
