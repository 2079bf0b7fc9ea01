"""Shortest lines against closed forms: straight on a plane, a helix on a cylinder, a great circle on a sphere."""

from collections.abc import Callable

import numpy as np
import pytest

from app.geometry.geodesic import shortest_line
from app.geometry.tool import Array, Mesh


def sheet(n: int, shape: Callable[[Array, Array], Array]) -> Mesh:
    """n x n vertices over the unit square."""
    u = np.linspace(0, 1, n)
    x, y = np.meshgrid(u, u, indexing="ij")
    i = np.arange(n * n).reshape(n, n)
    a, b, c, d = i[:-1, :-1].ravel(), i[1:, :-1].ravel(), i[1:, 1:].ravel(), i[:-1, 1:].ravel()
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return Mesh(shape(x.ravel(), y.ravel()), faces.astype(np.int32))


def flat(x: Array, y: Array) -> Array:
    return np.stack([x, y, 0 * x], axis=1)


def cylinder(x: Array, y: Array) -> Array:
    return np.stack([np.cos(2 * x), y, np.sin(2 * x)], axis=1)


def sphere(x: Array, y: Array) -> Array:
    return np.stack([np.cos(2 * x) * np.cos(y - 0.5), np.sin(2 * x) * np.cos(y - 0.5), np.sin(y - 0.5)], axis=1)


def straight(p: Array, q: Array) -> float:
    return float(np.linalg.norm(p - q))


def helix(p: Array, q: Array) -> float:
    return float(np.hypot(np.arctan2(p[2], p[0]) - np.arctan2(q[2], q[0]), p[1] - q[1]))


def great_circle(p: Array, q: Array) -> float:
    return float(np.arccos(p @ q))


@pytest.mark.parametrize(("shape", "true"), [(flat, straight), (cylinder, helix), (sphere, great_circle)])
@pytest.mark.parametrize("n", [24, 60])
@pytest.mark.parametrize(("start", "goal"), [((0.1, 0.1), (0.93, 0.37)), ((0.0, 0.9), (1.0, 0.2)), ((0.5, 0.05), (0.6, 0.95))])
def test_length_of_the_shortest_line(
    shape: Callable[[Array, Array], Array],
    true: Callable[[Array, Array], float],
    n: int,
    start: tuple[float, float],
    goal: tuple[float, float],
) -> None:
    """Within 1 % of the smooth surface's (a path along edges is 5 % longer), and never through the air."""
    mesh = sheet(n, shape)
    s, g = (int(p[0] * (n - 1)) * n + int(p[1] * (n - 1)) for p in (start, goal))
    line = shortest_line(mesh, np.arange(len(mesh.faces)), s, g)
    assert line is not None
    assert line.length == pytest.approx(true(mesh.vertices[s], mesh.vertices[g]), rel=0.01)
    assert (line.ends[0] == s).all()
    assert (line.ends[-1] == g).all()
    sides = np.sort(mesh.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    edges = {tuple(e) for e in sides.tolist()}
    assert all(a == b or (min(a, b), max(a, b)) in edges for a, b in line.ends.tolist())


def test_way_to_the_border_is_the_shortest_one() -> None:
    mesh = sheet(21, flat)
    line = shortest_line(mesh, np.arange(len(mesh.faces)), 3 * 21 + 9, None)
    assert line is not None
    assert line.length == pytest.approx(0.15)
    assert np.allclose(line.points[-1], [0, 0.45, 0], atol=1e-3)


def test_no_way_between_separate_pieces() -> None:
    mesh = sheet(11, flat)
    left = np.flatnonzero(mesh.vertices[mesh.faces][:, :, 0].max(axis=1) < 0.35)
    right = np.flatnonzero(mesh.vertices[mesh.faces][:, :, 0].min(axis=1) > 0.65)
    assert shortest_line(mesh, np.concatenate([left, right]), 0, 10 * 11) is None
