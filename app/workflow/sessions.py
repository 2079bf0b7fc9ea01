"""3D views: what each shows, clicks in it, playback control. The view itself is a projection and can be rebuilt."""

from datetime import UTC, datetime
from typing import Any

from sqlmodel import Session

from app.errors import InvalidInput, NotFound
from app.storage import emit
from app.storage.tables import PlaybackRow, Project, ToolRow, ViewSession
from app.workflow import editing_views, record, segmentations
from app.workflow.context import Context
from app.workflow.editing_views import editing_scene, pick_point, pick_region, tell_editing
from app.workflow.lookup import found, present

Json = dict[str, Any]

EMPTY_SCENE: Json = {"mode": "empty", "tool_id": None}
AT_START: Json = {"playing": False, "time": 0.0, "speed": 1.0, "since": None}
FIELDS = ("mode", "tool_id", "sequence", "step", "differs", "highlight", "playback_id", "dark", "body", "up")


def create_session(ctx: Context, project_id: str) -> Json:
    """Open a view that shows nothing yet."""

    def change(session: Session) -> Json:
        present(session, Project, project_id)
        row = ViewSession(project_id=project_id, scene=EMPTY_SCENE, playback=AT_START)
        session.add(row)
        session.flush()
        return session_json(session, row)

    return ctx.store.write(change)


def get_session(ctx: Context, session_id: str) -> Json:
    """What a view shows."""
    return ctx.store.read(lambda session: session_json(session, found(session, ViewSession, session_id, "view")))


def delete_session(ctx: Context, session_id: str) -> None:
    """Close a view."""

    def change(session: Session) -> None:
        row = found(session, ViewSession, session_id, "view")
        session.delete(row)
        emit(session, "scene.changed", row.project_id, session_id=session_id, closed=True)

    ctx.store.write(change)


def show(ctx: Context, session_id: str, scene: Json) -> Json:
    """Show something else.

    Raises:
        InvalidInput: The tool or playback belongs to another project, or the mode needs one.
    """

    def change(session: Session) -> Json:
        row = found(session, ViewSession, session_id, "view")
        _check_scene(session, row.project_id, scene)
        if scene.get("playback_id") != row.scene.get("playback_id"):
            row.playback = AT_START
        if scene["mode"] == "edit":
            row.scene = editing_scene(session, row.scene, scene)
            tell_editing(ctx.values, session, row)
        else:
            row.scene = {name: scene[name] for name in FIELDS if name in scene}
            emit(session, "scene.changed", row.project_id, session_id=session_id)
        session.add(row)
        return session_json(session, row)

    return ctx.store.write(change)


def change_editing(ctx: Context, session_id: str, changes: Json) -> Json:
    """Change what is selected or pointed at in a view that edits regions; `hover` is told, not stored."""
    if set(changes) != {"hover"}:
        editing_views.change_editing(ctx, session_id, changes)
    if "hover" in changes:
        row = get_session(ctx, session_id)
        told = {"session_id": session_id, "region": changes["hover"]}
        ctx.store.write(lambda session: emit(session, "session.hovered", row["project_id"], **told))
    return get_session(ctx, session_id)


def pick_in_view(ctx: Context, session_id: str, region: int | None, point_mm: list[float] | None = None, *, modifier: bool = False) -> None:
    """A click on a region or beside them (None): into the draft while recording, into what is being edited, otherwise told to the page."""
    session_row = get_session(ctx, session_id)
    scene = session_row["scene"]
    if scene["mode"] == "edit" and scene["pointing"] != "select" and point_mm is not None:
        pick_point(ctx, session_id, point_mm, region)
    elif scene["mode"] == "edit":
        pick_region(ctx, session_id, region, toggle=modifier)
    elif region is None:
        return
    elif scene["mode"] == "record":
        record.pick(ctx, scene["tool_id"], region)
    else:
        ctx.store.write(lambda session: emit(session, "session.picked", session_row["project_id"], session_id=session_id, region=region))


def pick_up(ctx: Context, session_id: str, direction: str) -> None:
    """A click on the arrow of a direction beside a file that is being asked about: told to the page, which has the answers so far."""
    project_id = get_session(ctx, session_id)["project_id"]
    ctx.store.write(lambda session: emit(session, "session.picked", project_id, session_id=session_id, up=direction))


def command_in_view(ctx: Context, session_id: str, command: str) -> None:
    """Undo or redo in what a view records or edits, or clear what it records.

    Raises:
        InvalidInput: The view does neither, or there is no such command.
    """
    actions = {
        "record": {"undo": record.undo, "redo": record.redo, "clear": record.clear},
        "edit": {"undo": segmentations.undo, "redo": segmentations.redo},
    }
    scene = get_session(ctx, session_id)["scene"]
    known = actions.get(scene["mode"], {})
    if command not in known:
        raise InvalidInput("Undo and redo are for a view that records an order or edits regions; clear is for recording.")
    known[command](ctx, scene["tool_id"])


def control_playback(ctx: Context, session_id: str, action: str, time: float | None = None, speed: float | None = None) -> Json:
    """Play, pause or seek the robot's recording; the time runs on by the clock while it plays."""
    if action not in ("play", "pause", "seek"):
        raise InvalidInput(f"A playback can play, pause or seek, not {action!r}.")

    def change(session: Session) -> Json:
        row = found(session, ViewSession, session_id, "view")
        duration = _duration(session, row.scene)
        state = row.playback
        playing = state["playing"] if action == "seek" else action == "play"
        here = _time(state, duration) if time is None else min(max(time, 0.0), duration if duration is not None else time)
        if action == "play" and time is None and duration is not None and here >= duration:
            here = 0.0
        since = datetime.now(UTC).timestamp() if playing else None
        row.playback = {"playing": playing, "time": here, "speed": speed or state["speed"], "since": since}
        session.add(row)
        emit(session, "scene.changed", row.project_id, session_id=session_id, playback=True)
        return session_json(session, row)

    return ctx.store.write(change)


def session_json(session: Session, row: ViewSession) -> Json:
    """The view as REST shows it; `time` is where the playback is now."""
    duration = _duration(session, row.scene)
    here = _time(row.playback, duration)
    over = duration is not None and here >= duration
    return {
        "id": row.id,
        "project_id": row.project_id,
        "url": f"/v/{row.id}/",
        "scene": row.scene,
        "playback": {"playing": row.playback["playing"] and not over, "time": here, "speed": row.playback["speed"], "duration": duration},
    }


def _time(state: Json, duration: float | None) -> float:
    here = state["time"]
    if state["playing"] and state["since"] is not None:
        here += (datetime.now(UTC).timestamp() - state["since"]) * state["speed"]
    return here if duration is None else min(here, duration)


def _duration(session: Session, scene: Json) -> float | None:
    row = session.get(PlaybackRow, scene["playback_id"]) if scene.get("playback_id") else None
    return row.summary["cycle_s"] if row is not None and row.summary else None


def _check_scene(session: Session, project_id: str, scene: Json) -> None:
    mode, tool_id, playback_id = scene.get("mode"), scene.get("tool_id"), scene.get("playback_id")
    if mode not in ("empty", "file", "tool", "record", "sequence", "robot", "edit"):
        raise InvalidInput(f"A view shows empty, file, tool, record, sequence, robot or edit, not {mode!r}.")
    if mode != "empty" and tool_id is None:
        raise InvalidInput(f"A view in the mode {mode} needs a tool_id.")
    if tool_id is not None and present(session, ToolRow, tool_id).project_id != project_id:
        raise NotFound(f"There is no tool with the id {tool_id!r} in this project.")
    if playback_id is not None and found(session, PlaybackRow, playback_id, "playback").project_id != project_id:
        raise NotFound(f"There is no playback with the id {playback_id!r} in this project.")
