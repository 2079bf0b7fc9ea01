"""What a view shows of a file that is still being asked about: its bodies, and an arrow that points up."""

from collections.abc import Awaitable, Callable
from typing import Any, cast

import numpy as np
import viser

from app.geometry.parsed import ALL
from app.geometry.preview import Preview
from app.geometry.tool import Tool
from app.viewer.borders import part_of
from app.viewer.palette import Rgb, faded, mixed, rgb, theme
from app.viewer.picture import SELECTED_SHARE
from app.viewer.projection import camera_for
from app.viewer.stage import Stage

MOST_NAMES = 12  # bodies whose names are printed on them
ARROW = 0.3  # its length, of the file's longest side


def body_colour(number: int, chosen: str | None, pointed: bool, dark: bool) -> Rgb:
    """A tint of its own for what becomes the tool, washed out for what is left out, the signal colour for what is pointed at."""
    tints = theme(dark).region_tints
    colour = rgb(tints[number % len(tints)])
    if chosen not in (None, ALL, str(number + 1)):
        colour = faded(rgb(theme(dark).body), dark)
    return mixed(colour, rgb(theme(dark).current), SELECTED_SHARE) if pointed else colour


class FileNodes:
    """The nodes of one file on the stage."""

    def __init__(self, server: viser.ViserServer, stage: Stage, on_click: Callable[[int], Awaitable[None]]) -> None:
        self._server = server
        self._stage = stage
        self._on_click = on_click
        self._bodies: list[viser.MeshHandle] = []

    def build(self, file: Preview, dark: bool) -> None:
        """Replace whatever is shown by the file."""
        scene, colours, whole = self._server.scene, theme(dark), cast(Tool, file)  # floor and camera look at the mesh only
        self._stage.build(None, dark)
        with self._server.atomic():
            self._stage._add_floor(whole, colours, None)
            self._bodies = [self._add_body(file, number) for number in range(len(file.names))]
            low, high = file.mesh.vertices.min(0), file.mesh.vertices.max(0)
            foot, rise = np.array([low[0] - ARROW / 2, low[1], 0.0]), np.array([0.0, 0.0, ARROW])
            arrow = np.stack([foot, foot + rise])[None]
            scene.add_arrows("/file/up", arrow, rgb(colours.current), shaft_radius=0.008, head_radius=0.025, head_length=0.07)
            scene.add_label("/file/up/word", "up", position=foot + 1.08 * rise, anchor="bottom-center")
            if 1 < len(file.names) <= MOST_NAMES:
                for number, name in enumerate(file.names):
                    mine = file.mesh.vertices[np.unique(file.mesh.faces[file.body == number])]
                    top = (*mine[:, :2].mean(axis=0), mine[:, 2].max() + 0.02)
                    scene.add_label(f"/file/name{number}", name, position=top, anchor="bottom-center")
        self._stage.place_camera(camera_for(whole, np.array([foot + 1.2 * rise, high])))

    def paint(self, chosen: str | None, pointed: list[int], dark: bool) -> None:
        """Colour the bodies by what becomes of them."""
        with self._server.atomic():
            for number, body in enumerate(self._bodies):
                body.color = body_colour(number, chosen, number in pointed, dark)
        self._server.flush()

    def _add_body(self, file: Preview, number: int) -> viser.MeshHandle:
        vertices, faces = part_of(file.mesh, file.mesh.faces[file.body == number])
        body = self._server.scene.add_mesh_simple(
            f"/file/body{number}", vertices, faces, side="double", flat_shading=True, cast_shadow=False, receive_shadow=False
        )

        async def clicked(_event: Any) -> None:
            await self._on_click(number)

        body.on_click(clicked)
        return body
