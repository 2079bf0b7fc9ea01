"""The strokes of a region joined to as few uninterrupted runs as the surface allows."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from app.geometry.tool import Array
from app.robot.parameters import RollerSize
from app.robot.raster import Patch, Samples, Stroke, draw_samples, reverse, strokes_over

LONGEST_TURN = 3.0  # stroke spacings: a longer way between strokes is made through the air


def runs_over(patch: Patch, roller: RollerSize) -> list[Stroke]:
    """Runs of waypoints in contact, in order; between two runs the roller lifts."""
    strokes = strokes_over(patch, roller.spacing, roller.step, margin=0.35 * roller.width)
    surface = draw_samples(patch, roller.width / 2)
    tree = KDTree(surface.points)
    runs: list[Stroke] = []
    for stroke in _ordered(strokes):
        turn = _turn(runs[-1], stroke, surface, tree, roller) if runs else None
        if turn is None:
            runs.append(stroke)
        else:
            parts = (runs[-1], turn, stroke)
            runs[-1] = Stroke(np.concatenate([p.points for p in parts]), np.concatenate([p.normals for p in parts]))
    return [r for r in runs if _long_enough(r, roller)] or runs[:1]


def _long_enough(run: Stroke, roller: RollerSize) -> bool:
    """Shorter runs at the tip of a region are covered by their neighbours and not worth a touch-down."""
    return float(np.linalg.norm(np.diff(run.points, axis=0), axis=1).sum()) > 0.3 * roller.width


def _ordered(strokes: list[Stroke]) -> list[Stroke]:
    """Always the stroke with the nearest free end next; the first is the first level's."""
    rest, order = list(strokes), []
    while rest:
        if not order:
            order.append(rest.pop(0))
            continue
        here = order[-1].points[-1]
        ends = np.array([[np.linalg.norm(s.points[0] - here), np.linalg.norm(s.points[-1] - here)] for s in rest])
        which, flip = divmod(int(ends.argmin()), 2)
        chosen = rest.pop(which)
        order.append(reverse(chosen) if flip else chosen)
    return order


def _turn(run: Stroke, stroke: Stroke, surface: Samples, tree: KDTree, roller: RollerSize) -> Stroke | None:
    """Waypoints on the surface from the end of `run` to the start of `stroke`, without either; None where there is a gap."""
    a, b = run.points[-1], stroke.points[0]
    gap = float(np.linalg.norm(b - a))
    if gap > LONGEST_TURN * roller.spacing or run.normals[-1] @ stroke.normals[0] < 0.5:
        return None
    share = np.linspace(0, 1, max(2, int(np.ceil(gap / roller.step)) + 1))[1:-1, None]
    straight = a + (b - a) * share
    normals = run.normals[-1] * (1 - share) + stroke.normals[0] * share
    if not len(straight):
        return Stroke(straight, normals)
    distance, nearest = tree.query(straight)
    if (distance > max(roller.width, 0.5 * roller.spacing)).any():
        return None
    return Stroke(*_settle(straight, normals, surface, np.asarray(nearest, np.int64)))


def _settle(points: Array, normals: Array, surface: Samples, nearest: NDArray[np.int64]) -> tuple[Array, Array]:
    """Points moved along their normal onto the plane of the nearest surface sample."""
    normals = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    plane = surface.normals[nearest]
    height = np.einsum("ij,ij->i", surface.points[nearest] - points, plane) / np.maximum(np.einsum("ij,ij->i", normals, plane), 0.3)
    return points + normals * height[:, None], normals
