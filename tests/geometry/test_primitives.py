"""Fitting, smoothing and moving borders against shapes whose answer is known in closed form."""

import numpy as np
import pytest

from app.benches.composites import noisy
from app.geometry.cleaning import face_pairs
from app.geometry.denoise import denoised, smooth_normals
from app.geometry.fitting import CYLINDER, NORMAL_WEIGHT, PLANE, SPHERE, face_sums
from app.geometry.quadrics import CONE, QUADRIC, fit_any, fit_quadric, misfit
from app.geometry.relaxing import relaxed
from app.geometry.tool import Array, Mesh
from tests.geometry.test_regions import surface

U, V = np.meshgrid(np.linspace(0.2, 1.0, 41), np.linspace(-0.5, 0.5, 41), indexing="ij")
FLAT = np.zeros((40, 40), int)


def grid(x: Array, y: Array, z: Array) -> Mesh:
    return surface(np.stack([x, y, z], -1), FLAT)[0]


SHAPES = {
    "plane": (grid(U, V, 0.3 * U), PLANE, 0.0),
    "sphere of 2": (grid(U, V, np.sqrt(4 - U**2 - V**2)), SPHERE, 0.5),
    "cylinder of 2": (grid(U, 2 * np.sin(V), 2 * np.cos(V)), CYLINDER, 0.5),
    "groove of 2": (grid(U, 2 * np.sin(V), -2 * np.cos(V)), CYLINDER, -0.5),
    "saddle": (grid(U, V, 0.5 * (U - 0.6) * V), QUADRIC, 0.0),
}


def fitted(mesh: Mesh) -> tuple[int, float, Array, float]:
    """Kind, curvature, axis and RMS cost of the primitive of a whole mesh."""
    sums, out = face_sums(mesh.vertices, mesh.faces).sum(axis=0), np.empty(5)
    cost = fit_any(sums, NORMAL_WEIGHT, True, out)
    return int(out[0]), float(out[1]), out[2:], float(np.sqrt(cost / sums[-1]))


@pytest.mark.parametrize("name", list(SHAPES))
def test_primitives_are_told_apart(name: str) -> None:
    mesh, kind, curvature = SHAPES[name]
    found, bend, _, cost = fitted(mesh)
    assert found == kind
    assert bend == pytest.approx(curvature, rel=1e-3, abs=1e-9)
    assert cost < 1e-3


@pytest.mark.parametrize("degrees", [20, 45, 70])
def test_a_cone_has_its_axis_and_curvature(degrees: int) -> None:
    """At distance r from the axis the curvature is cos(half angle) / r; the mean of |grad f|^2 stands for r^2 averaged by area."""
    half, along = np.radians(degrees), U + 1
    mesh = grid(along * np.sin(half) * np.cos(V), along * np.sin(half) * np.sin(V), -along * np.cos(half))
    kind, bend, axis, cost = fitted(mesh)
    assert kind == CONE
    assert abs(axis[2]) == pytest.approx(1, abs=1e-4)
    square = np.average((along**2), weights=along)  # of the distance from the apex
    assert bend == pytest.approx(1 / (np.tan(half) * np.sqrt(square)), rel=0.01)
    assert cost < 1e-3


def test_a_quadric_is_found_to_the_last_digit() -> None:
    """On a sphere of radius 2 about the origin, f = (x^2 - 4) / 4 has the unit normal as its gradient: nothing is left over."""
    mesh = SHAPES["sphere of 2"][0]
    sums, q = face_sums(mesh.vertices, mesh.faces), np.zeros(10)
    fit_quadric(sums.sum(axis=0), NORMAL_WEIGHT, q)
    assert q == pytest.approx([-1, 0, 0, 0, 0.25, 0.25, 0.25, 0, 0, 0], abs=2e-3)
    exact = np.array([-1, 0, 0, 0, 0.25, 0.25, 0.25, 0, 0, 0])
    assert misfit(sums, exact, 0.0).sum() == pytest.approx(0, abs=1e-12)
    moved = exact - np.array([0.1] + [0] * 9)
    assert misfit(sums, moved, 0.0).sum() == pytest.approx(0.01 * sums[:, 0].sum())


def test_smoothing_keeps_a_crease_and_flattens_noise() -> None:
    """A roof of 90 degrees with 0.3 % of noise: the normals of both sides come back, the ridge stays where it is."""
    roof = grid(U - 0.6, V, -np.abs(U - 0.6))
    rough = noisy(roof, 3e-3, np.random.default_rng(0))
    true = np.where((roof.vertices[roof.faces][:, :, 0].mean(axis=1) > 0)[:, None], [1, 0, 1], [-1, 0, 1]) / np.sqrt(2)

    def astray(mesh: Mesh) -> float:
        a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
        cross = np.cross(b - a, c - a)
        return float(np.degrees(np.arccos(np.clip((cross * true).sum(1) / np.linalg.norm(cross, axis=1), -1, 1))).mean())

    assert astray(denoised(rough)) < astray(rough) / 3
    ridge = np.flatnonzero(np.abs(roof.vertices[:, 0]) < 1e-9)
    assert np.abs(denoised(rough).vertices[ridge, 2]).mean() < 2 * np.abs(rough.vertices[ridge, 2]).mean()


def test_smooth_normals_of_two_faces() -> None:
    """One round, areas 1 and 3, normals d apart: each becomes n_i A_i + exp(-d^2 / 2 s^2) A_j n_j, of unit length."""
    normals = np.array([[0.0, 0.0, 1.0], [0.0, 0.6, 0.8]])
    w = np.exp(-0.4 / (2 * 0.5**2))  # d^2 = 0.36 + 0.04
    expected = np.array([normals[0] + 3 * w * normals[1], 3 * normals[1] + w * normals[0]])
    expected /= np.linalg.norm(expected, axis=1)[:, None]
    assert smooth_normals(normals, np.array([1.0, 3.0]), np.array([[0, 1]]), 1, 0.5) == pytest.approx(expected)


def test_a_ragged_border_returns_to_the_crease() -> None:
    """Two planes at an angle; a band of labels beside their crease is wrong. Outside the working surface nothing changes."""
    roof = grid(U - 0.6, V, -0.3 * np.abs(U - 0.6))
    middle = roof.vertices[roof.faces].mean(axis=1)
    truth = (middle[:, 0] > 0).astype(np.int64)
    ragged = (middle[:, 0] + 0.06 * np.sign(np.sin(40 * middle[:, 1])) > 0).astype(np.int64)
    ragged[:10] = -1
    found = relaxed(ragged, face_sums(roof.vertices, roof.faces), face_pairs(roof.faces), NORMAL_WEIGHT)
    assert (found[:10] == -1).all()
    assert (ragged[10:] == truth[10:]).mean() < 0.95
    assert (found[10:] == truth[10:]).mean() > 0.99
