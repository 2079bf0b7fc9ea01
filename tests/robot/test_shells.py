"""Convex cells stay close to the surface they stand for."""

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from app.robot.raster import draw_samples, patch_of
from app.robot.shells import cells_of
from tests.robot.tools import block, flat, wavy


def trough(x, y):
    """A concave cylinder of 60 mm radius."""
    return 0.06 - np.sqrt(0.06**2 - np.minimum(np.abs(x), 0.05) ** 2) + 0 * y


@pytest.mark.parametrize("height", [flat, wavy, trough])
def test_hulls_neither_bridge_nor_miss_the_surface(height):
    tool = block(height, size=(0.1, 0.1), columns=1)
    patch = patch_of(tool.mesh, tool.labels, 0)
    hulls = [ConvexHull(c).equations for c in cells_of(patch)]
    samples = draw_samples(patch, 0.02)
    above = np.stack([(samples.points @ e[:, :3].T + e[:, 3]).max(axis=1) for e in hulls]).min(axis=0)
    assert above.max() < 1e-4  # every surface point lies on or in a cell
    lifted = samples.points + 2e-4 * samples.normals
    inside = np.stack([(lifted @ e[:, :3].T + e[:, 3]).max(axis=1) for e in hulls]).min(axis=0)
    assert inside.min() > -1e-4  # nothing 0.3 mm above the surface is inside a cell


def test_a_flat_patch_needs_few_cells():
    tool = block(flat, size=(0.1, 0.1), columns=1)
    patch = patch_of(tool.mesh, tool.labels, 0)
    assert len(list(cells_of(patch))) <= 8
