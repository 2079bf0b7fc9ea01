"""The viser side of a view: its server, lights, grid, part, labels and outlines."""

from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import viser
from numpy.typing import NDArray
from viser import _messages  # private, guarded by tests/viewer/test_viser.py

from app.geometry.creases import creased
from app.geometry.tool import Array, Tool
from app.viewer.borders import find_lines, part_of, size
from app.viewer.palette import Rgb, Theme, linear, rgb, theme
from app.viewer.picture import Picture, RegionLook
from app.viewer.projection import Camera, label_points

LIGHT_FROM = np.array([-0.45, -0.6, 1.15])  # upper left, in front
PLATE, SMALL_PLATE = 1.35, 0.9  # of viser's 12 px em; small beside the robot, where the tool is small too
LETTER_HEIGHT = 0.036  # of the part's diagonal
EDGE_WIDTH, OUTLINE_WIDTH, CASING_WIDTH = 2.0, 4.5, 7.5  # px; shaders.py tells them apart by these
LIFT, LABEL_LIFT = 0.001, 0.012  # above the surface, of the part's diagonal

Modifier = Literal["shift", "cmd/ctrl"] | None
MODIFIERS: tuple[Modifier, ...] = (None, "shift", "cmd/ctrl")


@dataclass(frozen=True)
class Clicked:
    """A click on a region, or on the part beside the regions (None), and its ray in the tool frame."""

    region: int | None
    origin: tuple[float, float, float]
    direction: tuple[float, float, float]
    modifier: bool


OnClick = Callable[[Clicked], Awaitable[None]]


def open_server() -> viser.ViserServer:
    """A server only this machine can reach, without the tunnel that viser would open for anybody who asks."""
    server = viser.ViserServer(host="127.0.0.1", port=0, label="Apprentice", verbose=False)
    for message in (_messages.ShareUrlRequest, _messages.ShareUrlDisconnect):
        server._websock_server.unregister_handler(message)
    server.scene.configure_environment_map(hdri=None)
    server.scene.configure_default_lights(enabled=False, cast_shadow=False)
    server.scene.set_up_direction("+z")
    return server


class Stage:
    """Nodes of one tool. Built anew for another tool; repainted by differences."""

    def __init__(self, server: viser.ViserServer, on_click: OnClick) -> None:
        self.server = server
        self._on_click = on_click
        self._clear()

    def _clear(self) -> None:
        self.shown: Picture | None = None
        self._regions: list[viser.MeshHandle] = []
        self._labels: list[viser.LabelHandle] = []
        self._letters: list[viser.LabelHandle] = []
        self._rims: tuple[Array, ...] = ()
        self._outlines: list[viser.LineSegmentsHandle] = []
        self._borders: viser.LineSegmentsHandle | None = None

    def build(self, tool: Tool | None, dark: bool, ground: float | None = None) -> None:
        """Replace whatever is shown by the tool, not painted yet. Beside a robot it stands on a block on the ground (metres)."""
        scene, colours = self.server.scene, theme(dark)
        with self.server.atomic():
            scene.reset()
            self._clear()
            self.server.gui.configure_theme(dark_mode=dark, show_logo=False, show_share_button=False)
            self._add_lights(colours)
            if tool is not None:
                self._add_floor(tool, colours, ground)
                self._add_part(tool, colours)
                self._add_labels(tool, dark, PLATE if ground is None else SMALL_PLATE)
        self.server.flush()

    def paint(self, picture: Picture) -> None:
        """Make the regions look like the picture; what looks so already is left alone."""
        before = self.shown.regions if self.shown else (None,) * len(picture.regions)
        with self.server.atomic():
            for region, (old, new) in enumerate(zip(before, picture.regions, strict=True)):
                if old != new:
                    self._paint_region(region, new)
            if before and [look is None or look.visible for look in before] != [look.visible for look in picture.regions]:
                seen = [rim for rim, look in zip(self._rims, picture.regions, strict=True) if look.visible]
                self._draw_borders(np.concatenate(seen) if seen else np.empty((0, 2, 3)), theme(picture.dark))
            if self.shown is None or _outlines(self.shown) != _outlines(picture):
                self._draw_outlines(picture)
        self.shown = picture
        self.server.flush()

    def place_camera(self, camera: Camera) -> None:
        """Where new clients start and Reset View leads; clients already here are moved there too."""
        near, far = camera.distance / 50, camera.distance * 50
        start = self.server.initial_camera
        start.position, start.look_at, start.up = camera.position, camera.look_at, camera.up
        start.fov, start.near, start.far = camera.fov, near, far
        for client in self.server.get_clients().values():
            with client.atomic():
                client.camera.up_direction, client.camera.position, client.camera.look_at = camera.up, camera.position, camera.look_at
                client.camera.fov, client.camera.near, client.camera.far = camera.fov, near, far

    def _add_lights(self, colours: Theme) -> None:
        shade = (colours.ambient - 0.10) ** 2.2  # linear light of the darkest side
        full = (colours.ambient + 0.20) ** 2.2 - shade
        scene, direction = self.server.scene, LIGHT_FROM / np.linalg.norm(LIGHT_FROM)
        scene.add_light_ambient("/light/everywhere", intensity=np.pi * shade)
        scene.add_light_directional("/light/upper_left", intensity=np.pi * full / direction[2], position=tuple(direction * 100))

    def _add_floor(self, tool: Tool, colours: Theme, ground: float | None) -> None:
        low, high = tool.mesh.vertices.min(0), tool.mesh.vertices.max(0)
        span, grey = size(tool), rgb(colours.grid)
        (x, y), bottom = (low[:2] + high[:2]) / 2, low[2]
        if ground is not None and ground < bottom:
            width, depth = 0.92 * (high - low)[:2]
            block = (float(width), float(depth), float(bottom - ground))
            middle = (x, y, (ground + bottom) / 2)
            self.server.scene.add_box(
                "/block", dimensions=block, color=rgb(colours.body), cast_shadow=False, receive_shadow=False, position=middle
            )
            bottom = ground
        self.server.scene.add_grid(
            "/floor", width=8 * span, height=8 * span, cell_size=span / 7, section_size=span / 7, cell_color=grey, section_color=grey,
            cell_thickness=0.8, section_thickness=0.0, fade_distance=7 * span, fade_strength=1.0, shadow_opacity=0.0,
            position=(x, y, bottom - 0.001 * span),
        )  # fmt: skip

    def _add_part(self, tool: Tool, colours: Theme) -> None:
        span = size(tool)
        rest = tool.mesh.faces[tool.labels < 0]
        if len(rest):
            body = self._add_mesh("/tool/body", *part_of(tool.mesh, rest), rgb(colours.body), flat_shading=True)
            self._listen(body, None)
        sharp = creased(tool.mesh, tool.labels)
        for region in range(tool.n):
            vertices, faces = part_of(sharp, sharp.faces[tool.labels == region])
            mesh = self._add_mesh(f"/tool/r{region:03d}", vertices, faces, rgb(colours.body))
            self._listen(mesh, region)
            self._regions.append(mesh)
        lines = find_lines(tool, LIFT * span)
        self._rims = lines.rims
        self._draw_borders(lines.every, colours)

    def _draw_borders(self, borders: Array, colours: Theme) -> None:
        if self._borders is not None:
            self._borders.remove()
            self._borders = None
        if len(borders):
            self._borders = self.server.scene.add_line_segments(
                "/tool/borders", borders, rgb(colours.edge), thickness=EDGE_WIDTH, thickness_units="screen"
            )

    def _add_mesh(self, name: str, vertices: np.ndarray, faces: np.ndarray, colour: Rgb, flat_shading: bool = False) -> viser.MeshHandle:
        return self.server.scene.add_mesh_simple(
            name, vertices, faces, color=colour, side="double", flat_shading=flat_shading, cast_shadow=False, receive_shadow=False
        )

    def _listen(self, mesh: viser.MeshHandle, region: int | None) -> None:
        async def clicked(event: Any) -> None:  # async: viser keeps these in order; plain callbacks overtake each other
            await self._on_click(Clicked(region, event.ray_origin, event.ray_direction, event.modifier is not None))

        for modifier in MODIFIERS:
            mesh.on_click(modifier=modifier)(clicked)

    def _add_labels(self, tool: Tool, dark: bool, plate: float) -> None:
        span = size(tool)
        normals = np.array([region.normal for region in tool.regions]).reshape(-1, 3)
        for region, point in enumerate(label_points(tool) + LABEL_LIFT * span * normals):
            self._labels.append(
                self.server.scene.add_label(
                    f"/plates/r{region:03d}", "", position=point, visible=False, anchor="center-center", font_screen_scale=plate,
                    depth_test=True,
                )
            )  # fmt: skip
            height = LETTER_HEIGHT * span
            self._letters.append(
                self.server.scene.add_label(
                    f"/letters/r{region:03d}", "", position=point, visible=False, anchor="center-center", font_size_mode="scene",
                    font_scene_height=-height if dark else height, depth_test=True,  # the sign carries the ink, see page.py
                )
            )  # fmt: skip

    def _paint_region(self, region: int, new: RegionLook) -> None:
        self._regions[region].color = new.colour
        self._regions[region].visible = new.visible
        for label, wanted in ((self._labels[region], new.plate), (self._letters[region], not new.plate)):
            if wanted:
                label.text = new.text
            label.visible = wanted and new.visible

    def _draw_outlines(self, picture: Picture) -> None:
        """Thick lines on a casing of the surface's colour around outlined regions."""
        scene, colours = self.server.scene, theme(picture.dark)
        for node in self._outlines:
            node.remove()
        self._outlines = []
        outlined = [region for region, look in enumerate(picture.regions) if look.outline and look.visible]
        if not outlined:
            return
        points = np.concatenate([self._rims[region] for region in outlined])
        ink = [np.tile(_vertex_colour(_outline_colour(picture.regions[r], colours)), (len(self._rims[r]), 2, 1)) for r in outlined]
        for name, colour, width in (
            ("/outlines/casing", rgb(colours.surface), CASING_WIDTH),
            ("/outlines/line", np.concatenate(ink), OUTLINE_WIDTH),
        ):
            self._outlines.append(scene.add_line_segments(name, points, colour, thickness=width, thickness_units="screen"))


def _outlines(picture: Picture) -> tuple[str | None, ...]:
    return tuple(look.outline if look.visible else None for look in picture.regions)


def _outline_colour(look: RegionLook, colours: Theme) -> Rgb:
    return rgb(
        {
            "current": colours.current,
            "differs": colours.differs,
            "conflict": colours.conflict,
            "selected": colours.current,
            "hover": colours.label_ink,
        }[look.outline or "current"]
    )


def _vertex_colour(colour: Rgb) -> NDArray[np.uint8]:
    """Colours given per vertex are taken as linear light, unlike all others."""
    return np.rint(linear(np.array(colour) / 255) * 255).astype(np.uint8)
