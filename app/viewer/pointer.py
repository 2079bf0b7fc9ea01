"""What a pointer does on the canvas beside clicking regions: clicks on nothing, boxes; and from where each browser looks."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import viser

from app.viewer.projection import Camera


@dataclass(frozen=True)
class Background:
    """A click anywhere; it comes after that of a region, if it hit one."""

    origin: tuple[float, float, float]
    direction: tuple[float, float, float]


@dataclass(frozen=True)
class Box:
    """A box drawn on the canvas (0 to 1, y down), and from where its browser looked."""

    low: tuple[float, float]
    high: tuple[float, float]
    camera: Camera
    aspect: float


class Pointer:
    """Listens while regions are edited; shift and drag draw a box, dragging alone still turns the part."""

    def __init__(self, server: viser.ViserServer, submit: Callable[[Any], None]) -> None:
        self._server = server
        self._submit = submit
        self._listening = False

    def listen(self, wanted: bool) -> None:
        """Begin or end to listen."""
        if wanted == self._listening:
            return
        self._listening = wanted
        scene = self._server.scene
        if wanted:
            clicked: Any = self._clicked  # viser takes coroutines, too; its types don't say so
            boxed: Any = self._boxed
            scene.on_click()(clicked)
            scene.on_rect_select(modifier="shift")(boxed)
        else:
            scene.remove_click_callback()
            scene.remove_rect_select_callback()

    async def _clicked(self, event: viser.SceneClickEvent) -> None:
        self._submit(Background(event.ray_origin, event.ray_direction))

    async def _boxed(self, event: viser.SceneRectSelectEvent) -> None:
        camera, aspect = camera_of(event.client)
        self._submit(Box(event.screen_min, event.screen_max, camera, aspect))

    def camera(self) -> tuple[Camera, float] | None:
        """The camera and the aspect of the canvas of the browser that came last; None when nobody looks."""
        clients = self._server.get_clients()
        return camera_of(clients[max(clients)]) if clients else None


def camera_of(client: viser.ClientHandle) -> tuple[Camera, float]:
    """From where a browser looks, and width over height of its canvas."""
    its = client.camera
    position, look_at = np.asarray(its.position, float), np.asarray(its.look_at, float)
    return Camera(position, look_at, np.asarray(its.up_direction, float), float(its.fov)), float(its.aspect)
