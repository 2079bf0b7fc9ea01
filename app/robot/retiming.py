"""Time along a joint path: a forward and a backward pass over arc length with a cap on the speed of the tool tip."""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline, PchipInterpolator

from app.geometry.tool import Array
from app.robot import arm

BEND = 3.0  # rad/s^2 of joint acceleration that the curvature of the path may use
TIP_ACCELERATION = 0.6  # m/s^2 along the path
TURN_RATE = 1.5  # rad/s at which the tool axis may follow a bend of the surface
SPEED_SHARE = 0.8  # of the joint speed limits
START_SPEED = 1e-3  # m/s: rest, without dividing by zero
KNOTS_PER_WAYPOINT = 6


@dataclass(frozen=True)
class Timed:
    """A motion from rest to rest, sampled at a fixed step. K samples."""

    q: Array  # (K, 6) rad
    points: Array  # (K, 3) metres, of the tip
    normals: Array  # (K, 3) unit


def retime(q: Array, points: Array, normals: Array, tip_speed: float, dt: float) -> Timed:
    """The fastest motion along the waypoints that keeps joint speed, joint bend and tip speed.

    The path is a cubic spline over the tip's arc length, so ds/dt is the tip speed.
    """
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    keep = np.concatenate([[True], np.diff(length) > 1e-6])
    if keep.sum() < 2:
        return Timed(q[:1], points[:1], normals[:1])
    length, q, points, normals = length[keep], q[keep], points[keep], normals[keep]
    joints = CubicSpline(length, q, bc_type="natural")
    s = np.linspace(0, length[-1], max(50, KNOTS_PER_WAYPOINT * len(length)))
    turning = CubicSpline(length, normals, bc_type="natural")
    caps = np.minimum(_caps(joints, s, tip_speed), TURN_RATE / np.maximum(np.linalg.norm(turning(s, 1), axis=1), 1e-9))
    speed = _passes(np.maximum(caps, START_SPEED), s[1] - s[0])
    when = np.concatenate([[0.0], np.cumsum(2 * np.diff(s) / (speed[1:] + speed[:-1]))])
    # a linear s(t) would show jumps of acceleration that are not in the plan
    at = PchipInterpolator(when, s)(np.arange(0, when[-1] + dt, dt).clip(max=when[-1]))
    at = np.clip(at, 0, length[-1])
    turned = turning(at)
    return Timed(joints(at), CubicSpline(length, points, bc_type="natural")(at), turned / np.linalg.norm(turned, axis=1, keepdims=True))


def _caps(joints: CubicSpline, s: Array, tip_speed: float) -> Array:
    """Highest speed at each arc length by the joint speeds, the path's bends and the tip."""
    slope, bend = np.abs(joints(s, 1)), np.abs(joints(s, 2))
    by_joint = (SPEED_SHARE * arm.SPEED / np.maximum(slope, 1e-9)).min(axis=1)
    by_bend = np.sqrt((BEND / np.maximum(bend, 1e-9)).min(axis=1))
    speed = np.minimum(np.minimum(by_joint, by_bend), tip_speed)
    speed[[0, -1]] = START_SPEED
    return np.maximum(speed, START_SPEED)


def _passes(speed: Array, ds: float) -> Array:
    """Lower the speed until it can be reached from and brought to the neighbours' with the tangential acceleration."""
    squared = speed**2
    gain = 2 * TIP_ACCELERATION * ds
    for k in range(1, len(squared)):
        squared[k] = min(squared[k], squared[k - 1] + gain)
    for k in range(len(squared) - 2, -1, -1):
        squared[k] = min(squared[k], squared[k + 1] + gain)
    return np.sqrt(squared)


def transfer(start: Array, end: Array, tip_distance: float, tip_speed: float, dt: float) -> Array:
    """Joint motion from rest to rest (K, 6), a quintic in time: no jump of acceleration."""
    peak = 1.875  # highest speed of the quintic over its mean
    seconds = max(0.5, float((np.abs(end - start) * peak / (0.6 * arm.SPEED)).max()), peak * tip_distance / tip_speed)
    u = np.linspace(0, 1, int(np.ceil(seconds / dt)) + 1)[:, None]
    return start + (end - start) * (10 * u**3 - 15 * u**4 + 6 * u**5)
