"""What the assessment says about poses made up for the purpose."""

import numpy as np
import pytest

from app.robot import arm
from app.robot.assessment import planning_problems
from app.robot.cell import Placement, tool_length
from app.robot.clearance import cloud_of, deepest_touch
from app.robot.kinematics import solve
from app.robot.parameters import RollerSize
from app.robot.placement import posture_for
from app.robot.program import Pass, RegionPlan
from app.robot.raster import Stroke
from tests.robot.tools import block, flat

ROLLER = RollerSize(0.02, 0.03, 0.024, 0.006)
UP = np.array([0.0, 0.0, 1.0])


@pytest.fixture(scope="module")
def tool():
    return block(flat, size=(0.3, 0.3), columns=2, cell=0.02)


def plan_with(q, reached=10, miss=0.0, tilt=0.0):
    stroke = Stroke(np.zeros((len(q), 3)), np.tile(UP, (len(q), 1)))
    return RegionPlan(0, (Pass(stroke, q, stroke, q, stroke, q),), 10, reached, miss, tilt)


def said(tool, plan, placement):
    return planning_problems(tool, plan, None, placement, ROLLER, cloud_of(tool))


FAR_AWAY = Placement(np.array([5.0, 0.0, 0.0]), 0.0)


def test_a_joint_near_its_limit_is_named_in_degrees(tool):
    q = np.array([arm.HOME, arm.HOME])
    q[1, 4] = -arm.LIMIT[4] + np.radians(0.6)
    assert ("limit", "Region A: wrist 2 comes within 1 degree of its limit.") in said(tool, plan_with(q), FAR_AWAY)
    q[1, 4] = -arm.LIMIT[4] + np.radians(3.4)
    assert ("limit", "Region A: wrist 2 comes within 4 degrees of its limit.") in said(tool, plan_with(q), FAR_AWAY)


def test_the_home_pose_in_free_air_has_no_problem(tool):
    assert said(tool, plan_with(np.array([arm.HOME, arm.HOME])), FAR_AWAY) == []


def test_a_stretched_arm_is_singular(tool):
    q = np.tile([0.0, -0.5, 0.001, -1.0, -np.pi / 2, 0.0], (2, 1))
    kinds = [kind for kind, _ in said(tool, plan_with(q), FAR_AWAY)]
    assert "singular" in kinds


@pytest.mark.parametrize(
    ("reached", "miss", "tilt", "sentence"),
    [
        (0, 0.124, 0.0, "Region A is out of reach by 12 cm."),
        (6, 0.124, 0.0, "Region A is out of reach by 12 cm on 40 % of its strokes."),
        (6, 0.001, 0.35, "Region A can't be worked with the roller upright on the surface on 40 % of its strokes: 20 degrees short."),
        (6, 0.0, 0.0, "Region A leaves no room to approach it on 40 % of its strokes."),
    ],
)
def test_reach_is_told_in_words(tool, reached, miss, tilt, sentence):
    q = np.array([arm.HOME, arm.HOME])
    assert said(tool, plan_with(q, reached, miss, tilt), FAR_AWAY) == [("reach", sentence)]


def test_a_link_in_the_part_is_named_with_what_it_touches(tool):
    """The tip is asked to go 20 cm below the top face, from above: the stem and the wrist go through region A or B."""
    placement = Placement(np.array([0.65, 0.0, 0.0]), 0.0)
    point = placement.points_to_base(np.array([[0.05, 0.0, -0.2]]))
    q = solve(point, UP[None], posture_for(point), tool_length(0.02)).q
    touch = deepest_touch(q, placement, cloud_of(tool))
    assert touch is not None
    assert touch.body in {"wrist 2", "wrist 3", "wrist 1", "forearm"}
    assert touch.depth > 0.02
    kind, sentence = said(tool, plan_with(np.repeat(q, 2, axis=0)), placement)[-1]
    assert kind == "collision"
    assert " would touch region " in sentence
    assert sentence.endswith(f"while working region A, by {1000 * touch.depth:.0f} mm.")


def test_the_same_pose_above_the_part_is_free(tool):
    placement = Placement(np.array([0.65, 0.0, 0.0]), 0.0)
    top = tool.mesh.vertices[:, 2].max()
    point = placement.points_to_base(np.array([[0.05, 0.0, top]]))
    q = solve(point, UP[None], posture_for(point), tool_length(0.02)).q
    assert deepest_touch(q, placement, cloud_of(tool)) is None
