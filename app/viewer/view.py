"""One 3D view: the projection of a stored session onto a viser server.

Clicks, hotkeys and changes told by the store only enter a queue; one task per view takes them out, one at a time, and runs the
workflow and the repainting in a thread. So orders are kept and no two threads paint.
"""

import asyncio
import contextlib
import logging
import time
from collections.abc import Callable, Coroutine
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np

from app.errors import AppError
from app.geometry.tool import Tool
from app.robot.playback import Playback
from app.viewer.actions import Actions, Json
from app.viewer.arm import Arm, ground, progress_at, room_needed
from app.viewer.file_nodes import FileNodes
from app.viewer.marks import NOTHING, MarkNodes, marks_of
from app.viewer.palette import Rgb, tint_choice
from app.viewer.picture import Progress, draft_progress, paint, sequence_progress
from app.viewer.pointer import Background, Box, Pointer
from app.viewer.projection import camera_for
from app.viewer.rays import first_hit, ray_through, regions_in_box
from app.viewer.stage import Clicked, Stage, open_server

log = logging.getLogger(__name__)

Letters = Literal[
    "A", "B", "C", "D", "E", "F", "G", "H", "I", "J", "K", "L", "M", "N", "O", "P", "Q", "R", "S", "T", "U", "V", "W", "X", "Y", "Z"
]

TICK = 1 / 25  # s between poses of a running recording
LETTERS: tuple[Letters, ...] = get_args(Letters)


@dataclass(frozen=True)
class Hover:
    """The pointer, or the row of a table, is on a region."""

    region: int | None


@dataclass(frozen=True)
class Letter:
    """The key that is a region's name."""

    name: str


@dataclass(frozen=True)
class Command:
    """A hotkey."""

    name: Literal["undo", "redo"]


@dataclass(frozen=True)
class Refresh:
    """Something stored has changed."""


@dataclass(frozen=True)
class BodyClicked:
    """A click on a body of a file that is being asked about."""

    number: int


@dataclass(frozen=True)
class UpClicked:
    """A click on an arrow beside such a file."""

    direction: str  # of the file's frame: "+x", ...


Task = BodyClicked | UpClicked | Clicked | Box | Background | Hover | Letter | Command | Refresh


@dataclass(frozen=True)
class Clock:
    """Where a recording stands: `time` seconds at the moment `since` of the monotonic clock."""

    playing: bool = False
    time: float = 0.0
    speed: float = 1.0
    since: float = 0.0

    def now(self, cycle: float) -> float:
        passed = (time.monotonic() - self.since) * self.speed if self.playing else 0.0
        return min(self.time + passed, cycle)


def same_shape(one: Tool | None, other: Tool | None) -> bool:
    """Whether the same nodes serve both; names may differ."""
    if one is other or one is None or other is None:
        return one is other
    return np.array_equal(one.labels, other.labels) and np.array_equal(one.mesh.vertices, other.mesh.vertices)


def same_place(one: Tool | None, other: Tool | None) -> bool:
    """Whether both fill the same box, so that the camera may stay: the regions of a tool were edited, not the tool changed."""
    if one is None or other is None:
        return one is other
    ends = [(t.mesh.vertices.min(0), t.mesh.vertices.max(0)) for t in (one, other)]
    return np.allclose(ends[0], ends[1], rtol=0, atol=1e-9)


class View:
    """A viser server, what it shows, and the queue of what is to be done."""

    def __init__(self, sid: str, actions: Actions, loop: asyncio.AbstractEventLoop) -> None:
        self.sid = sid
        self.last_seen = time.monotonic()
        self.stops: set[asyncio.Event] = set()  # one per connected browser; set to end its bridge
        self._actions = actions
        self._loop = loop
        self._queue: asyncio.Queue[Task] = asyncio.Queue()
        self._scene: Json = {}
        self._dark: bool | None = None  # theme the nodes were built with
        self._tints: tuple[int, ...] = ()
        self._tool: Tool | None = None
        self._playback: Playback | None = None
        self._playback_shown: str | None = None
        self._arm: Arm | None = None
        self._hover: int | None = None
        self._ready_for: str | None = None  # tool prepared for edits
        self._marked: tuple[frozenset[int], frozenset[int]] = (frozenset(), frozenset())  # locked, hidden
        self._painted: tuple[Rgb | None, ...] = ()  # by the CAD file, where that is wished
        self._clock = Clock()
        self.server = open_server()
        self.stage = Stage(self.server, self._clicked)
        self._file = FileNodes(self.server, self.stage, self._body_clicked, self._up_clicked)
        self._file_shown: tuple[str, str, bool] | None = None
        self._pointer = Pointer(self.server, self.submit)
        self._marks = MarkNodes(self.server)
        self._add_hotkeys()
        self._task: asyncio.Task[None] | None = None
        self._closed = False

    @property
    def port(self) -> int:
        return self.server.get_port()

    @property
    def tool_id(self) -> str | None:
        return self._scene.get("tool_id")

    @property
    def playback_id(self) -> str | None:
        return self._scene.get("playback_id")

    # -- from viser's thread and the store's -----------------------------------------------------------------------------

    def submit(self, command: Task) -> None:
        """Queue a command from any thread."""
        with contextlib.suppress(RuntimeError):  # the loop has ended: nobody is looking any more
            self._loop.call_soon_threadsafe(self._queue.put_nowait, command)

    async def _clicked(self, clicked: Clicked) -> None:
        self.submit(clicked)

    async def _body_clicked(self, number: int) -> None:
        self.submit(BodyClicked(number))

    async def _up_clicked(self, direction: str) -> None:
        self.submit(UpClicked(direction))

    def _add_hotkeys(self) -> None:
        add = self.server.gui.add_command
        add("Undo", hotkey="Z", modifier="cmd/ctrl").on_trigger(self._triggered(Command("undo")))
        add("Redo", hotkey="Z", modifier="cmd/ctrl+shift").on_trigger(self._triggered(Command("redo")))
        for letter in LETTERS:
            add(f"Region {letter}", hotkey=letter).on_trigger(self._triggered(Letter(letter)))

    def _triggered(self, command: Task) -> Callable[[object], Coroutine[Any, Any, None]]:
        async def triggered(_event: object) -> None:
            self.submit(command)

        return triggered

    # -- on the application's loop ---------------------------------------------------------------------------------------

    def start(self) -> None:
        """Begin to take commands out of the queue; called on the loop."""
        self._task = self._loop.create_task(self._consume(), name=f"view {self.sid}")

    async def _consume(self) -> None:
        while True:
            command = await self._next()
            if not self._closed:
                await asyncio.to_thread(self._guarded, command)

    async def _next(self) -> Task | None:
        """The next command, or None when a running recording wants its next pose first."""
        if not (self._clock.playing and self._arm):
            return await self._queue.get()
        try:
            return await asyncio.wait_for(self._queue.get(), TICK)
        except TimeoutError:
            return None

    def close(self) -> None:
        """End the task, the bridges and the server; safe from any thread, twice too."""
        if self._closed:
            return
        self._closed = True
        with contextlib.suppress(RuntimeError):
            self._loop.call_soon_threadsafe(self._end)
        self.server.stop()

    def _end(self) -> None:
        if self._task is not None:
            self._task.cancel()
        for stop in self.stops:
            stop.set()

    # -- in a worker thread ----------------------------------------------------------------------------------------------

    def _guarded(self, command: Task | None) -> None:
        """The one place where failures of a view end: people read those meant for them, the rest is logged."""
        try:
            self.do(command)
        except AppError as error:
            self.notify(str(error))
        except Exception:
            if not self._closed:
                log.exception("view %s failed on %s", self.sid, command)

    def do(self, command: Task | None) -> None:
        """Carry out a command; None advances a running recording."""
        match command:
            case Clicked() | Background() | Box():
                if self._tool is not None:
                    self._pointed(self._tool, command)
            case BodyClicked(number):
                self._actions.pick(self.sid, number)
            case UpClicked(direction):
                self._actions.pick_up(self.sid, direction)
            case Hover(region):
                self._hover = region
                self._advance()
            case Letter(letter):
                named = [region for region, its in enumerate(self._tool.regions) if its.name == letter] if self._tool else []
                if named:
                    self._actions.pick(self.sid, named[0])
            case Command(name):
                if self._scene.get("mode") in ("record", "edit"):
                    self._actions.command(self.sid, name)
            case Refresh():
                self.refresh()
            case None:
                self._advance()

    def refresh(self) -> None:
        """Read the session again and show what it says."""
        session = self._actions.get_session(self.sid)
        self._scene = session["scene"]
        played = session["playback"]
        self._clock = Clock(played["playing"], played["time"], played["speed"], time.monotonic())
        self._build()
        self._advance()

    def _build(self) -> None:
        """Build the nodes again if the tool, the recording or the theme is another one."""
        tool_id, playback_id = self._scene.get("tool_id"), self._scene.get("playback_id")
        mode, dark = self._scene.get("mode", "empty"), bool(self._scene.get("dark"))
        if mode == "file":
            self._show_file(dark)
            return
        tool = self._actions.tool_value(tool_id) if tool_id and mode != "empty" else None
        playback = self._recording(playback_id) if playback_id and mode == "robot" else None
        moved = not same_shape(tool, self._tool) or playback is not self._playback
        away = playback is not self._playback or not same_place(tool, self._tool)
        if moved or dark != self._dark or self._file_shown:
            self._file_shown = None
            self._tool = None  # nothing to paint on, should the building fail
            self._marks.forget()
            self.stage.build(tool, dark, ground(playback) if playback is not None else None)
            self._arm = Arm(self.server, playback, dark) if playback is not None else None
        if tool is not None:
            self._tints = tint_choice(tool.graph.neighbour)
            if away:
                middle = tool.mesh.vertices.mean(0)
                self.stage.place_camera(camera_for(tool, room_needed(playback, middle) if playback is not None else None))
        self._tool, self._playback, self._playback_shown, self._dark = tool, playback, playback_id, dark
        self._pointer.listen(mode == "edit")
        if mode == "edit":
            self._get_ready(self._scene["tool_id"])
            state = self._actions.tool_state(self._scene["tool_id"])
            self._marked = frozenset(state["locked"]), frozenset(state["hidden"])
            self._painted = self._actions.cad_colours(self._scene["tool_id"]) if self._scene.get("colours") == "cad" else ()
        else:
            self._hover = None
        if tool is not None:
            piece = self._actions.piece_faces(self.sid) if mode == "edit" and self._scene.get("points") else None
            self._marks.draw(tool, marks_of(tool, self._scene, piece) if mode == "edit" else NOTHING, dark)

    def _show_file(self, dark: bool) -> None:
        """The file a tool is to be made from, while its import asks."""
        wanted = (self._scene["tool_id"], self._scene.get("up") or "+z", dark)
        if wanted != self._file_shown:
            self._tool, self._arm, self._playback, self._playback_shown, self._dark = None, None, None, None, dark
            self._marks.forget()
            self._pointer.listen(False)
            self._file.build(self._actions.file_preview(*wanted[:2]), wanted[1], dark)
            self._file_shown = wanted
        self._file.paint(self._scene.get("body"), self._scene.get("highlight") or [], dark)

    def _get_ready(self, tool_id: str) -> None:
        """Have the tool prepared for edits beside this view's queue, once."""
        if tool_id == self._ready_for:
            return
        self._ready_for = tool_id

        def prepare() -> None:
            with contextlib.suppress(AppError):  # deleted meanwhile, or not read in: then there is nothing to edit
                self._actions.get_ready(tool_id)

        with contextlib.suppress(RuntimeError):  # the loop has ended
            self._loop.call_soon_threadsafe(self._loop.run_in_executor, None, prepare)

    def _recording(self, playback_id: str) -> Playback | None:
        """The robot's recording; None while it is still being computed, which its page tells."""
        if playback_id == self._playback_shown and self._playback is not None:
            return self._playback  # recordings never change
        try:
            return self._actions.playback_value(playback_id)
        except AppError:
            return None

    def _advance(self) -> None:
        """Paint what the scene says now."""
        if self._tool is None:
            return
        now = 0.0
        if self._playback is not None and self._arm is not None:
            now = self._clock.now(self._playback.cycle_s)
            self._arm.pose(self.server, now)
            if now >= self._playback.cycle_s:
                self._clock = Clock(False, now, self._clock.speed)
        names = [region.name for region in self._tool.regions]
        picture = paint(self._progress(now), names, self._tints, bool(self._dark))
        if picture != self.stage.shown:
            self.stage.paint(picture)

    def _progress(self, now: float) -> Progress:
        scene, highlight = self._scene, self._scene.get("highlight") or ()
        mode = scene["mode"]
        if mode == "record":
            return draft_progress(self._actions.get_draft(scene["tool_id"])["sequence"], highlight)
        if mode == "edit":
            locked, hidden = self._marked
            selected = scene["selection"] if scene["pointing"] == "select" else ()  # else the points and lines are what matters
            return Progress(selected=frozenset(selected), hover=self._hover, locked=locked, hidden=hidden, painted=self._painted)
        if mode == "robot" and self._playback is not None:
            return progress_at(self._playback, now)
        if mode in ("sequence", "robot"):
            return sequence_progress(scene.get("sequence") or (), scene.get("step"), scene.get("differs") or (), highlight)
        return Progress(highlight=frozenset(highlight))

    def _pointed(self, tool: Tool, event: Clicked | Background | Box) -> None:
        """A click or a box in the view."""
        editing = self._scene.get("mode") == "edit"
        if isinstance(event, Box):
            found = regions_in_box(tool, event.camera, event.aspect, event.low, event.high)
            self._actions.select(self.sid, [region for region in found if region not in self._marked[1]])
        elif isinstance(event, Background):
            if first_hit(tool.mesh, np.array(event.origin), np.array(event.direction)) is None:
                self._actions.pick(self.sid, None)
        elif not editing:
            if event.region is not None and event.region < tool.n:
                self._actions.pick(self.sid, event.region)
        elif event.region is None or event.region < tool.n:
            among = tool.labels == (-1 if event.region is None else event.region)
            hit = first_hit(tool.mesh, np.array(event.origin), np.array(event.direction), among)
            point = None if hit is None else (hit[1] * 1e3).tolist()
            self._actions.pick(self.sid, event.region, point, modifier=event.modifier)

    def under(self, x: float, y: float) -> Json:
        """What a browser sees at a place of its canvas (0 to 1, y down); it is outlined, too."""
        tool, camera = self._tool, self._pointer.camera()
        hit = None
        if tool is not None and camera is not None:
            hidden = np.isin(tool.labels, list(self._marked[1])) if self._scene.get("mode") == "edit" else np.zeros(len(tool.labels), bool)
            hit = first_hit(tool.mesh, *ray_through(camera[0], x, y, camera[1]), ~hidden)
        region = int(tool.labels[hit[0]]) if tool is not None and hit is not None else -1
        found = region if region >= 0 else None
        if found != self._hover:
            self.submit(Hover(found))
        return {"region": found, "on_body": hit is not None and found is None, "point_mm": (hit[1] * 1e3).tolist() if hit else None}

    def notify(self, sentence: str) -> None:
        """Tell everybody who looks."""
        for client in self.server.get_clients().values():
            client.add_notification("Not done", sentence, auto_close_seconds=6)
