"""The sample moulds against what they are built from: closed solids, connected regions, true radii."""

import numpy as np
import pytest
import trimesh

from app.geometry.moulds import Mould, Piece, arc, sample_moulds, trace

MOULDS = sample_moulds()


def named(name: str) -> Mould:
    return next(m for m in MOULDS if m.name.startswith(name))


def region_points(mould: Mould, region: int) -> np.ndarray:
    return mould.mesh.vertices[np.unique(mould.mesh.faces[mould.labels == region])]


def test_six_teach_and_four_are_held_back():
    assert [m.split for m in MOULDS].count("train") == 6
    assert [m.split for m in MOULDS].count("test") == 4


@pytest.mark.parametrize("mould", MOULDS, ids=lambda m: m.name)
def test_solid_is_closed_and_faces_outward(mould: Mould):
    part = trimesh.Trimesh(mould.mesh.vertices, mould.mesh.faces, process=False)
    assert part.is_watertight
    assert part.is_winding_consistent
    assert part.volume > 1e-3  # inside-out solids have a negative volume
    assert part.bounds[0, 2] == pytest.approx(0, abs=1e-12)


@pytest.mark.parametrize("mould", MOULDS, ids=lambda m: m.name)
def test_regions_are_connected_and_look_up(mould: Mould):
    n = int(mould.labels.max()) + 1
    assert 6 <= n <= 14
    part = trimesh.Trimesh(mould.mesh.vertices, mould.mesh.faces, process=False)
    for region in range(n):
        faces = np.flatnonzero(mould.labels == region)
        pairs = part.face_adjacency[np.isin(part.face_adjacency, faces).all(1)]
        assert len(trimesh.graph.connected_components(pairs, nodes=faces)) == 1
        assert (part.face_normals[faces][:, 2] > 0.2).all()


def test_dome_lies_on_a_sphere():
    top = named("Dome").mesh.vertices[np.unique(named("Dome").mesh.faces[named("Dome").labels >= 0])]
    corner = top[np.argmax(top[:, 0] + top[:, 1])]
    centre = np.array([0, 0, corner[2] - np.sqrt(0.36**2 - corner[0] ** 2 - corner[1] ** 2)])
    assert np.allclose(np.linalg.norm(top - centre, axis=1), 0.36, atol=1e-12)


def test_dish_bottom_is_a_ball_and_meets_the_plate_smoothly():
    mould = named("Dish")
    bottom = region_points(mould, 0)
    centre = np.array([0, 0, bottom[:, 2].min() + 0.20])
    assert np.allclose(np.linalg.norm(bottom - centre, axis=1), 0.20, atol=1e-12)
    part = trimesh.Trimesh(mould.mesh.vertices, mould.mesh.faces, process=False)
    inside = (mould.labels[part.face_adjacency] >= 0).all(1)
    assert np.degrees(part.face_adjacency_angles[inside].max()) < 20  # no crease between ball, fillet and plate


def test_arc_has_the_asked_radius_and_is_level_at_both_ends():
    curve = arc(0.4, 3, np.radians(-85)).points
    radius = 0.4 / np.radians(85)
    assert np.allclose(np.linalg.norm(curve - [0, curve[:, 1].max() - radius], axis=1), radius, atol=1e-3)
    assert curve[0, 1] == pytest.approx(curve[-1, 1], abs=1e-12)


def test_trace_turns_by_the_angle_it_was_given():
    points = trace((Piece(0, 0.1), Piece(0, 0.2, np.radians(90)), Piece(0, 0.1))).points
    last = points[-1] - points[-2]
    assert np.degrees(np.arctan2(last[1], last[0])) == pytest.approx(90)
