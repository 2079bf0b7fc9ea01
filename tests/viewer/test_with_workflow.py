"""A view on the real workflow: clicks reach the stored draft, and changes made elsewhere reach the view."""

import asyncio
import threading
from typing import Any

import pytest

from app.errors import NotFound
from app.viewer.hub import Hub
from app.workflow import projects, record, sessions, tools
from tests.viewer.fakes import CAMERA, click, connect, eventually, serve


def texts(hub: Hub, sid: str) -> dict[str, str]:
    """What is written on the regions by the view, by their letters."""
    shown = hub._views[sid].stage.shown
    tool = hub._views[sid]._tool
    if shown is None or tool is None:
        return {}
    return {region.name: look.text for region, look in zip(tool.regions, shown.regions, strict=True) if look.plate}


def test_recording_in_the_view(ctx: Any) -> None:
    project = projects.create_sample_project(ctx)
    tool = next(tool for tool in tools.list_tools(ctx, project["id"]) if tool["state"] == "ready")
    other = [tool for tool in tools.list_tools(ctx, project["id"]) if tool["state"] == "ready"][1]
    record.clear(ctx, tool["id"])
    sid = sessions.create_session(ctx, project["id"])["id"]
    sessions.show(ctx, sid, {"mode": "record", "tool_id": tool["id"]})
    before = threading.active_count()
    served = serve(Hub(ctx))

    async def main() -> None:
        async with connect(served.base, sid) as socket:
            view = served.hub._views[sid]
            await socket.send(CAMERA)
            await eventually(lambda: view.server.get_clients())
            for region in (2, 0, 1):
                await socket.send(click(region))
            await eventually(lambda: texts(served.hub, sid) == {"C": "1", "A": "2", "B": "3"})
            assert record.get_draft(ctx, tool["id"])["sequence"] == [2, 0, 1]
            record.undo(ctx, tool["id"])  # as the page does
            await eventually(lambda: texts(served.hub, sid) == {"C": "1", "A": "2"})
            sessions.show(ctx, sid, {"mode": "sequence", "tool_id": other["id"], "sequence": [1, 0, 2], "step": 2})
            await eventually(lambda: texts(served.hub, sid) == {"B": "1", "A": "2"})
            sessions.delete_session(ctx, sid)
            await socket.wait_closed()

    try:
        asyncio.run(main())
        assert sid not in served.hub._views
        with pytest.raises(NotFound):
            sessions.get_session(ctx, sid)
    finally:
        served.stop()
    assert threading.active_count() <= before + 1  # the notifier may have begun meanwhile
