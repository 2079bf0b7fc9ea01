"""What a view shows of a file that is still being asked about: its bodies, an arrow that points up, and five to choose another up."""

from collections.abc import Awaitable, Callable
from typing import Any, cast

import numpy as np
import trimesh
import viser

from app.geometry.importing import UP, rotation_to_up
from app.geometry.parsed import ALL
from app.geometry.preview import Preview
from app.geometry.tool import Array, Tool
from app.viewer.borders import part_of
from app.viewer.palette import Rgb, faded, mixed, rgb, theme
from app.viewer.picture import SELECTED_SHARE
from app.viewer.projection import Camera, camera_for
from app.viewer.stage import Stage

MOST_NAMES = 12  # bodies whose names are printed on them
ARROW, SHORT = 0.3, 0.14  # length of the arrow that points up, and of those to be clicked, of the file's longest side
GAP = 0.05  # between the file and the arrows around it


def body_colour(number: int, chosen: str | None, pointed: bool, dark: bool) -> Rgb:
    """A tint of its own for what becomes the tool, washed out for what is left out, the signal colour for what is pointed at."""
    tints = theme(dark).region_tints
    colour = rgb(tints[number % len(tints)])
    if chosen not in (None, ALL, str(number + 1)):
        colour = faded(rgb(theme(dark).body), dark)
    return mixed(colour, rgb(theme(dark).current), SELECTED_SHARE) if pointed else colour


def file_camera(file: Preview, up: str) -> Camera:
    """From where the file and all its arrows are seen."""
    low, high = file.mesh.vertices.min(0), file.mesh.vertices.max(0)
    foot, rise = up_arrow(low)
    tips = [start + 1.3 * way for start, way in other_arrows(low, high, up).values()]
    return camera_for(cast(Tool, file), np.array([foot + 1.2 * rise, high, *tips]))


def axis_word(direction: str) -> str:
    """ "+y" as it is printed on an arrow: Y, and -Y for the opposite one."""
    return direction[1].upper() if direction[0] == "+" else f"\u2212{direction[1].upper()}"


def up_arrow(low: Array) -> tuple[Array, Array]:
    """Foot and length of the arrow that points up, in front to the left of a file whose box begins at `low`."""
    return np.array([low[0] - ARROW / 2, low[1], 0.0]), np.array([0.0, 0.0, ARROW])


def other_arrows(low: Array, high: Array, up: str) -> dict[str, tuple[Array, Array]]:
    """Foot and length of an arrow per other direction of the file's frame, around a file that stands with `up` up.

    They leave from the sides of its box; the one that points down stands beside the one that points up, where it can be seen.
    """
    arrows, middle, half = {}, (low + high) / 2, (high - low) / 2
    for direction in (d for d in UP if d != up):
        axis, sign = "xyz".index(direction[1]), 1.0 if direction[0] == "+" else -1.0
        way = rotation_to_up(up) @ (sign * np.eye(3)[axis])
        if way[2] < -0.5:
            foot, rise = up_arrow(low)
            arrows[direction] = (foot + 0.75 * rise - (0, SHORT, 0), SHORT * way)
        else:
            arrows[direction] = (middle + way * (half + GAP), SHORT * way)
    return arrows


class FileNodes:
    """The nodes of one file on the stage."""

    def __init__(
        self, server: viser.ViserServer, stage: Stage, on_click: Callable[[int], Awaitable[None]], on_up: Callable[[str], Awaitable[None]]
    ) -> None:
        self._server = server
        self._stage = stage
        self._on_click = on_click
        self._on_up = on_up
        self._bodies: list[viser.MeshHandle] = []

    def build(self, file: Preview, up: str, dark: bool) -> None:
        """Replace whatever is shown by the file, standing with a direction of its own frame up."""
        scene, colours, whole = self._server.scene, theme(dark), cast(Tool, file)  # floor and camera look at the mesh only
        self._stage.build(None, dark)
        with self._server.atomic():
            self._stage._add_floor(whole, colours, None)
            self._bodies = [self._add_body(file, number) for number in range(len(file.names))]
            low, high = file.mesh.vertices.min(0), file.mesh.vertices.max(0)
            foot, rise = up_arrow(low)
            arrow = np.stack([foot, foot + rise])[None]
            scene.add_arrows("/file/up", arrow, rgb(colours.current), shaft_radius=0.008, head_radius=0.025, head_length=0.07)
            scene.add_label("/file/up/word", f"up: {axis_word(up)}", position=foot + 1.08 * rise, anchor="bottom-center")
            for direction, (start, way) in other_arrows(low, high, up).items():
                self._add_choice(direction, start, way, rgb(colours.body))
            if 1 < len(file.names) <= MOST_NAMES:
                for number, name in enumerate(file.names):
                    mine = file.mesh.vertices[np.unique(file.mesh.faces[file.body == number])]
                    top = (*mine[:, :2].mean(axis=0), mine[:, 2].max() + 0.02)
                    scene.add_label(f"/file/name{number}", name, position=top, anchor="bottom-center")
        self._stage.place_camera(file_camera(file, up))

    def paint(self, chosen: str | None, pointed: list[int], dark: bool) -> None:
        """Colour the bodies by what becomes of them."""
        with self._server.atomic():
            for number, body in enumerate(self._bodies):
                body.color = body_colour(number, chosen, number in pointed, dark)
        self._server.flush()

    def _add_choice(self, direction: str, start: Array, way: Array, colour: Rgb) -> None:
        """An arrow that a click makes the one that points up."""
        length = float(np.linalg.norm(way))
        shaft = trimesh.creation.cylinder(0.011, length * 0.55, sections=16)
        shaft.apply_translation((0, 0, length * 0.275))
        head = trimesh.creation.cone(0.034, length * 0.5, sections=24)
        head.apply_translation((0, 0, length * 0.5))
        arrow = cast(trimesh.Trimesh, trimesh.util.concatenate([shaft, head]))
        arrow.apply_transform(trimesh.geometry.align_vectors([0, 0, 1], way / length))
        node = self._server.scene.add_mesh_simple(
            f"/file/choice{direction}", arrow.vertices + start, arrow.faces, color=colour, cast_shadow=False, receive_shadow=False
        )
        self._server.scene.add_label(f"/file/choice{direction}/word", axis_word(direction), position=start + 1.12 * way)

        async def clicked(_event: Any) -> None:
            await self._on_up(direction)

        node.on_click(clicked)

    def _add_body(self, file: Preview, number: int) -> viser.MeshHandle:
        vertices, faces = part_of(file.mesh, file.mesh.faces[file.body == number])
        body = self._server.scene.add_mesh_simple(
            f"/file/body{number}", vertices, faces, side="double", flat_shading=True, cast_shadow=False, receive_shadow=False
        )

        async def clicked(_event: Any) -> None:
            await self._on_click(number)

        body.on_click(clicked)
        return body
