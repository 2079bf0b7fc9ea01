"""The robot moves by the clock while the recording plays and stands still when paused."""

import asyncio
import time

from app.viewer.view import Clock
from tests.viewer.fakes import CAMERA, FakeWorkflow, Served, connect, eventually
from tests.viewer.test_picture import recording


def test_clock_runs_with_its_speed_and_stops_at_the_end() -> None:
    since = time.monotonic() - 2.0
    assert Clock(False, 3.0, 2.0, since).now(10.0) == 3.0
    assert abs(Clock(True, 3.0, 2.0, since).now(10.0) - 7.0) < 0.5
    assert Clock(True, 3.0, 100.0, since).now(10.0) == 10.0


def test_robot_plays_pauses_and_marks_regions(served: Served, workflow: FakeWorkflow) -> None:
    workflow.playback = recording()

    def control(playing: bool, at: float, speed: float) -> None:
        workflow.running = {"playing": playing, "time": at, "speed": speed, "duration": 7.5}
        workflow.tell("scene.changed", session_id="s1", playback=True)

    async def main() -> None:
        workflow.scene = {"mode": "robot", "tool_id": "t1", "playback_id": "p1"}
        async with connect(served.base) as socket:
            await socket.send(CAMERA)
            view = served.hub._views["s1"]
            roller = view._arm._nodes[1]  # its x is the time of the recording
            control(playing=False, at=3.0, speed=1.0)
            await eventually(lambda: roller.position[0] == 3.0)
            assert [look.text for look in view.stage.shown.regions[:3]] == ["2", "B", "1"]
            assert view.stage.shown.regions[0].outline == "current"
            control(playing=True, at=3.0, speed=20.0)
            await eventually(lambda: view._arm._nodes[1].position[0] == 7.5)
            assert [look.text for look in view.stage.shown.regions[:3]] == ["2", "3", "1"]
            assert view._arm._nodes[1] is roller, "posed, not built again"

    asyncio.run(main())
