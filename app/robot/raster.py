"""Strokes over a region: slicing planes on the mesh, chained into curves, so that holes and several loops stay apart."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from app.geometry.tool import Array, Mesh

FOLD = np.cos(np.radians(30))  # a sample is covered only by a roller that faces it
SAMPLES_PER_TRACK = 12  # area samples per square of the roller's width, at least SAMPLES_LEAST per region
SAMPLES_LEAST, SAMPLES_MOST = 400, 6000


@dataclass(frozen=True)
class Patch:
    """The triangles of one region, with normals taken from the whole working surface."""

    triangles: Array  # (F, 3, 3) metres
    corners: NDArray[np.int64]  # (F, 3) vertex numbers within the patch
    vertices: Array  # (V, 3)
    vertex_normals: Array  # (V, 3) unit
    normals: Array  # (F, 3) unit
    areas: Array  # (F,) m^2


@dataclass(frozen=True)
class Stroke:
    """Waypoints on the surface."""

    points: Array  # (K, 3) metres
    normals: Array  # (K, 3) unit, outward


@dataclass(frozen=True)
class Samples:
    """Evenly drawn points of a patch, for coverage and for finding the surface again."""

    points: Array  # (S, 3)
    normals: Array  # (S, 3) of the triangles


def patch_of(mesh: Mesh, labels: NDArray[np.int32], region: int) -> Patch:
    """The region as a patch; vertex normals are averaged over the region's own faces, weighted by area."""
    faces = mesh.faces[labels == region]
    used, corners = np.unique(faces, return_inverse=True)
    corners = corners.reshape(-1, 3)
    vertices = mesh.vertices[used]
    triangles = vertices[corners]
    cross = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    double = np.linalg.norm(cross, axis=1)
    keep = double > 1e-14
    triangles, corners, cross, double = triangles[keep], corners[keep], cross[keep], double[keep]
    summed = np.zeros_like(vertices)
    np.add.at(summed, corners, cross[:, None, :])
    unit = summed / np.maximum(np.linalg.norm(summed, axis=1), 1e-18)[:, None]
    return Patch(triangles, corners, vertices, unit, cross / double[:, None], double / 2)


def draw_samples(patch: Patch, width: float) -> Samples:
    """Area-uniform samples on a fixed low-discrepancy pattern."""
    total = patch.areas.sum()
    count = int(np.clip(SAMPLES_PER_TRACK * total / width**2, SAMPLES_LEAST, SAMPLES_MOST))
    share = (np.arange(count) + 0.5) / count
    chosen = np.searchsorted(np.cumsum(patch.areas) / total, share).clip(max=len(patch.areas) - 1)
    k = np.arange(1, count + 1)
    u, v = (k * 0.7548776662466927) % 1, (k * 0.5698402909980532) % 1  # R2 sequence
    root = np.sqrt(u)[:, None]
    weights = np.concatenate([1 - root, root * (1 - v[:, None]), root * v[:, None]], axis=1)
    return Samples(np.einsum("sk,ski->si", weights, patch.triangles[chosen]), patch.normals[chosen])


def frame_of(patch: Patch) -> tuple[Array, Array, Array, Array]:
    """Area centre, direction of the strokes (longest principal axis), across, mean normal."""
    centres = patch.triangles.mean(axis=1)
    centre = np.average(centres, axis=0, weights=patch.areas)
    normal = (patch.normals * patch.areas[:, None]).sum(axis=0)
    normal = normal / max(float(np.linalg.norm(normal)), 1e-12)
    flat = (patch.triangles - centre).reshape(-1, 3)
    flat = flat - np.outer(flat @ normal, normal)
    weights = np.repeat(patch.areas, 3)
    spread = (flat * weights[:, None]).T @ flat
    along = np.linalg.eigh(spread)[1][:, 2]
    along = along - normal * (along @ normal)
    along = along / np.linalg.norm(along)
    along = along * (1 if along[np.abs(along).argmax()] > 0 else -1)  # eigenvectors have no sign of their own
    return centre, along, np.cross(normal, along), normal


def strokes_over(patch: Patch, spacing: float, step: float, margin: float) -> list[Stroke]:
    """Parallel strokes, all in the same direction, not yet in order; spacing is measured along the surface."""
    centre, along, across, _ = frame_of(patch)
    offset = (patch.vertices - centre) @ across
    strokes: list[Stroke] = []
    for level in _levels(patch, offset, across, spacing):
        for points, normals in _slice(patch, offset - level):
            stroke = _resample(points, normals, step, margin)
            if stroke is not None:
                forwards = (stroke.points[-1] - stroke.points[0]) @ along > 0
                strokes.append(stroke if forwards else reverse(stroke))
    return strokes


def reverse(stroke: Stroke) -> Stroke:
    return Stroke(stroke.points[::-1], stroke.normals[::-1])


def _levels(patch: Patch, offset: Array, across: Array, spacing: float) -> Array:
    """Offsets of the slicing planes, closer where the surface is steep across the strokes."""
    low, high = offset.min(), offset.max()
    grid = np.linspace(low, high, 65)
    stretch = 1 / np.sqrt(np.maximum(1 - (patch.normals @ across) ** 2, 0.04))
    reach = offset[patch.corners]
    first, last = reach.min(axis=1), reach.max(axis=1)
    steepest = np.ones(64)
    for k in range(64):
        inside = (first < grid[k + 1]) & (last > grid[k])
        if inside.any():
            steepest[k] = np.quantile(stretch[inside], 0.8)
    length = np.concatenate([[0.0], np.cumsum(steepest * np.diff(grid))])
    count = max(1, int(np.ceil(length[-1] / spacing - 1e-9)))
    # a plane exactly through a row of vertices cuts nothing
    return np.interp((np.arange(count) + 0.5) / count * length[-1], length, grid) + 1.234e-7


def _slice(patch: Patch, signed: Array) -> list[tuple[Array, Array]]:
    """Curves where the plane cuts the patch: points and normals of each, ordered along it."""
    side = signed > 0
    corner_side = side[patch.corners]
    cut = corner_side.any(axis=1) & ~corner_side.all(axis=1)
    if not cut.any():
        return []
    corners = patch.corners[cut]
    edges = np.stack([corners, np.roll(corners, -1, axis=1)], axis=-1)  # (C, 3, 2)
    crossed = side[edges[..., 0]] != side[edges[..., 1]]
    pairs = np.sort(edges[crossed].reshape(-1, 2, 2), axis=-1)  # two crossed edges per triangle
    key = pairs[..., 0] * len(signed) + pairs[..., 1]
    unique, number = np.unique(key, return_inverse=True)
    first, second = unique // len(signed), unique % len(signed)
    t = (signed[first] / (signed[first] - signed[second]))[:, None]
    points = patch.vertices[first] * (1 - t) + patch.vertices[second] * t
    normals = patch.vertex_normals[first] * (1 - t) + patch.vertex_normals[second] * t
    return [(points[c], normals[c]) for c in _chains(number.reshape(-1, 2), len(unique))]


def _chains(links: NDArray[np.int64], count: int) -> list[list[int]]:
    """Nodes of each connected curve in order; open curves start at an end, closed ones return to it."""
    near: list[list[int]] = [[] for _ in range(count)]
    for a, b in links.tolist():
        near[a].append(b)
        near[b].append(a)
    free, chains = [True] * count, []
    for start in sorted(range(count), key=lambda k: (len(near[k]) != 1, k)):
        if not free[start]:
            continue
        chain, here = [start], start
        free[start] = False
        while following := [k for k in near[here] if free[k]]:
            here = following[0]
            free[here] = False
            chain.append(here)
        if len(chain) > 2 and start in near[here]:
            chain.append(start)
        chains.append(chain)
    return chains


def _resample(points: Array, normals: Array, step: float, margin: float) -> Stroke | None:
    """Evenly spaced waypoints, `margin` short of both ends; a curve shorter than the margins keeps its middle."""
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    keep = np.concatenate([[True], np.diff(length) > 1e-9])
    length, points, normals = length[keep], points[keep], normals[keep]
    if length[-1] < margin / 2:
        return None
    inset = min(margin, 0.35 * length[-1])
    span = length[-1] - 2 * inset
    at = np.linspace(inset, length[-1] - inset, max(2, int(np.ceil(span / step)) + 1))
    columns = np.stack([np.interp(at, length, c) for c in np.concatenate([points, normals], axis=1).T], axis=1)
    unit = columns[:, 3:] / np.maximum(np.linalg.norm(columns[:, 3:], axis=1, keepdims=True), 1e-12)
    return Stroke(columns[:, :3], unit)


def coverage(samples: Samples, points: Array, normals: Array, width: float) -> float:
    """Share of the samples that a roller at `points`, facing against `normals`, passes over."""
    if not len(points):
        return 0.0
    distance, nearest = KDTree(points).query(samples.points)
    faced = np.einsum("ij,ij->i", samples.normals, normals[nearest]) > FOLD
    return float(((distance <= width / 2) & faced).mean())
