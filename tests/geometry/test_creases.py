"""Vertices apart along sharp edges and borders, and nowhere else."""

import numpy as np
import trimesh

from app.geometry.creases import creased
from app.geometry.tool import Mesh


def used(mesh: Mesh) -> int:
    """Number of vertices that belong to a triangle."""
    return len(np.unique(mesh.faces))


def as_mesh(shape: trimesh.Trimesh) -> Mesh:
    return Mesh(np.array(shape.vertices, float), np.array(shape.faces, np.int32))


def test_a_box_has_four_vertices_a_side() -> None:
    box = as_mesh(trimesh.creation.box((1, 2, 3)))
    split = creased(box, np.zeros(12, np.int32))
    assert used(split) == 24
    np.testing.assert_array_equal(split.vertices[split.faces], box.vertices[box.faces])


def test_a_smooth_shape_stays_whole_inside_a_region() -> None:
    """A sphere in one region isn't cut; in two it is along the border alone, which both halves share."""
    ball = as_mesh(trimesh.creation.icosphere(subdivisions=3))
    assert used(creased(ball, np.zeros(len(ball.faces), np.int32))) == len(ball.vertices)
    upper = (ball.vertices[ball.faces].mean(axis=1)[:, 2] > 0).astype(np.int32)
    split = creased(ball, upper)
    shared = np.intersect1d(ball.faces[upper == 0], ball.faces[upper == 1])
    assert len(np.intersect1d(split.faces[upper == 0], split.faces[upper == 1])) == 0
    assert used(split) == len(ball.vertices) + len(shared)


def test_a_cylinder_is_cut_along_its_rims() -> None:
    """48 sides of 7.5 degrees are smooth, the caps are not."""
    rod = as_mesh(trimesh.creation.cylinder(radius=1, height=2, sections=48))
    assert used(creased(rod, np.zeros(len(rod.faces), np.int32))) == len(rod.vertices) + 2 * 48


def test_loose_triangles_and_three_at_an_edge_are_no_trouble() -> None:
    """Three triangles on one edge: none of them is the other's continuation."""
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1.0]])
    fan = Mesh(vertices, np.array([[0, 1, 2], [1, 0, 3], [0, 1, 4]], np.int32))
    split = creased(fan, np.zeros(3, np.int32))
    assert used(split) == 9
    assert used(creased(Mesh(vertices, fan.faces[:1]), np.zeros(1, np.int32))) == 3
