"""Surfaces whose primitives are known: borders on mesh edges, vertices inside shifted about on the true surface, diagonals mixed."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.geometry.moulds import Piece
from app.geometry.tool import Array, Mesh

CORE = 1e-4  # m; the hole left at the axis, so that no triangle has a corner there
SHIFT = 0.25  # of a cell, how far inner vertices are moved along the surface


@dataclass(frozen=True)
class Composite:
    """A mesh with its true segmentation."""

    name: str
    mesh: Mesh
    truth: NDArray[np.int32]  # (F,) primitive of each face, -1 does not count
    curvature: tuple[float, ...]  # signed, 1/m, of each primitive; nan where it isn't constant (cones)
    kind: tuple[str, ...]


Surface2 = Callable[[Array, Array], Array]  # parameters (K,), (K,) -> points (K, 3)


def patch_grid(
    at: Surface2, u: Array, v: Array, band: NDArray[np.int32], fixed: NDArray[np.bool_], rng: np.random.Generator
) -> tuple[Mesh, NDArray[np.int32]]:
    """Triangles over a grid of parameters u (U,), v (V,); band (U - 1,) labels columns; `fixed` (U,) columns stay where they are."""
    uu, vv = np.meshgrid(u, v, indexing="ij")
    du, dv = np.gradient(u)[:, None], np.gradient(v)[None, :]
    inner_u, inner_v = ~fixed, np.ones(len(v), bool)
    inner_v[[0, -1]] = False
    move = SHIFT * (inner_u[:, None] & inner_v[None, :])
    uu = uu + move * du * rng.uniform(-1, 1, uu.shape)
    vv = vv + move * dv * rng.uniform(-1, 1, uu.shape)
    index = np.arange(uu.size).reshape(uu.shape)
    a, b, c, d = (x.ravel() for x in (index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]))
    other = rng.random(len(a)) < 0.5
    first = np.where(other[:, None], np.stack([a, b, c], 1), np.stack([a, b, d], 1))
    second = np.where(other[:, None], np.stack([a, c, d], 1), np.stack([b, c, d], 1))
    faces = np.stack([first, second], axis=1).reshape(-1, 3)
    return Mesh(at(uu.ravel(), vv.ravel()), faces.astype(np.int32)), np.repeat(np.repeat(band, len(v) - 1), 2).astype(np.int32)


def _curve(
    pieces: tuple[Piece, ...], steps: int, start: Array, heading: float
) -> tuple[Callable[[Array], Array], Array, NDArray[np.int32]]:
    """A profile of lines and arcs as a function of arc length, sample positions that hit every joint, and their bands."""
    lengths = np.array([p.length for p in pieces])
    ends = np.concatenate([[0], np.cumsum(lengths)])
    points, headings = [np.asarray(start, float)], [heading]
    for piece in pieces:
        points.append(points[-1] + _along(headings[-1], piece, np.array([piece.length]))[0])
        headings.append(headings[-1] + piece.turn)

    def at(s: Array) -> Array:
        k = np.clip(np.searchsorted(ends, s, side="right") - 1, 0, len(pieces) - 1)
        result = np.empty((len(s), 2))
        for i, piece in enumerate(pieces):
            result[k == i] = points[i] + _along(headings[i], piece, s[k == i] - ends[i])
        return result

    counts = np.maximum(2, np.round(steps * lengths / lengths.sum()).astype(int))
    samples = np.concatenate([np.linspace(ends[i], ends[i + 1], n + 1)[: n + (i == len(pieces) - 1)] for i, n in enumerate(counts)])
    return at, samples, np.repeat([p.band for p in pieces], counts).astype(np.int32)


def _along(heading: float, piece: Piece, s: Array) -> Array:
    turn = piece.turn * s / piece.length
    chord = s * np.sinc(turn / 2 / np.pi)
    return chord[:, None] * np.stack([np.cos(heading + turn / 2), np.sin(heading + turn / 2)], axis=1)


def _columns(at_u: Array, band: NDArray[np.int32]) -> NDArray[np.bool_]:
    fixed = np.zeros(len(at_u), bool)
    fixed[[0, -1]] = True
    fixed[1:-1] = band[1:] != band[:-1]
    return fixed


def strip(faces: int, rng: np.random.Generator) -> Composite:
    """Three planes joined smoothly by a concave and a convex cylinder: no crease marks the borders."""
    bend = np.radians(60)
    pieces = (Piece(0, 0.12), Piece(1, 0.10, bend), Piece(2, 0.10), Piece(3, 0.10, -bend), Piece(4, 0.12))
    side = max(4, int(np.sqrt(faces / 2 / 2.7)))
    curve, u, band = _curve(pieces, int(faces / 2 / side), np.zeros(2), 0.0)
    v = np.linspace(0, 0.2, side + 1)

    def at(s: Array, y: Array) -> Array:
        place = curve(s)
        return np.stack([place[:, 0], y, place[:, 1]], axis=1)

    mesh, truth = patch_grid(at, u, v, band, _columns(u, band), rng)
    return Composite("strip", mesh, truth, (0, -bend / 0.1, 0, bend / 0.1, 0), ("plane", "cylinder", "plane", "cylinder", "plane"))


def turned(faces: int, rng: np.random.Generator) -> Composite:
    """A half turned part: spherical cap, cone, cylinder, level ring, zone of a larger sphere; creases between them."""
    cap, tip, tilt, zone = 0.06, np.radians(60), np.radians(50), np.radians(25)
    radius = (CORE + cap * np.sin(tip) + 0.08 * np.cos(tilt) + 0.08) / np.sin(tilt)  # of the zone, so that its centre lies on the axis
    pieces = (Piece(0, cap * tip, -tip), Piece(1, 0.08), Piece(2, 0.10), Piece(3, 0.08), Piece(4, radius * zone, -zone))
    kinks = (0.0, tip - tilt, tilt - np.pi / 2, np.pi / 2, -tilt)
    kind = ("sphere", "cone", "cylinder", "plane", "sphere")
    outer = CORE + cap * np.sin(tip) + 0.08 * np.cos(tilt)
    return _revolved("turned", pieces, kinks, faces, rng, kind, (1 / cap, np.nan, 1 / outer, 0, 1 / radius), np.pi / 2)


def _revolved(
    name: str,
    pieces: tuple[Piece, ...],
    kinks: tuple[float, ...],
    faces: int,
    rng: np.random.Generator,
    kind: tuple[str, ...],
    curvature: tuple[float, ...],
    half: float,
) -> Composite:
    """Turn a profile with kinks before its pieces about z."""
    parts, u, band, start, heading, offset = [], [], [], np.array([CORE, 0.0]), 0.0, 0.0
    total = sum(p.length for p in pieces)
    across = max(8, int(np.sqrt(faces / 2)))
    for piece, kink in zip(pieces, kinks, strict=True):
        heading += kink
        curve, s, b = _curve((piece,), max(3, int(across * piece.length / total)), start, heading)
        parts.append((offset, curve))
        u.append(s[:-1] + offset if piece is not pieces[-1] else s + offset)
        band.append(b)
        start, heading, offset = curve(np.array([piece.length]))[0], heading + piece.turn, offset + piece.length

    def at(s: Array, angle: Array) -> Array:
        k = np.clip(np.searchsorted([o for o, _ in parts], s, side="right") - 1, 0, len(parts) - 1)
        place = np.empty((len(s), 2))
        for i, (first, curve) in enumerate(parts):
            place[k == i] = curve(s[k == i] - first)
        return np.stack([place[:, 0] * np.cos(angle), place[:, 0] * np.sin(angle), place[:, 1]], axis=1)

    uu, bands = np.concatenate(u), np.concatenate(band)
    mesh, truth = patch_grid(at, uu, np.linspace(-half, half, int(faces / 2 / (len(uu) - 1)) + 1), bands, _columns(uu, bands), rng)
    return Composite(name, mesh, truth, curvature, kind)


def noisy(mesh: Mesh, share: float, rng: np.random.Generator) -> Mesh:
    """Every vertex moved at random, standard deviation `share` of the diagonal along each axis."""
    sigma = share * np.linalg.norm(np.ptp(mesh.vertices, axis=0))
    return Mesh(mesh.vertices + sigma * rng.normal(size=mesh.vertices.shape), mesh.faces)


def rand_index(a: NDArray[np.integer], b: NDArray[np.integer], weight: Array) -> float:
    """Area-weighted adjusted Rand index (Hubert and Arabie 1985, counts replaced by areas); 1 for equal partitions."""
    a, b = (np.unique(x, return_inverse=True)[1] for x in (a, b))
    table = np.zeros((a.max() + 1, b.max() + 1))
    np.add.at(table, (a, b), weight)
    table /= table.sum()
    both, rows, columns = (table**2).sum(), (table.sum(1) ** 2).sum(), (table.sum(0) ** 2).sum()
    most = (rows + columns) / 2
    return 1.0 if most == rows * columns else float((both - rows * columns) / (most - rows * columns))


def freeform(faces: int, rng: np.random.Generator) -> Composite:
    """Four patches side by side that no plane, sphere or cylinder fits: a saddle, a bump, a twisted strip and a wave; creases between."""
    count = max(6, int(np.sqrt(faces / 2) / 2))
    u = np.linspace(0, 4, 4 * count + 1)
    band = np.repeat(np.arange(4), count).astype(np.int32)

    def at(s: Array, t: Array) -> Array:
        k = np.clip(s.astype(int), 0, 3)
        w, v = s - k, t
        lift = 4 * w * (1 - w)  # 0 on the common borders, so the patches meet
        heights = [
            0.3 * lift * (v - 0.5) ** 2 * 4,
            0.45 * lift * (1 - 0.6 * (2 * v - 1) ** 2),
            0.5 * lift * (v - 0.5),
            -0.35 * lift * (1 + 0.4 * np.sin(3 * v)),
        ]
        return np.stack([s, 2 * v, np.choose(k, heights)], axis=1) * 0.2

    mesh, truth = patch_grid(at, u, np.linspace(0, 1, int(faces / 2 / (4 * count)) + 1), band, _columns(u, band), rng)
    return Composite("freeform", mesh, truth, (np.nan,) * 4, ("freeform",) * 4)
