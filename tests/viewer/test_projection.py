"""The camera shows the whole tool, and the projection is the one of the browser's canvas."""

import numpy as np
import pytest

from app.viewer.borders import find_lines
from app.viewer.projection import FILL_HEIGHT, FILL_WIDTH, LEAST_ASPECT, Camera, camera_for, label_points, project
from tests.viewer.fakes import sample_tool


def test_projection_of_known_points() -> None:
    """With a field of view of 90 degrees a point one to the side at depth two is a quarter of the height off the middle."""
    camera = Camera(np.array([0.0, -2, 0]), np.zeros(3), np.array([0.0, 0, 1]), np.pi / 2)
    pixels = project(np.array([[0, 0, 0], [1, 0, 0], [0, 0, 1], [0, -3, 0]]), camera, 640, 480)
    assert np.allclose(pixels[:3], [[320, 240], [440, 240], [320, 120]])
    assert np.isnan(pixels[3]).all(), "behind the camera"


@pytest.mark.parametrize("name", ["Bend 01", "Saddle 05", "Trough 06"])
@pytest.mark.parametrize(("width", "height"), [(668, 564), (506, 320), (640, 480)])
def test_tool_fills_the_canvas_and_no_more(name: str, width: int, height: int) -> None:
    tool = sample_tool(name)
    pixels = project(tool.mesh.vertices, camera_for(tool), width, height)
    assert (pixels >= 0).all()
    assert (pixels <= [width, height]).all()
    assert abs(pixels[:, 0].min() + pixels[:, 0].max() - width) < 0.02 * width


@pytest.mark.parametrize("name", ["Bend 01", "Saddle 05", "Trough 06"])
def test_tool_just_fits_the_narrowest_canvas(name: str) -> None:
    tool = sample_tool(name)
    share = np.ptp(project(tool.mesh.vertices, camera_for(tool), LEAST_ASPECT, 1.0), axis=0) / [LEAST_ASPECT * FILL_WIDTH, FILL_HEIGHT]
    assert share.max() == pytest.approx(1, abs=0.02)


def test_camera_steps_back_for_points_it_must_show_too() -> None:
    tool = sample_tool()
    corner = tool.mesh.vertices.max(0) * 4
    near, wide = camera_for(tool), camera_for(tool, corner[None])
    assert wide.distance > 1.5 * near.distance
    assert (project(corner[None], wide, 640, 480) >= 0).all()


def test_label_points_lie_on_their_regions() -> None:
    tool = sample_tool()
    for region, point in enumerate(label_points(tool)):
        corners = tool.mesh.vertices[tool.mesh.faces[tool.labels == region]]
        assert np.linalg.norm(corners.mean(axis=1) - point, axis=1).min() < 1e-12


def test_border_of_every_region_is_closed() -> None:
    """Every border point has exactly two border segments, and neighbours share theirs."""
    tool = sample_tool()
    rims = find_lines(tool, lift=0.0).rims
    for segments in rims:
        _, count = np.unique(segments.reshape(-1, 3).round(9), axis=0, return_counts=True)
        assert (count == 2).all()
    everything = find_lines(tool, lift=0.0).every
    assert len(everything) < sum(map(len, rims))


def test_lift_moves_lines_off_the_surface_outwards() -> None:
    tool = sample_tool()
    gap = find_lines(tool, lift=0.01).every - find_lines(tool, lift=0.0).every
    assert np.allclose(np.linalg.norm(gap, axis=2), 0.01)
    assert (gap[..., 2] > 0).all(), "the working surface of this mould looks up everywhere"
