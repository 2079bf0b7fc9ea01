"""Thick convex cells under each region: MuJoCo collides meshes as convex hulls, so a curved surface needs many."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from app.geometry.tool import Array
from app.robot.raster import Patch

THICKNESS = 0.005  # m below the surface; thin, so that a cell does not come out of the back of a rib
LARGEST = 0.06  # m across a cell
BRIDGE = 4e-4  # m a corner may rise above another facet's plane; the hull bridges at most a quarter of it
TURN = np.cos(np.radians(40))  # between any facet and the cell's mean normal
CHECKED_AT_ONCE = 150  # triangles: larger clusters are cut without checking
THINNEST = 5e-5  # m across: slivers are left to their neighbours


def cells_of(patch: Patch) -> Iterator[Array]:
    """Corner points (2 K, 3) of each cell, in the tool frame."""
    waiting: list[NDArray[np.int64]] = [np.arange(len(patch.areas))]
    while waiting:
        cluster = waiting.pop()
        cut = None if _fits(patch, cluster) else _halves(patch, cluster)
        if cut is not None:
            waiting.extend(cut)
            continue
        points = _thick(patch, cluster)
        if points is not None:
            yield points


def _fits(patch: Patch, cluster: NDArray[np.int64]) -> bool:
    """Whether the hull of these triangles stays close to them."""
    if len(cluster) == 1:
        return True
    corners = patch.triangles[cluster].reshape(-1, 3)
    if len(cluster) > CHECKED_AT_ONCE or np.linalg.norm(np.ptp(corners, axis=0)) > LARGEST:
        return False
    normals = patch.normals[cluster]
    mean = normals.sum(axis=0)
    if (normals @ mean < TURN * np.linalg.norm(mean)).any():
        return False
    above = normals @ corners.T - np.einsum("ij,ij->i", normals, patch.triangles[cluster, 0])[:, None]
    return bool(above.max() < BRIDGE)


def _halves(patch: Patch, cluster: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]] | None:
    """Two parts, cut at the median of the widest direction of position and (scaled) normal."""
    centres = patch.triangles[cluster].mean(axis=1)
    space = np.concatenate([centres, patch.normals[cluster] * LARGEST], axis=1)
    widest = space[:, int(np.ptp(space, axis=0).argmax())]
    order = np.argsort(widest, kind="stable")
    half = len(order) // 2
    return (cluster[order[:half]], cluster[order[half:]]) if half else None


def _thick(patch: Patch, cluster: NDArray[np.int64]) -> Array | None:
    """The triangles' corners and their copies below the surface."""
    top = np.unique(patch.triangles[cluster].reshape(-1, 3).round(9), axis=0)
    spread = np.linalg.svd(top - top.mean(axis=0), compute_uv=False)
    if len(top) < 3 or spread[1] < THINNEST:
        return None
    down = (patch.normals[cluster] * patch.areas[cluster, None]).sum(axis=0)
    return np.concatenate([top, top - down / np.linalg.norm(down) * THICKNESS])
