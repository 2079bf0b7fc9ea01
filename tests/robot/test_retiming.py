"""Sampled motions keep their limits and rest at both ends."""

import numpy as np

from app.robot import arm
from app.robot.retiming import SPEED_SHARE, retime, transfer

DT = 0.002


def zigzag():
    """A tip path with corners and joints that follow it."""
    u = np.linspace(0, 1, 120)
    points = np.stack([0.3 * u, 0.05 * np.abs((6 * u) % 2 - 1), 0 * u], axis=1)
    q = np.stack([2 * points[:, 0], -points[:, 1] * 3, points[:, 0] + points[:, 1], *np.zeros((3, len(u)))], axis=1)
    return q, points, np.tile([0.0, 0.0, 1.0], (len(u), 1))


def test_tip_and_joints_keep_their_speeds():
    timed = retime(*zigzag(), 0.1, DT)
    tip = np.linalg.norm(np.diff(timed.points, axis=0), axis=1) / DT
    assert tip.max() < 0.1 * 1.03
    assert np.quantile(tip, 0.9) > 0.07
    assert (np.abs(np.diff(timed.q, axis=0)) / DT / arm.SPEED).max() < SPEED_SHARE * 1.02


def test_a_slow_joint_slows_the_tip():
    q, points, normals = zigzag()
    timed = retime(q * 30, points, normals, 0.1, DT)
    assert (np.abs(np.diff(timed.q, axis=0)) / DT / arm.SPEED).max() < 1.0
    assert len(timed.q) > 3 * len(retime(q, points, normals, 0.1, DT).q)


def test_rest_at_both_ends_and_all_waypoints_passed():
    q, points, normals = zigzag()
    timed = retime(q, points, normals, 0.1, DT)
    assert np.abs(timed.q[0] - q[0]).max() < 1e-9
    assert np.abs(timed.q[-1] - q[-1]).max() < 1e-9
    speed = np.linalg.norm(np.diff(timed.points, axis=0), axis=1) / DT
    assert max(speed[0], speed[-1]) < 0.01
    nearest = np.linalg.norm(points[:, None] - timed.points[None], axis=2).min(axis=1)
    assert nearest.max() < 5e-4


def test_repeated_waypoints_do_no_harm():
    q, points, normals = (np.repeat(a, 2, axis=0) for a in zigzag())
    assert np.isfinite(retime(q, points, normals, 0.1, DT).q).all()


def test_transfer_is_smooth_and_keeps_the_speed():
    q = transfer(np.zeros(6), np.array([1.0, -0.5, 0.2, 0, 0, 2.0]), 0.4, 0.3, DT)
    speed = np.diff(q, axis=0) / DT
    assert (np.abs(speed) <= arm.SPEED).all()
    assert np.abs(speed[[0, -1]]).max() < 0.01
    assert len(q) * DT >= 1.875 * 0.4 / 0.3
