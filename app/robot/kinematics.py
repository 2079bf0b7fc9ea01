"""Inverse kinematics with five constrained degrees of freedom: the tip on a point, its axis against the normal, spin free."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.geometry.tool import Array
from app.robot import arm

TILT_WEIGHT = 0.2  # m per rad: makes the two tilt rows comparable with the position rows
CLOSE_M, CLOSE_RAD = 1e-7, 1e-6
GOOD_M, GOOD_RAD = 1e-5, 1e-4
LONGEST_STEP = 0.3  # rad per iteration
SETTLED = 1e-7  # rad of the last update below which a target counts as decided


@dataclass(frozen=True)
class Solution:
    """Joint angles for P targets and what is left of the errors."""

    q: Array  # (P, 6) rad
    miss_m: Array  # (P,) from the point
    tilt_rad: Array  # (P,) between the tool axis and the inward normal

    @property
    def reached(self) -> NDArray[np.bool_]:
        return (self.miss_m < GOOD_M) & (self.tilt_rad < GOOD_RAD)


def solve(points: Array, normals: Array, start: Array, length: float, posture: Array | None = None, iterations: int = 60) -> Solution:
    """Damped least squares from `start`, with a pull towards `posture` in the null space (the spin about the tool axis).

    Args:
        points: Targets of the tip in the base frame, shape (P, 3), metres.
        normals: Outward surface normals, shape (P, 3); the tool's z is turned against them.
        start: Joint angles to begin at, shape (P, 6).
        length: Of the tool beyond the flange, metres.
        posture: Preferred joint angles, shape (P, 6) or (6,); none in the null space when absent.

    Returns:
        The best joint angles within the limits; targets out of reach keep an error.
    """
    q, damping = start.copy(), 1e-5
    active = np.arange(len(q))
    for _ in range(iterations):
        frames = arm.forward(q[active])
        error, jacobian, miss, tilt = _errors(frames, points[active], normals[active], length)
        going = (miss > CLOSE_M) | (tilt > CLOSE_RAD)
        if not going.any():
            break
        active, error, jacobian = active[going], error[going], jacobian[going]
        size = np.linalg.norm(error, axis=1)
        gram = jacobian @ jacobian.transpose(0, 2, 1) + (damping * np.minimum(1, size * 10) + 1e-10)[:, None, None] * np.eye(5)
        step = (jacobian.transpose(0, 2, 1) @ np.linalg.solve(gram, error[:, :, None]))[:, :, 0]
        if posture is not None:
            pull = 0.1 * (np.broadcast_to(posture, q.shape)[active] - q[active]) * np.minimum(1, size * 100)[:, None]
            taken = np.linalg.solve(gram, jacobian @ pull[:, :, None])
            step = step + pull - (jacobian.transpose(0, 2, 1) @ taken)[:, :, 0]
        q[active] = np.clip(q[active] + np.clip(step, -LONGEST_STEP, LONGEST_STEP), -arm.LIMIT, arm.LIMIT)
    _, _, miss, tilt = _errors(arm.forward(q), points, normals, length)
    return Solution(q, miss, tilt)


def _errors(frames: arm.Frames, points: Array, normals: Array, length: float) -> tuple[Array, Array, Array, Array]:
    """Weighted error (P, 5) and its Jacobian (P, 5, 6); position and tilt errors (P,)."""
    rotation = frames.rotations[5]
    move = points - arm.tip(frames, length)
    axis = rotation[:, :, 2]
    turn = arm.cross(axis, -normals)
    cosine = -np.einsum("pi,pi->p", axis, normals)
    sine = np.linalg.norm(turn, axis=1)
    tilt = np.arctan2(sine, cosine)
    turn = turn * (tilt / np.maximum(sine, 1e-12))[:, None]
    linear, angular = arm.jacobian(frames, length)
    across = rotation[:, :, :2].transpose(0, 2, 1)
    error = np.concatenate([move, TILT_WEIGHT * np.einsum("pij,pj->pi", across, turn)], axis=1)
    return error, np.concatenate([linear, TILT_WEIGHT * across @ angular], axis=1), np.linalg.norm(move, axis=1), tilt


def follow(points: Array, normals: Array, start: Array, length: float, posture: Array) -> Solution:
    """Joint angles along a path, each waypoint solved from the one before; waypoints that fail do not move the start."""
    q, miss, tilt = np.empty((len(points), 6)), np.empty(len(points)), np.empty(len(points))
    here = start
    for i in range(len(points)):
        one = solve(points[i : i + 1], normals[i : i + 1], here[None], length, posture, iterations=25)
        q[i], miss[i], tilt[i] = one.q[0], one.miss_m[0], one.tilt_rad[0]
        if one.reached[0]:
            here = one.q[0]
    return Solution(q, miss, tilt)


def stiffness_to_singular(q: Array, length: float) -> Array:
    """Smallest singular value of the five-row Jacobian per arm, (P,); 0 where a direction is lost."""
    frames = arm.forward(q)
    linear, angular = arm.jacobian(frames, length)
    rows = np.concatenate([linear, TILT_WEIGHT * frames.rotations[5][:, :, :2].transpose(0, 2, 1) @ angular], axis=1)
    return np.asarray(np.linalg.svd(rows, compute_uv=False)[:, -1], np.float64)
