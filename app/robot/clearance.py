"""Would a link touch the tool, or the wrist the arm? Capsules against points drawn on the whole part."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.geometry.tool import Array, Tool
from app.robot import arm
from app.robot.cell import STEM, Placement
from app.robot.raster import Patch, draw_samples, patch_of

STEM_RADIUS, STEM_FREE = 0.014, 0.035  # m; the last part of the stem belongs to the roller, which is meant to touch
SLIGHT = 0.002  # m of overlap that is within the accuracy of the points
SELF_PAIRS = (("wrist 2", "upper arm"), ("wrist 3", "upper arm"), ("wrist 1", "shoulder"), ("wrist 2", "shoulder"), ("wrist 3", "shoulder"))
POSES_AT_ONCE = 40


@dataclass(frozen=True)
class Cloud:
    """Points on the part."""

    points: Array  # (S, 3) metres, tool frame
    owner: NDArray[np.int32]  # (S,) region, -1 outside the working surface


@dataclass(frozen=True)
class Touch:
    """The deepest overlap found."""

    body: str
    other: str | int  # a region, -1 for the rest of the part, or the name of a link
    depth: float  # m


def cloud_of(tool: Tool, most: int = 2500) -> Cloud:
    """Points over the whole part, evenly by area."""
    owners = np.unique(tool.labels)
    patches = [(int(k), patch_of(tool.mesh, tool.labels, int(k))) for k in owners]
    patches = [(k, p) for k, p in patches if len(p.areas)]
    width = np.sqrt(12 * sum(float(p.areas.sum()) for _, p in patches) / most)
    parts = [(k, _thinned(p, width)) for k, p in patches]
    owner = np.concatenate([np.full(len(points), k, np.int32) for k, points in parts])
    return Cloud(np.concatenate([points for _, points in parts]), owner)


def _thinned(patch: Patch, width: float) -> Array:
    """The samples of a patch; small patches are not drawn denser than the rest."""
    points = draw_samples(patch, width).points
    wanted = max(8, int(np.ceil(12 * patch.areas.sum() / width**2)))
    return points[:: max(1, len(points) // wanted)]


def _segments(q: Array, placement: Placement) -> list[tuple[str, Array, Array, float]]:
    """Each capsule as (body, start (P, 3), end (P, 3), radius) in the tool frame."""
    frames = arm.forward(q)
    stem = arm.Capsule("roller's stem", (0, 0, 0.09), (0, 0, arm.D[5] + STEM - STEM_FREE), STEM_RADIUS)
    result = []
    for c in (*arm.CAPSULES, stem):
        i = arm.LINKS.index(c.body) if c.body in arm.LINKS else 5
        ends = [placement.points_to_tool(frames.origins[i] + frames.rotations[i] @ np.array(p)) for p in (c.start, c.end)]
        result.append((c.body, ends[0], ends[1], c.radius))
    return result


def _distance(points: Array, start: Array, end: Array) -> Array:
    """From points (S, 3) to P segments: (P, S)."""
    line = end - start
    square = np.maximum(np.einsum("pi,pi->p", line, line), 1e-12)[:, None]
    away = points[None] - start[:, None]
    share = np.clip(np.einsum("psi,pi->ps", away, line) / square, 0, 1)
    return np.linalg.norm(away - share[..., None] * line[:, None], axis=-1)


def deepest_touch(q: Array, placement: Placement, cloud: Cloud) -> Touch | None:
    """The worst overlap of the arm with the part or itself over the poses (P, 6); None when it is free."""
    worst: Touch | None = None
    for first in range(0, len(q), POSES_AT_ONCE):
        for touch in _touches(_segments(q[first : first + POSES_AT_ONCE], placement), cloud):
            if touch.depth > (worst.depth if worst else SLIGHT):
                worst = touch
    return worst


def _touches(segments: list[tuple[str, Array, Array, float]], cloud: Cloud) -> list[Touch]:
    touches = []
    for body, start, end, radius in segments:
        distance = _distance(cloud.points, start, end)
        pose, point = np.unravel_index(int(distance.argmin()), distance.shape)
        touches.append(Touch(body, int(cloud.owner[point]), radius - float(distance[pose, point])))
    for body, other in SELF_PAIRS:
        for _, start, end, radius in (s for s in segments if s[0] == body):
            for _, start2, end2, radius2 in (s for s in segments if s[0] == other):
                gap = min(float(_pairwise(start + (end - start) * t, start2, end2).min()) for t in (0.0, 0.5, 1.0))
                touches.append(Touch(body, other, radius + radius2 - gap))
    return touches


def _pairwise(points: Array, start: Array, end: Array) -> Array:
    """From point p to segment p, (P,)."""
    line = end - start
    share = np.clip(np.einsum("pi,pi->p", points - start, line) / np.maximum(np.einsum("pi,pi->p", line, line), 1e-12), 0, 1)
    return np.linalg.norm(points - start - share[:, None] * line, axis=1)
