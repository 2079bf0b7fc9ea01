"""No measured trouble without a sentence: made-up reports on both sides of each bound, a made-up run, and a real misfit."""

from dataclasses import replace

import numpy as np
import pytest

from app.robot.assessment import measured_problems, region_report
from app.robot.control import Commands, Trace
from app.robot.parameters import RobotParameters, RollerSize
from app.robot.playback import simulate
from app.robot.program import FREE, SWEEPING, TOUCHING, RegionPlan
from app.robot.raster import Samples
from app.robot.reports import RegionReport
from tests.robot.tools import block

GOOD = RegionReport(5, 0.0, 10.0, 0.3, 21.0, 0.3, 0.99, ())
ROLLER = RollerSize(0.02, 0.03, 0.024, 0.006)
UP = np.array([0.0, 0.0, 1.0])


def said(wanted=20.0, all_reached=True, **measured):
    return measured_problems("F", replace(GOOD, **measured), wanted, all_reached)


def test_a_good_report_has_no_problem():
    assert said() == []


@pytest.mark.parametrize(
    ("measured", "kind", "sentence"),
    [
        ({"force_max_n": 38.2}, "contact", "Region F: the roller pressed with 38 N where 20 N were wanted."),
        ({"force_rms_n": 2.6}, "contact", "Region F: the force is unsteady, 2.6 N (root mean square) off the 20 N wanted."),
        (
            {"off_path_max_mm": 2.4},
            "contact",
            "Region F: the roller is pushed 2.4 mm off its path, as where it does not fit between the surfaces.",
        ),
        ({"covered": 0.897}, "coverage", "Only 89 % of region F is covered: it is narrow or strongly curved for the roller."),
    ],
)
def test_each_bad_figure_is_told_with_the_region(measured, kind, sentence):
    assert said(**measured) == [(kind, sentence)]


@pytest.mark.parametrize(
    ("name", "within", "beyond"),
    [("force_max_n", 26.9, 27.1), ("force_rms_n", 1.99, 2.01), ("off_path_max_mm", 1.99, 2.01), ("covered", 0.901, 0.899)],
)
def test_where_the_bounds_lie(name, within, beyond):
    assert said(**{name: within}) == []
    assert len(said(**{name: beyond})) == 1


def test_force_bounds_follow_the_wanted_force():
    assert said(wanted=8.0, force_max_n=10.7) == []
    assert [text for _, text in said(wanted=8.0, force_max_n=11.4)] == ["Region F: the roller pressed with 11 N where 8 N were wanted."]
    assert len(said(wanted=2.5)) == 2  # the good figures for 20 N: 21 N pressed, 0.3 N unsteady


def test_poor_coverage_is_told_of_regions_partly_out_of_reach_too():
    assert said(all_reached=False, covered=0.42) == [("coverage", "Only 42 % of region F is covered.")]


def test_several_troubles_are_all_told():
    assert len(said(force_max_n=40.0, force_rms_n=5.0, off_path_max_mm=6.0, covered=0.5)) == 4


def run_of(force, aside_mm=None):
    """Region 5 as 100 steps along 20 cm: 10 in the air, 10 touching down, 70 sweeping, 10 in the air."""
    points = np.stack([np.linspace(0, 0.2, 100), np.zeros(100), np.zeros(100)], axis=1)
    phase = np.array([FREE] * 10 + [TOUCHING] * 10 + [SWEEPING] * 70 + [FREE] * 10, np.int8)
    q, normals = np.zeros((100, 6)), np.tile(UP, (100, 1))
    wanted = np.where(phase == FREE, 0.0, 20.0)
    commands = Commands(q, q, points, normals, q, wanted, phase, np.full(100, 5, np.int32), q, q)
    tip = points + np.outer(np.zeros(100) if aside_mm is None else aside_mm, [0, 1e-3, 0])
    empty = np.zeros((0, 1, 3))
    trace = Trace(np.where(phase == FREE, 0.0, 20.0) if force is None else force, tip, np.arange(0), empty, empty, q[:0])
    middle = points[15:85]
    plan = RegionPlan(5, (), 10, 10, 0.0, 0.0)
    return region_report("F", plan, Samples(middle, np.tile(UP, (len(middle), 1))), ROLLER, commands, trace, [], 0.0)


def force_with(at, value):
    force = np.where((np.arange(100) < 10) | (np.arange(100) >= 90), 0.0, 20.0)
    force[at] = value
    return force


def test_a_steady_run_has_no_problem():
    assert run_of(None).problems == ()


@pytest.mark.parametrize("step", [3, 12, 50, 97], ids=["on the way in", "touching down", "sweeping", "on the way out"])
def test_one_hard_push_is_told_wherever_it_happens(step):
    report = run_of(force_with(step, 35.0))
    assert report.force_max_n == 35.0
    assert ("contact", "Region F: the roller pressed with 35 N where 20 N were wanted.") in report.problems


def test_lost_contact_is_told_with_its_share():
    texts = [text for _, text in run_of(force_with(slice(30, 37), 0.0)).problems]
    assert "The roller loses contact on 10 % of region F." in texts


def test_one_sideways_push_is_told():
    aside = np.zeros(100)
    aside[40] = 3.1
    assert [text for _, text in run_of(None, aside).problems] == [
        "Region F: the roller is pushed 3.1 mm off its path, as where it does not fit between the surfaces."
    ]


def test_a_region_with_a_step_in_it_is_told():
    """A wall of 12 mm across the middle of the only region: the ball of about 17 mm can't go down to its foot."""
    tool = block(lambda x, y: np.where(x > 0.001, 0.012, 0.0) + 0 * y, size=(0.16, 0.1), columns=1, cell=0.005)
    (report,) = simulate(tool, (0,), RobotParameters()).region_reports
    assert report.force_max_n > 50  # otherwise the tool is no misfit and the test says nothing
    texts = [text for _, text in report.problems]
    assert f"Region A: the roller pressed with {report.force_max_n:.0f} N where 20 N were wanted." in texts
    assert any(f"{report.force_rms_n:.1f} N (root mean square)" in text for text in texts)
    assert any(f"pushed {report.off_path_max_mm:.1f} mm off" in text for text in texts)
