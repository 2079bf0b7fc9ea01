"""Strokes on analytic patches: on the surface, inside the region, covering it, also around a hole."""

import numpy as np
import pytest

from app.robot.parameters import RollerSize
from app.robot.raster import coverage, draw_samples, patch_of
from app.robot.routes import runs_over
from tests.robot.tools import block, flat, wavy, with_hole

ROLLER = RollerSize(radius=0.02, width=0.03, spacing=0.024, step=0.006)
TOOLS = {
    "flat": lambda: block(flat, columns=1),
    "curved": lambda: block(wavy, columns=1),
    "hole": lambda: with_hole(block(flat, columns=1), 0.045),
    "curved hole": lambda: with_hole(block(wavy, columns=1), 0.045),
}


def routed(name):
    tool = TOOLS[name]()
    patch = patch_of(tool.mesh, tool.labels, 0)
    return tool, patch, runs_over(patch, ROLLER)


@pytest.mark.parametrize("name", TOOLS)
def test_coverage(name):
    _, patch, runs = routed(name)
    points, normals = (np.concatenate([getattr(r, f) for r in runs]) for f in ("points", "normals"))
    samples = draw_samples(patch, ROLLER.width)
    assert coverage(samples, points, normals, ROLLER.width) >= 0.95
    assert coverage(samples, points, -normals, ROLLER.width) == 0  # a roller behind the surface covers nothing
    assert coverage(samples, points, normals, ROLLER.width / 4) < 0.5


@pytest.mark.parametrize("name", TOOLS)
def test_waypoints_lie_on_the_surface_and_in_the_region(name):
    _, patch, runs = routed(name)
    points = np.concatenate([r.points for r in runs])
    height = wavy if "curved" in name else flat
    shift = patch.vertices[0, 2] - height(*patch.vertices[0, :2])
    assert np.abs(points[:, 2] - height(points[:, 0], points[:, 1]) - shift).max() < 5e-4
    assert np.abs(points[:, :2]).max() < 0.1
    if "hole" in name:
        assert np.linalg.norm(points[:, :2], axis=1).min() > 0.04


def test_a_hole_lifts_the_roller_and_a_plain_patch_does_not():
    assert len(routed("flat")[2]) == 1
    assert len(routed("curved")[2]) == 1
    assert len(routed("hole")[2]) > 1


def test_normals_are_the_surface_normals():
    _, _, runs = routed("curved")
    points, normals = (np.concatenate([getattr(r, f) for r in runs]) for f in ("points", "normals"))
    h = 1e-6
    x, y = points[:, 0], points[:, 1]
    slope = (wavy(x + h, y) - wavy(x - h, y)) / (2 * h), (wavy(x, y + h) - wavy(x, y - h)) / (2 * h)
    exact = np.stack([-slope[0], -slope[1], np.ones(len(points))], axis=1)
    exact /= np.linalg.norm(exact, axis=1, keepdims=True)
    angle = np.degrees(np.arccos(np.clip(np.einsum("ij,ij->i", exact, normals), -1, 1)))
    assert angle.mean() < 0.3
    assert angle.max() < 2.0


def test_spacing_follows_the_roller():
    tool, patch, runs = routed("flat")
    wide = RollerSize(0.02, 0.06, 0.048, 0.006)
    length = [sum(np.linalg.norm(np.diff(r.points, axis=0), axis=1).sum() for r in some) for some in (runs, runs_over(patch, wide))]
    assert length[0] == pytest.approx(tool.regions[0].area / ROLLER.spacing, rel=0.15)
    assert length[1] < 0.65 * length[0]
