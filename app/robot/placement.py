"""Where to put the arm: try places around the tool and keep the one from which most of the surface can be worked."""

import numpy as np

from app.geometry.tool import Array, Tool
from app.robot import arm
from app.robot.cell import Placement, tool_length
from app.robot.clearance import Cloud, deepest_touch
from app.robot.kinematics import solve, stiffness_to_singular
from app.robot.raster import Samples

DISTANCES = (0.5, 0.62, 0.75, 0.9)  # m from the middle of the tool to the base
HEIGHTS = (-0.35, -0.15, 0.05)  # m of the base above the middle of the surface
STEP_BACK = 0.3  # m farther from a tool that is larger than the distances above
KEEP_OFF = 0.15  # m between base and the tool's box in plan view
LIFT = 0.06  # m above the surface that must be reached too
PER_REGION = 4  # samples per region
CHECKED = 3  # best candidates of each side that are checked for collisions


def candidates(tool: Tool) -> list[Placement]:
    """Places at the four sides of the part, facing it."""
    low, high = tool.mesh.vertices.min(axis=0), tool.mesh.vertices.max(axis=0)
    middle, half = (low + high) / 2, (high - low) / 2
    places = []
    for side in (0, 1, 2, 3):
        yaw = side * np.pi / 2
        away = np.array([np.cos(yaw), np.sin(yaw), 0.0]).round()
        nearest = float(half[:2] @ np.abs(away[:2])) + KEEP_OFF
        for distance in sorted({max(d, nearest) for d in (*DISTANCES, nearest + STEP_BACK)}):
            for height in HEIGHTS:
                places.append(Placement(middle * [1, 1, 0] + away * distance + [0, 0, middle[2] + height], yaw))
    return places


def posture_for(points: Array) -> Array:
    """The home posture turned towards each point (base frame): (P, 6)."""
    q = np.tile(arm.HOME, (len(points), 1))
    q[:, 0] = np.arctan2(-points[:, 1], -points[:, 0])
    return q


def choose_placement(tool: Tool, samples: list[Samples], cloud: Cloud, radius: float) -> Placement:
    """The candidate with the largest reachable share, then the fewest collisions, then the best-conditioned poses."""
    chosen = [((np.arange(PER_REGION) + 0.5) * len(s.points) / PER_REGION).astype(int) for s in samples]
    points = np.concatenate([s.points[i] for s, i in zip(samples, chosen, strict=True)])
    normals = np.concatenate([s.normals[i] for s, i in zip(samples, chosen, strict=True)])
    points, normals = np.concatenate([points, points + LIFT * normals]), np.concatenate([normals, normals])
    places, length = candidates(tool), tool_length(radius)
    local = np.concatenate([p.points_to_base(points) for p in places])
    solution = solve(local, np.concatenate([p.vectors_to_base(normals) for p in places]), posture_for(local), length, iterations=30)
    reached = solution.reached.reshape(len(places), -1)
    margin = stiffness_to_singular(solution.q, length).reshape(len(places), -1)
    score = reached.mean(axis=1) + 0.5 * np.quantile(np.where(reached, margin, 0.0), 0.1, axis=1)
    poses = solution.q.reshape(len(places), -1, 6)
    best, best_score = places[0], -np.inf
    ranked = np.argsort(-score, kind="stable").tolist()
    by_side = [[k for k in ranked if places[k].yaw == yaw][:CHECKED] for yaw in sorted({p.yaw for p in places})]
    for k in (k for side in by_side for k in side):
        touch = deepest_touch(poses[k][reached[k]][::2], places[k], cloud) if reached[k].any() else None
        total = float(score[k]) - (0.3 + min(touch.depth, 0.1) if touch else 0.0)
        if total > best_score + 1e-9:
            best, best_score = places[k], total
    return best
