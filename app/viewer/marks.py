"""What is drawn on the part while its regions are edited: clicked points, the line or plane through them, the piece meant."""

from dataclasses import dataclass

import numpy as np
import viser
from numpy.typing import NDArray

from app.errors import AppError
from app.geometry.editing import plane_trace, upright_plane
from app.geometry.line_cut import draw_line
from app.geometry.tool import Array, Tool
from app.viewer.borders import rim, size
from app.viewer.palette import rgb, theme
from app.viewer.stage import CASING_WIDTH, LIFT, OUTLINE_WIDTH

POINT = 0.009  # radius of a clicked point / diagonal of the part


@dataclass(frozen=True)
class Marks:
    """Clicked points and lines, ready to be drawn; metres."""

    points: Array  # (K, 3)
    line: Array  # (S, 2, 3)
    trouble: str | None = None  # why there is no line

    def same(self, other: "Marks | None") -> bool:
        return other is not None and np.array_equal(self.points, other.points) and np.array_equal(self.line, other.line)


NOTHING = Marks(np.empty((0, 3)), np.empty((0, 2, 3)))


def marks_of(tool: Tool, scene: dict, piece: NDArray[np.bool_] | None) -> Marks:
    """What a scene in the mode edit draws on the part."""
    clicked = scene.get("points") or []
    points = np.array([p["point_mm"] for p in clicked], float).reshape(-1, 3) * 1e-3
    if piece is not None and len(piece) == len(tool.labels):
        edges = rim(tool.mesh.faces[piece])
        return Marks(points, tool.mesh.vertices[edges])
    region = clicked[0]["region"] if clicked else None
    if region is None or region >= tool.n or len(points) < 2 or scene.get("pointing") != "points":
        return Marks(points, NOTHING.line)
    try:
        return Marks(points, _line(tool, region, points, scene))
    except AppError as error:
        return Marks(points, NOTHING.line, str(error))


def _line(tool: Tool, region: int, points: Array, scene: dict) -> Array:
    if scene.get("path") == "plane":
        return plane_trace(tool, region, points[-2], upright_plane(tool, region, points[-2], points[-1]))
    if scene.get("path") != "line":
        return NOTHING.line
    chain = draw_line(tool, region, points, bool(scene.get("closed")) and len(points) > 2).points
    return np.stack([chain[:-1], chain[1:]], axis=1)


class MarkNodes:
    """The nodes of the marks; replaced as a whole."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._server = server
        self._nodes: list[viser.SceneNodeHandle] = []
        self._shown: Marks | None = None

    def forget(self) -> None:
        """The scene was emptied; its nodes are gone."""
        self._nodes, self._shown = [], None

    def draw(self, tool: Tool, marks: Marks, dark: bool) -> None:
        """Draw the marks in place of those before."""
        if marks.same(self._shown):
            return
        for node in self._nodes:
            node.remove()
        self._nodes, self._shown = [], marks
        scene, span, colours = self._server.scene, size(tool), theme(dark)
        for number, point in enumerate(marks.points):
            place = tuple(point.tolist())
            ball = scene.add_icosphere(f"/marks/point{number}", radius=POINT * span, color=rgb(colours.current), position=place)
            self._nodes.append(ball)
        if len(marks.line):
            lifted = marks.line + 2 * LIFT * span * np.array([0.0, 0.0, 1.0])
            for name, colour, width in (("casing", colours.surface, CASING_WIDTH), ("line", colours.current, OUTLINE_WIDTH)):
                self._nodes.append(
                    scene.add_line_segments(f"/marks/{name}", lifted, rgb(colour), thickness=width, thickness_units="screen")
                )
        self._server.flush()
