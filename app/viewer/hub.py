"""All 3D views of the server: built when somebody first looks, told of changes, put away when nobody looks any more."""

import asyncio
import logging
import time
from collections.abc import Callable
from typing import Annotated, Any

from fastapi import APIRouter, HTTPException, Request, Response, WebSocket
from pydantic import BaseModel, Field

from app.errors import NotFound
from app.viewer.actions import Actions, workflow_actions
from app.viewer.bridge import TOO_MANY, host_is_local, origin_is_ours, pump, viser_subprotocol
from app.viewer.page import PARAMETERS, POLICY, viewer_page
from app.viewer.view import Hover, Refresh, View
from app.workflow.context import Context

log = logging.getLogger(__name__)

MOST_VIEWS = 40
IDLE_SECONDS = 15 * 60.0  # a view nobody looks at is kept this long
REAP_SECONDS = 30.0


class Place(BaseModel):
    """Where on the canvas: 0 to 1 from the left and from the top; null: nowhere."""

    x: Annotated[float, Field(ge=0, le=1)] | None = None
    y: Annotated[float, Field(ge=0, le=1)] | None = None


class Hub:
    """Views by session id. Knowing the random id of a session is what allows to look: there is no login yet."""

    def __init__(self, ctx: Context | None, actions: Actions | None = None) -> None:
        if actions is None:
            assert ctx is not None
            actions = workflow_actions(ctx)
        self._actions = actions
        self._views: dict[str, View] = {}
        self._building: dict[str, asyncio.Lock] = {}
        self._loop: asyncio.AbstractEventLoop | None = None
        self._reaper: asyncio.Task[None] | None = None
        self._unsubscribe: Callable[[], None] = lambda: None
        self.router = APIRouter(include_in_schema=False)
        self.router.add_api_route("/v/{sid}/", self.page, methods=["GET"])
        self.router.add_api_route("/v/{sid}/under", self.under, methods=["POST"])
        self.router.add_api_websocket_route("/v/{sid}", self.socket)

    def start(self, loop: asyncio.AbstractEventLoop) -> None:
        """Listen for changes; called on the loop that serves the routes."""
        self._loop = loop
        self._unsubscribe = self._actions.subscribe(self._told)
        self._reaper = loop.create_task(self._reap(), name="viewer reaper")

    def close(self) -> None:
        """Put all views away; called from another thread than the loop's while the loop runs."""
        self._unsubscribe()
        if self._loop is not None and self._reaper is not None:
            self._loop.call_soon_threadsafe(self._reaper.cancel)
        while self._views:
            self._views.popitem()[1].close()

    # -- routes ------------------------------------------------------------------------------------------------------------

    async def page(self, sid: str, request: Request) -> Response:
        """The 3D page of a session, for a frame of ours."""
        if not host_is_local(request):
            raise HTTPException(421, "This server does not answer to that name.")
        if not set(request.query_params) <= PARAMETERS:
            raise HTTPException(400, f"A view takes the parameters {', '.join(sorted(PARAMETERS))} only.")
        if await self.view(sid) is None:
            raise HTTPException(503, "Too many 3D views are open; close one and reload.")
        plain, packed = viewer_page()
        headers = {"Content-Security-Policy": POLICY, "Cache-Control": "no-cache", "Vary": "Accept-Encoding"}
        if "gzip" in request.headers.get("accept-encoding", ""):
            return Response(packed, media_type="text/html", headers=headers | {"Content-Encoding": "gzip"})
        return Response(plain, media_type="text/html", headers=headers)

    async def under(self, sid: str, place: Place) -> dict[str, Any]:
        """What lies under the pointer at a place of the canvas; it is outlined in the view."""
        view = self._views.get(sid)
        if view is None:
            raise HTTPException(404, "This 3D view is not open.")
        if place.x is None or place.y is None:
            view.submit(Hover(None))
            return {"region": None, "on_body": False, "point_mm": None}
        return await asyncio.to_thread(view.under, place.x, place.y)

    async def socket(self, sid: str, browser: WebSocket) -> None:
        """The browser's connection to its view. A refusal comes before the handshake, so the browser sees HTTP 403."""
        subprotocol = viser_subprotocol(browser)
        if subprotocol is None or not host_is_local(browser) or not origin_is_ours(browser):
            await browser.close(1008)
            return
        try:
            view = await self.view(sid)
        except NotFound:
            await browser.close(1008)
            return
        if view is None:
            await browser.close(TOO_MANY)
            return
        stop = asyncio.Event()
        view.stops.add(stop)
        try:
            await pump(browser, view.port, subprotocol, stop)
        finally:
            view.stops.discard(stop)
            view.last_seen = time.monotonic()

    # -- views -------------------------------------------------------------------------------------------------------------

    async def view(self, sid: str) -> View | None:
        """The view of a session, built if need be; None when there are too many.

        Raises:
            NotFound: There is no such session.
        """
        assert self._loop is not None, "the hub has not been started"
        lock = self._building.setdefault(sid, asyncio.Lock())
        try:
            async with lock:
                if sid not in self._views:
                    await asyncio.to_thread(self._actions.get_session, sid)  # NotFound before a server is opened
                    if not self._make_room():
                        return None
                    view = await asyncio.to_thread(View, sid, self._actions, self._loop)
                    self._views[sid] = view
                    await asyncio.to_thread(view._guarded, Refresh())
                    view.start()
                view = self._views[sid]
                view.last_seen = time.monotonic()
                return view
        finally:
            self._building.pop(sid, None)

    def _make_room(self) -> bool:
        """Whether one more view fits, if need be in the place of the one nobody has looked at for longest."""
        if len(self._views) < MOST_VIEWS:
            return True
        unseen = [view for view in self._views.values() if not view.stops]
        if not unseen:
            return False
        self._drop(min(unseen, key=lambda view: view.last_seen).sid)
        return True

    def _drop(self, sid: str) -> None:
        view = self._views.pop(sid)
        assert self._loop is not None
        self._loop.run_in_executor(None, view.close)

    async def _reap(self) -> None:
        while True:
            await asyncio.sleep(REAP_SECONDS)
            self.reap(time.monotonic())

    def reap(self, now: float) -> None:
        """Put away the views nobody has looked at for long."""
        for view in [view for view in self._views.values() if not view.stops and now - view.last_seen > IDLE_SECONDS]:
            self._drop(view.sid)

    def _told(self, event: Any) -> None:
        """Called on the store's thread."""
        if self._loop is not None and not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._on_event, event)

    def _on_event(self, event: Any) -> None:
        """Have the views concerned by a stored change look at their rows again."""
        data = event.data
        if event.type == "scene.changed" and data.get("closed") and data["session_id"] in self._views:
            self._drop(data["session_id"])
            return
        if event.type == "session.hovered":
            view = self._views.get(data["session_id"])
            if view is not None:
                view.submit(Hover(data["region"]))
            return
        for view in self._views.values():
            about_tool = event.type in ("draft.changed", "tool.changed") and data.get("tool_id") == view.tool_id
            about_playback = event.type == "playback.changed" and data.get("playback_id") == view.playback_id
            if about_tool or about_playback or (event.type == "scene.changed" and data.get("session_id") == view.sid):
                view.submit(Refresh())
