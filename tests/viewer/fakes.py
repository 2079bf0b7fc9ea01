"""A workflow that lives in memory, and a browser that speaks viser's protocol without drawing anything."""

import asyncio
import threading
import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import msgspec
import numpy as np
import trimesh
import uvicorn
import viser
import websockets
import zstandard
from fastapi import FastAPI, Request, Response

from app.errors import InvalidInput, NotFound
from app.geometry.moulds import sample_moulds
from app.geometry.parsed import Body, ParsedFile
from app.geometry.preview import preview
from app.geometry.regions import measure
from app.geometry.tool import Tool
from app.robot.playback import Playback
from app.viewer.actions import Actions
from app.viewer.hub import Hub

SUBPROTOCOL = f"viser-v{viser.__version__}"


@lru_cache
def sample_tool(name: str = "Trough 06") -> Tool:
    mould = next(mould for mould in sample_moulds() if mould.name == name)
    return measure(mould.mesh, mould.labels)


def two_boxes() -> ParsedFile:
    """A file with a large box and a small one beside it, in its own frame and units."""
    large = trimesh.creation.box((40, 20, 10))
    small = trimesh.creation.box((4, 4, 4), trimesh.transformations.translation_matrix((30, 0, 0)))
    bodies = [Body(name, (0.0, 0.0, 0.0), 12, mesh.area, True, "+z") for name, mesh in (("plate", large), ("pin", small))]
    faces = np.concatenate([large.faces, small.faces + 8])
    none = np.full(24, -1)
    return ParsedFile(np.concatenate([large.vertices, small.vertices]), faces, none, np.repeat([0, 1], 12), tuple(bodies), (), "mm", 0, 0)


@dataclass
class Event:
    """As the store hands them out."""

    type: str
    data: dict[str, Any]


@dataclass
class FakeWorkflow:
    """Sessions "s1".."s9" that all show one tool and one draft."""

    tool: Tool = field(default_factory=sample_tool)
    playback: Playback | None = None
    draft: list[int] = field(default_factory=list)
    scene: dict[str, Any] = field(default_factory=lambda: {"mode": "record", "tool_id": "t1"})
    running: dict[str, Any] = field(default_factory=lambda: {"playing": False, "time": 0.0, "speed": 1.0, "duration": None})
    picked: list[tuple[str, int]] = field(default_factory=list)
    ups: list[tuple[str, str]] = field(default_factory=list)
    state: dict[str, Any] = field(default_factory=lambda: {"locked": [], "hidden": []})
    ready: list[str] = field(default_factory=list)
    points: list[Any] = field(default_factory=list)
    listeners: list[Callable[[Event], None]] = field(default_factory=list)

    def get_session(self, sid: str) -> dict[str, Any]:
        if sid not in {f"s{k}" for k in range(1, 10)}:
            raise NotFound(f"There is no view with the id {sid!r}.")
        return {"id": sid, "scene": self.scene, "playback": self.running}

    def pick(self, sid: str, region: int | None, point_mm: list[float] | None = None, *, modifier: bool = False) -> None:
        if self.scene["mode"] == "edit":
            self.points.append((region, point_mm, modifier))
            return
        assert region is not None
        self.picked.append((sid, region))
        if region in self.draft:
            raise InvalidInput("This region already has its number.")
        time.sleep(0.001)  # the real one waits for a commit
        self.draft.append(region)
        self.tell("draft.changed", tool_id="t1")

    def select(self, _sid: str, regions: list[int]) -> None:
        self.scene = {**self.scene, "selection": sorted({*self.scene["selection"], *regions})}
        self.tell("scene.changed", session_id="s1")

    def command(self, _sid: str, name: str) -> None:
        if name == "undo" and self.draft:
            self.draft.pop()
        self.tell("draft.changed", tool_id="t1")

    def show(self, **scene: Any) -> None:
        self.scene = scene
        self.tell("scene.changed", session_id="s1")

    def tell(self, type: str, **data: Any) -> None:
        for listener in self.listeners:
            listener(Event(type, data))

    def subscribe(self, listener: Callable[[Event], None]) -> Callable[[], None]:
        self.listeners.append(listener)
        return lambda: self.listeners.remove(listener)

    def recording(self, _id: str) -> Playback:
        if self.playback is None:
            raise NotFound("There is no recording.")
        return self.playback

    def actions(self) -> Actions:
        return Actions(
            get_session=self.get_session,
            get_draft=lambda _tool: {"sequence": list(self.draft)},
            tool_value=lambda _tool: self.tool,
            playback_value=self.recording,
            tool_state=lambda _tool: self.state,
            get_ready=self.ready.append,
            piece_faces=lambda _sid: None,
            cad_colours=lambda _tool: (None,) * self.tool.n,
            file_preview=lambda _tool, up: preview(two_boxes(), up),
            pick=self.pick,
            pick_up=lambda sid, up: self.ups.append((sid, up)),
            select=self.select,
            command=self.command,
            subscribe=self.subscribe,
        )


@dataclass
class Served:
    """A running server with the hub's routes."""

    hub: Hub
    port: int
    server: uvicorn.Server
    thread: threading.Thread

    @property
    def base(self) -> str:
        return f"http://127.0.0.1:{self.port}"

    def stop(self) -> None:
        self.server.should_exit = True
        self.thread.join(15)


def serve(hub: Hub) -> Served:
    """The hub behind a real uvicorn on a thread."""

    @asynccontextmanager
    async def lifespan(_app: FastAPI) -> AsyncIterator[None]:
        hub.start(asyncio.get_running_loop())
        yield
        await asyncio.to_thread(hub.close)

    async def not_found(_request: Request, error: Exception) -> Response:
        return Response(str(error), 404)

    app = FastAPI(lifespan=lifespan, exception_handlers={NotFound: not_found})
    app.include_router(hub.router)
    config = uvicorn.Config(app, host="127.0.0.1", port=0, log_level="error", ws="websockets-sansio", timeout_graceful_shutdown=2)
    server = uvicorn.Server(config)
    thread = threading.Thread(target=server.run, daemon=True)
    thread.start()
    until(lambda: server.started)
    return Served(hub, server.servers[0].sockets[0].getsockname()[1], server, thread)


def until(condition: Callable[[], Any], seconds: float = 15.0) -> None:
    """Wait for something another thread does."""
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "waited in vain"
        threading.Event().wait(0.01)


async def eventually(condition: Callable[[], Any], seconds: float = 15.0) -> None:
    await asyncio.to_thread(until, condition, seconds)


def connect(base: str, sid: str = "s1", origin: str | None = "same", port: int | None = None) -> websockets.connect:
    """A browser's websocket; `port` plays DNS rebinding: the address names another host that leads to us."""
    headers = {} if origin is None else {"Origin": base if origin == "same" else origin}
    where = {"host": "127.0.0.1", "port": port} if port else {}
    return websockets.connect(
        f"{base.replace('http', 'ws')}/v/{sid}",
        subprotocols=[websockets.Subprotocol(SUBPROTOCOL)],
        max_size=None,
        compression=None,
        additional_headers=headers,
        **where,
    )


CAMERA = msgspec.msgpack.encode(
    {
        "type": "ViewerCameraMessage", "wxyz": [1, 0, 0, 0], "position": [3, 3, 3], "fov": 1.3, "near": 0.01, "far": 1000.0,
        "image_height": 480, "image_width": 640, "look_at": [0, 0, 0], "up_direction": [0, 0, 1],
    }
)  # fmt: skip


def click(region: int) -> bytes:
    """The message a browser sends for a click on a region."""
    return msgspec.msgpack.encode(
        {
            "type": "SceneNodeClickMessage", "name": f"/tool/r{region:03d}", "instance_index": None, "ray_origin": [0, 0, 0],
            "ray_direction": [0, 0, 1], "screen_pos": [0.5, 0.5], "modifier": None, "owner": "",
        }
    )  # fmt: skip


def messages_in(frame: bytes) -> list[dict[str, Any]]:
    """The messages in one frame from the server: two sizes, zstd-compressed msgpack, then raw arrays (left unread)."""
    packed = int.from_bytes(frame[8:16], "little")
    return msgspec.msgpack.decode(zstandard.ZstdDecompressor().decompress(frame[16 : 16 + packed]))["messages"]


async def receive(socket: websockets.ClientConnection, enough: Callable[[list[dict[str, Any]]], bool]) -> list[dict[str, Any]]:
    """All messages until there are enough of them."""
    messages: list[dict[str, Any]] = []
    async with asyncio.timeout(15):
        while not enough(messages):
            frame = await socket.recv()
            assert isinstance(frame, bytes)
            messages += messages_in(frame)
    return messages
