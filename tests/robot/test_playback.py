"""Whole runs on small tools: measured force, touch-down, path, problems named, equal bytes for equal inputs."""

import numpy as np
import pytest

from app.errors import IncompleteSequence, InvalidInput
from app.geometry.tool import Mesh
from app.robot import arm
from app.robot.cell import BODIES
from app.robot.playback import Playback, RobotParameters, playback_from_bytes, playback_to_bytes, simulate
from tests.robot.tools import block, flat, tool_from, wavy


@pytest.fixture(scope="module")
def tool():
    return block(wavy, size=(0.2, 0.16), columns=2, rows=1, cell=0.01)


@pytest.fixture(scope="module")
def told():
    return []


@pytest.fixture(scope="module")
def playback(tool, told) -> Playback:
    return simulate(tool, (1, 0), RobotParameters(), lambda share, words: told.append((share, words)))


def test_force_is_held(playback):
    for report in playback.region_reports:
        assert report.force_rms_n < 0.6
        assert 20 < report.force_max_n < 1.3 * 20  # touch-down included
    sweeping = playback.force_n[playback.force_n > 15]
    assert sweeping.mean() == pytest.approx(20, abs=0.5)
    assert 0.01 < playback.force_error_n < 0.6


def test_another_force_is_held_too(tool):
    playback = simulate(tool, (0, 1), RobotParameters(force_n=12.0))
    assert np.median(playback.force_n[playback.force_n > 8]) == pytest.approx(12, abs=0.3)
    assert max(r.force_max_n for r in playback.region_reports) < 1.3 * 12


def test_the_roller_stays_on_its_path_and_covers_the_regions(playback):
    assert [r.region for r in playback.region_reports] == [1, 0]
    for report in playback.region_reports:
        assert 0 < report.off_path_max_mm < 1
        assert report.covered > 0.95
        assert report.problems == ()
    assert playback.covered > 0.95
    assert 0.4 < playback.in_contact_share < 1


def test_time_runs_through_the_regions_in_order(playback):
    first, second = playback.region_reports
    assert 0 <= first.start_s < first.end_s <= second.start_s < second.end_s <= playback.cycle_s + 1e-6
    middle = np.searchsorted(playback.times, (second.start_s + second.end_s) / 2)
    assert playback.region_at[middle] == 0
    assert (playback.region_at == -1).any()
    assert np.diff(playback.times).max() < 0.05


def test_logged_poses_are_those_of_the_logged_joints(playback, tool):
    """The roller rides on the true surface: its centre is a radius away along the normal, less the give of the contact."""
    roller = playback.positions[:, BODIES.index("roller")].astype(float)
    touching = (playback.force_n > 15) & (playback.region_at >= 0)
    mesh = tool.mesh.vertices[tool.mesh.faces[tool.labels >= 0]].mean(axis=1)
    radius = np.abs(playback.body_meshes[BODIES.index("roller")][0]).max()
    gap = np.array([np.linalg.norm(mesh - p, axis=1).min() for p in roller[touching][::10]])
    assert np.abs(gap - radius).max() < 0.002
    frames = arm.forward(playback.joint_angles.astype(float))
    reach = np.linalg.norm(frames.origins[5] - frames.origins[0], axis=1)
    stored = playback.positions[:, BODIES.index("wrist 3")] - playback.positions[:, BODIES.index("shoulder")]
    assert np.abs(np.linalg.norm(stored, axis=1) - reach).max() < 1e-5
    assert np.abs(np.linalg.norm(playback.orientations, axis=2) - 1).max() < 1e-5


def test_progress_names_the_regions(playback, told):
    shares = [share for share, _ in told]
    assert shares == sorted(shares)
    assert shares[-1] == 1
    assert {"Planning region A", "Working region B"} <= {words for _, words in told}


def test_equal_inputs_give_equal_bytes_and_come_back(playback, tool):
    content = playback_to_bytes(playback)
    assert content == playback_to_bytes(simulate(tool, (1, 0), RobotParameters()))
    back = playback_from_bytes(content)
    assert np.array_equal(back.positions, playback.positions)
    assert back.region_reports == playback.region_reports
    assert back.bodies == playback.bodies
    assert playback_to_bytes(back) == content


def test_bytes_of_another_format_are_refused(playback, monkeypatch):
    monkeypatch.setattr("app.robot.reports.FORMAT", 2)
    content = playback_to_bytes(playback)
    monkeypatch.undo()
    with pytest.raises(InvalidInput, match="format 2"):
        playback_from_bytes(content)


def test_a_region_out_of_reach_is_named_and_the_rest_is_done():
    """Two patches 4 m apart: only one can be in reach of any base position."""
    near = block(flat, size=(0.12, 0.12), columns=1, cell=0.02)
    k = len(near.mesh.vertices)
    vertices = np.concatenate([near.mesh.vertices, near.mesh.vertices + np.array([4.0, 0, 0])])
    faces = np.concatenate([near.mesh.faces, near.mesh.faces + k]).astype(np.int32)
    labels = np.concatenate([near.labels, np.where(near.labels == 0, 1, -1)]).astype(np.int32)
    playback = simulate(tool_from(Mesh(vertices, faces), labels), (0, 1), RobotParameters())
    lost = [r for r in playback.region_reports if r.problems]
    done = [r for r in playback.region_reports if not r.problems]
    assert len(lost) + len(done) == 2
    for report in lost:
        kind, sentence = report.problems[0]
        assert kind == "reach"
        assert sentence.startswith(f"Region {'AB'[report.region]} is out of reach by ")
        assert report.covered == 0
    assert len(lost) == len(done) == 1
    for report in done:
        assert report.covered > 0.9


def test_a_missing_region_is_refused(tool):
    with pytest.raises(IncompleteSequence):
        simulate(tool, (0,), RobotParameters())


def test_a_region_too_small_for_the_roller_is_named():
    """One triangle of 5 mm beside a plain of 20 cm."""
    tool = block(flat, size=(0.2, 0.2), columns=1, cell=0.005)
    labels = tool.labels.copy()
    labels[0] = 1
    playback = simulate(tool_from(tool.mesh, labels), (1, 0), RobotParameters())
    small, large = playback.region_reports
    assert small.problems == (("reach", "Region B is too small for the roller."),)
    assert small.covered == 0
    assert large.covered > 0.95
