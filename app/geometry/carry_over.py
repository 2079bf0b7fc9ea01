"""Which regions of one cut of a part are regions of another one, so that an order clicked on the first holds on the second.

Both cuts lie on the same part; their triangles differ only where a cut runs. Equal triangles are compared one by one, the
others by points inside them.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from app.geometry.cleaning import areas
from app.geometry.slicing import Integers, closest_points
from app.geometry.tool import Array, Mesh, Tool

SAME = 0.99  # share of both areas that two regions have in common when they are one
GRID = 1e-7  # of the diagonal: triangles with corners closer than this are equal
PROBES = np.array([[2, 2, 2], [4, 1, 1], [1, 4, 1], [1, 1, 4]]) / 6.0  # points of a triangle, barycentric
NEAREST = 24  # triangles looked at for a point that lies in none of the first few
NONE = -1


@dataclass(frozen=True)
class RegionMap:
    """How the regions of an older cut lie in a newer one."""

    new_of: NDArray[np.int64]  # (n,) region of the newer cut, NONE where there is no such region
    shared: Array  # (n + 1, m + 1) common area, m^2; the last row and column are outside the working surface

    @property
    def complete(self) -> bool:
        """Whether the regions of both cuts map one to one."""
        n, m = self.shared.shape
        return n == m and bool((self.new_of >= 0).all())


def map_regions(old: Tool, new: Tool) -> RegionMap:
    """Compare two cuts of one part."""
    shared = np.zeros((old.n + 1, new.n + 1))
    source = locate(old.mesh, new.mesh)
    area = np.repeat(areas(old.mesh.vertices, old.mesh.faces)[:, None] / len(PROBES), len(PROBES), axis=1)
    known = source >= 0
    np.add.at(shared, (np.repeat(old.labels, source.shape[1])[known.ravel()], new.labels[source[known]]), area[known])
    new_of = np.full(old.n, NONE, np.int64)
    inside, size_old, size_new = shared[:-1, :-1], shared[:-1].sum(axis=1), shared[:, :-1].sum(axis=0)
    same = (inside >= SAME * size_old[:, None]) & (inside >= SAME * size_new[None, :]) & (inside > 0)
    found = same.any(axis=1)
    new_of[found] = same[found].argmax(axis=1)
    return RegionMap(new_of, shared)


def locate(here: Mesh, there: Mesh, probes: Array = PROBES) -> Integers:
    """For points inside every face of one mesh, the face of the other they lie in (F, number of points).

    Equal faces have it each time. The points are given by barycentric weights (K, 3); the first of PROBES is the middle.
    """
    size = float(np.linalg.norm(np.ptp(there.vertices, axis=0)))
    mine, theirs = _keys(here, there, size)
    order = np.argsort(theirs)
    at = np.minimum(np.searchsorted(theirs, mine, sorter=order), len(theirs) - 1)
    face = np.where(theirs[order][at] == mine, order[at], NONE)
    source = np.repeat(face[:, None], len(probes), axis=1)
    open_here = np.flatnonzero(face == NONE)
    if len(open_here):
        alone = np.ones(len(there.faces), bool)
        alone[face[face != NONE]] = False
        points = np.einsum("pc,fci->fpi", probes, here.vertices[here.faces[open_here]]).reshape(-1, 3)
        candidates = np.flatnonzero(alone) if alone.any() else np.arange(len(there.faces))
        source[open_here] = _nearest(there, candidates, points).reshape(-1, len(probes))
    return source


def _keys(here: Mesh, there: Mesh, size: float) -> tuple[Integers, Integers]:
    """Equal numbers for equal triangles of the two meshes."""
    place = _row_numbers(np.rint(np.concatenate([here.vertices, there.vertices]) / (GRID * size)).astype(np.int64))
    corners = np.concatenate([place[here.faces], place[len(here.vertices) + there.faces.astype(np.int64)]])
    key = _row_numbers(np.sort(corners, axis=1))
    return key[: len(here.faces)], key[len(here.faces) :]


def _row_numbers(rows: Integers) -> Integers:
    """A number for each row (K,), the same for equal rows."""
    number = np.zeros(len(rows), np.int64)
    for column in rows.T:
        own = column - column.min()
        number = np.unique(number * (own.max() + 1) + own, return_inverse=True)[1].ravel().astype(np.int64)
    return number


def _nearest(mesh: Mesh, faces: Integers, points: Array) -> Integers:
    """The listed face that each point lies in, or is closest to.

    Candidates come from points spread over the faces by size, so that long faces are found as well as small ones.
    """
    corners = mesh.vertices[mesh.faces[faces]]
    owner, place = _spread(corners)
    _, near = KDTree(place).query(points, k=min(NEAREST, len(place)))
    candidate = owner[near.reshape(len(points), -1)]  # (P, k) positions in `faces`
    k = candidate.shape[1]
    foot = closest_points(corners[candidate.ravel()], np.repeat(points, k, axis=0)).reshape(len(points), k, 3)
    best = np.argmin(np.linalg.norm(foot - points[:, None], axis=2), axis=1)
    return faces[candidate[np.arange(len(points)), best]]


def _spread(corners: Array) -> tuple[Integers, Array]:
    """Points on triangles (K, 3, 3), the more the longer their sides; (face of each, point)."""
    length = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    steps = np.clip(np.ceil(2 * length / max(float(np.median(length)), 1e-300)), 1, 12).astype(np.int64)
    owner, place = [], []
    for count in np.unique(steps):
        chosen = np.flatnonzero(steps == count)
        i, j = np.meshgrid(np.arange(count), np.arange(count), indexing="ij")
        inside = (i + j) < count
        u, v = (i[inside] + 1 / 3) / count, (j[inside] + 1 / 3) / count
        weights = np.stack([1 - u - v, u, v], axis=1)
        place.append(np.einsum("pc,fci->fpi", weights, corners[chosen]).reshape(-1, 3))
        owner.append(np.repeat(chosen, len(weights)))
    return np.concatenate(owner), np.concatenate(place)


def why_not(old: Tool, new: Tool, found: RegionMap) -> str:
    """In words, the first region of the older cut that is none of the newer one; "" when all are and no new ones came."""
    for a in range(old.n):
        if found.new_of[a] < 0:
            return _fate(old, new, found.shared, a)
    added = sorted(set(range(new.n)) - set(found.new_of.tolist()))
    return f"{new.regions[added[0]].name} was added since." if added else ""


def _fate(old: Tool, new: Tool, shared: Array, a: int) -> str:
    name, share = old.regions[a].name, shared[a] / shared[a].sum()
    parts = [b for b in np.argsort(-share[:-1]).tolist() if share[b] > 1 - SAME]
    if share[-1] >= SAME:
        return f"{name} is no longer part of the working surface."
    if len(parts) == 1 and share[parts[0]] >= SAME:
        into = parts[0]
        others = [old.regions[c].name for c in np.flatnonzero(shared[:-1, into] >= SAME * shared[:-1].sum(axis=1)).tolist()]
        if len(others) > 1:
            return f"{', '.join(others[:-1])} and {others[-1]} were merged into {new.regions[into].name} since."
        return f"{name} has grown since (it is {new.regions[into].name} now)."
    whole = [b for b in parts if shared[a, b] >= SAME * shared[:, b].sum()]
    if len(whole) > 1 and len(whole) == len(parts):
        pieces = sorted(new.regions[b].name for b in whole)
        return f"{name} was divided since, into {', '.join(pieces[:-1])} and {pieces[-1]}."
    return f"The border of {name} was moved since."
