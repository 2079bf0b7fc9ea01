"""The arm against Denavit-Hartenberg by hand, its limits in the compiled model, and what is drawn."""

import mujoco
import numpy as np
import pytest

from app.robot import arm
from app.robot.cell import BODIES, STEM, Placement, body_meshes, build_cell, tool_length
from app.robot.kinematics import solve
from app.robot.placement import posture_for

PLACE = Placement(np.array([0.6, -0.1, -0.2]), 0.7)


def dh_flange(q):
    """Pose of the flange by multiplying the textbook matrices."""
    pose = np.eye(4)
    for angle, a, d, alpha in zip(q, arm.A, arm.D, arm.ALPHA, strict=True):
        ct, st, ca, sa = np.cos(angle), np.sin(angle), np.cos(alpha), np.sin(alpha)
        pose = pose @ np.array([[ct, -st * ca, st * sa, a * ct], [st, ct * ca, -ct * sa, a * st], [0, sa, ca, d], [0, 0, 0, 1]])
    return pose


@pytest.fixture(scope="module")
def model():
    return build_cell(PLACE, [], 0.02, 5000.0, 0.002)


def test_forward_kinematics_follow_dh():
    q = np.random.default_rng(0).uniform(-3, 3, (40, 6))
    frames = arm.forward(q)
    tips = arm.tip(frames, 0.17)
    for k in range(len(q)):
        pose = dh_flange(q[k])
        assert np.abs(tips[k] - (pose[:3, 3] + pose[:3, 2] * 0.17)).max() < 1e-12
        assert np.abs(frames.rotations[5, k, :, 2] - pose[:3, 2]).max() < 1e-12


def test_model_has_the_same_kinematics(model):
    data = mujoco.MjData(model)
    for q in np.random.default_rng(1).uniform(-2, 2, (5, 6)):
        data.qpos[:6] = q
        mujoco.mj_kinematics(model, data)
        expected = PLACE.points_to_tool(arm.tip(arm.forward(q[None]), tool_length(0.02)))[0]
        assert np.abs(data.site("tcp").xpos - expected).max() < 1e-12


def test_jacobian_is_the_derivative():
    q = np.random.default_rng(2).uniform(-2, 2, (1, 6))
    linear, _ = arm.jacobian(arm.forward(q), 0.2)
    for j in range(6):
        step = np.zeros((1, 6))
        step[0, j] = 1e-6
        slope = (arm.tip(arm.forward(q + step), 0.2) - arm.tip(arm.forward(q - step), 0.2))[0] / 2e-6
        assert np.abs(linear[0, :, j] - slope).max() < 1e-8


def test_limits_are_radians(model):
    """Degrees would make +-2 pi a range of +-0.11 rad."""
    assert np.allclose(model.jnt_range[:6, 1], arm.LIMIT)
    assert np.allclose(model.jnt_range[:6, 0], -arm.LIMIT)
    assert model.opt.jacobian == mujoco.mjtJacobian.mjJAC_DENSE


def test_inverse_kinematics_reach_points_and_normals():
    rng = np.random.default_rng(3)
    points = np.stack([rng.uniform(-0.8, -0.5, 50), rng.uniform(-0.25, 0.25, 50), rng.uniform(0.0, 0.2, 50)], axis=1)
    normals = np.stack([rng.uniform(-0.5, 0.5, 50), rng.uniform(-0.5, 0.5, 50), np.ones(50)], axis=1)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    solution = solve(points, normals, posture_for(points), 0.17)
    frames = arm.forward(solution.q)
    assert solution.reached.all()
    assert np.linalg.norm(arm.tip(frames, 0.17) - points, axis=1).max() < 1e-5
    assert np.abs(frames.rotations[5][:, :, 2] + normals).max() < 1e-4


def test_inverse_kinematics_tell_what_is_out_of_reach():
    """1.8 m away: the arm of 1.3 m plus tool can't be there, and the miss is no less than the geometry says."""
    point, up = np.array([[-1.8, 0.0, 0.1]]), np.array([[0.0, 0.0, 1.0]])
    solution = solve(point, up, posture_for(point), 0.17)
    assert not solution.reached[0]
    assert 0.3 < solution.miss_m[0] < 1.8
    assert (np.abs(solution.q) <= arm.LIMIT).all()


def test_drawn_bodies_are_light_and_where_the_physics_has_them(model):
    meshes = body_meshes(0.02)
    assert len(meshes) == len(BODIES)
    assert sum(len(faces) for _, faces in meshes) < 3000
    roller = meshes[BODIES.index("roller")][0]
    assert np.abs(np.linalg.norm(roller, axis=1) - 0.02).max() < 1e-6
    stem = meshes[BODIES.index("carriage")][0]
    assert stem[:, 2].max() == pytest.approx(STEM)
    upper = meshes[BODIES.index("upper arm")][0]
    assert upper[:, 0].min() == pytest.approx(arm.A[1] - 0.06, abs=1e-6)
