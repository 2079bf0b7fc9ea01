"""The robot in a view: one node per body, posed by the clock of the recording."""

import numpy as np
import viser

from app.geometry.tool import Array
from app.robot.playback import Playback
from app.viewer.palette import Rgb, rgb, theme
from app.viewer.picture import Progress

LIGHT_BODIES = frozenset({"upper arm", "forearm"})
ROOM = 0.62  # share of the arm's reach around the tool that the camera shows
REACH_SAMPLES = 200  # poses looked at to find the room the arm needs


def order_of(playback: Playback) -> tuple[int, ...]:
    """Regions in the order the robot works them."""
    return tuple(report.region for report in sorted(playback.region_reports, key=lambda report: report.start_s))


def index_at(playback: Playback, time: float) -> int:
    """The recorded moment at or just before `time` (seconds)."""
    return int(np.clip(np.searchsorted(playback.times, time, side="right") - 1, 0, len(playback.times) - 1))


def progress_at(playback: Playback, time: float) -> Progress:
    """Regions done or in work at `time`; the one in work is the current one."""
    here = int(playback.region_at[index_at(playback, time)])
    order = order_of(playback)
    begun = {report.region for report in playback.region_reports if report.start_s <= time}
    troubled = frozenset(report.region for report in playback.region_reports if report.problems)
    return Progress(order, sum(region in begun for region in order), here if here >= 0 else None, troubled=troubled)


def room_needed(playback: Playback, middle: Array) -> Array:
    """Points (K, 3) the camera must show too: where the bodies pass, drawn in towards the tool so that the tool stays large."""
    every = max(1, len(playback.times) // REACH_SAMPLES)
    return middle + ROOM * (np.asarray(playback.positions[::every], dtype=float).reshape(-1, 3) - middle)


def ground(playback: Playback) -> float:
    """Height of the lowest point of the robot's base, metres."""
    vertices = np.asarray(playback.body_meshes[0][0], dtype=float)
    return float(playback.positions[0, 0, 2] + vertices[:, 2].min())


class Arm:
    """Body nodes under /robot."""

    def __init__(self, server: viser.ViserServer, playback: Playback, dark: bool) -> None:
        self._playback = playback
        self._shown: int | None = None
        with server.atomic():
            self._nodes = [
                server.scene.add_mesh_simple(
                    f"/robot/{k:02d}", np.asarray(vertices, np.float32), np.asarray(faces, np.uint32), color=body_colour(name, dark),
                    side="double", cast_shadow=False, receive_shadow=False,
                )
                for k, (name, (vertices, faces)) in enumerate(zip(playback.bodies, playback.body_meshes, strict=True))
            ]  # fmt: skip
        self.pose(server, 0.0)

    def pose(self, server: viser.ViserServer, time: float) -> None:
        """Place every body as recorded at `time`."""
        index = index_at(self._playback, time)
        if index == self._shown:
            return
        self._shown = index
        with server.atomic():
            for k, node in enumerate(self._nodes):
                node.position, node.wxyz = self._playback.positions[index, k], self._playback.orientations[index, k]
        server.flush()


def body_colour(name: str, dark: bool) -> Rgb:
    """Long links light, joints and base dark, the roller in the colour of what is going on."""
    colours = theme(dark)
    if name == "roller":
        return rgb(colours.current)
    return rgb(colours.arm if name in LIGHT_BODIES else colours.arm_joint)
