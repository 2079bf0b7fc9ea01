"""What a view needs of the rest of the application; tests put their own in its place."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

from app.geometry.preview import Preview
from app.geometry.tool import Tool
from app.robot.playback import Playback
from app.viewer.palette import Rgb
from app.workflow import editing_views, record, robot, sessions, tools
from app.workflow.context import Context

Json = dict[str, Any]


@dataclass(frozen=True)
class Actions:
    """Workflow functions, bound to the running application. All may block and raise AppError."""

    get_session: Callable[[str], Json]
    get_draft: Callable[[str], Json]
    tool_value: Callable[[str], Tool]
    playback_value: Callable[[str], Playback]
    tool_state: Callable[[str], Json]
    get_ready: Callable[[str], None]
    piece_faces: Callable[[str], Any]
    cad_colours: Callable[[str], tuple[Rgb | None, ...]]
    file_preview: Callable[[str, str], Preview]
    pick: Callable[..., Any]
    pick_up: Callable[[str, str], Any]
    select: Callable[[str, list[int]], Any]
    command: Callable[[str, str], Any]
    subscribe: Callable[[Callable[[Any], None]], Callable[[], None]]


def workflow_actions(ctx: Context) -> Actions:
    """The real ones."""
    return Actions(
        get_session=partial(sessions.get_session, ctx),
        get_draft=partial(record.get_draft, ctx),
        tool_value=partial(tools.tool_value, ctx),
        playback_value=partial(robot.playback_value, ctx),
        tool_state=lambda tool_id: tools.get_tool(ctx, tool_id)["edit"],
        get_ready=partial(editing_views.get_ready, ctx),
        piece_faces=partial(editing_views.piece_faces, ctx),
        cad_colours=partial(editing_views.cad_colours, ctx),
        file_preview=partial(tools.file_preview, ctx),
        pick=partial(sessions.pick_in_view, ctx),
        pick_up=partial(sessions.pick_up, ctx),
        select=partial(editing_views.add_regions, ctx),
        command=partial(sessions.command_in_view, ctx),
        subscribe=ctx.store.subscribe,
    )
