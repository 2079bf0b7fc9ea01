"""The kept record of all merges: any number of regions, any tolerance and the smaller cluster under a click come from it at once."""

import io
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from app.errors import InvalidInput
from app.geometry.compiled import kernel
from app.geometry.tool import Array

Integers = NDArray[np.int64]
NOTABLE = 0.9  # a smaller cluster under a click is worth showing when it has at most this share of the one above
FORCED = 2.0  # times the tolerance: RMS cost a merge may add, spread over the smaller of the two clusters
SPECK = 1e-5  # share of the area below which a cluster may be forced in whatever it costs
MOST_STEPS = 12  # smaller clusters offered under one click


@dataclass(frozen=True)
class MergeTree:
    """All merges in order; cutting it after any number of merges gives a partition of the faces."""

    leaf: Integers  # (F,) first cluster of each face: itself, or its CAD face
    merges: Integers  # (M, 2) clusters joined: below `leaves` a leaf, leaves + i the result of merge i
    costs: Array  # (M,) integral cost of the joined cluster, unit diagonal
    areas: Array  # (leaves + M,) area of every cluster, unit diagonal

    @property
    def leaves(self) -> int:
        return len(self.areas) - len(self.merges)

    @cached_property
    def parent(self) -> Integers:
        """Cluster that each one was joined into (leaves + M,), itself at the top."""
        result = np.arange(len(self.areas))
        result[self.merges.ravel()] = np.repeat(self.leaves + np.arange(len(self.merges)), 2)
        return result

    def cut(self, target: int | None = None, tolerance: float | None = None) -> Integers:
        """Label of each face (F,), counted from 0.

        Args:
            target: Number of labels wanted; there are more when the surface has more connected pieces.
            tolerance: Largest RMS cost of a cluster / diagonal; what a merge adds to the cost may be FORCED times as much on the
                smaller side, so that a small feature isn't lost in a large region. With both, as many as the tolerance asks
                for, at most `target`.
        """
        if target is None and tolerance is None:
            raise InvalidInput("Say how many regions are wanted, or how closely they must fit.")
        keep = np.zeros(len(self.merges), bool)
        if target is not None:
            keep[: max(0, self.leaves - target)] = True
        if tolerance is not None:
            keep |= _sound(self.merges, self.costs, self.areas, tolerance)
        return _numbered(_tops(self.merges, keep, self.leaves)[self.leaf])

    def children_of(self, labels: NDArray[np.integer], face: int) -> tuple[NDArray[np.bool_], ...]:
        """Ever smaller clusters under a face, within the region it belongs to: masks of faces (F,), the largest first.

        Clicking walks down this list: first the largest part of the region that holds the face, at last the face's own leaf.
        """
        region = labels == labels[face]
        weight = np.bincount(self.leaf[region], minlength=self.leaves).astype(float)  # faces of the region in each leaf
        size = np.bincount(self.leaf, minlength=self.leaves)
        weight *= self.areas[: self.leaves] / np.maximum(size, 1)
        chain = [int(self.leaf[face])]
        while self.parent[chain[-1]] != chain[-1]:
            chain.append(int(self.parent[chain[-1]]))
        inside = sums_up(self.merges, weight)[chain]
        steps, last = [], weight.sum()
        for node, area in zip(reversed(chain), reversed(inside), strict=True):
            if area <= NOTABLE * last or (node == chain[0] and area < last * (1 - 1e-9)):
                steps.append(node)
                last = area
        if len(steps) > MOST_STEPS:
            steps = [*steps[: MOST_STEPS - 1], steps[-1]]
        return tuple(self.members(node) & region for node in steps)

    def members(self, node: int) -> NDArray[np.bool_]:
        """Faces (F,) of a cluster."""
        return _below(self.merges, node, self.leaves)[self.leaf]

    def on(self, source: NDArray[np.integer]) -> "MergeTree":
        """The same tree for a mesh whose faces are pieces of the faces `source` (F',)."""
        return replace(self, leaf=self.leaf[source])

    def to_bytes(self) -> bytes:
        """A compressed npz file."""
        buffer = io.BytesIO()
        leaf, merges = self.leaf.astype(np.int32), self.merges.astype(np.int32)
        np.savez_compressed(buffer, leaf=leaf, merges=merges, costs=self.costs, areas=self.areas)
        return buffer.getvalue()

    @staticmethod
    def from_bytes(content: bytes) -> "MergeTree":
        """The tree kept by `to_bytes`."""
        with np.load(io.BytesIO(content), allow_pickle=False) as kept:
            return MergeTree(kept["leaf"].astype(np.int64), kept["merges"].astype(np.int64), kept["costs"], kept["areas"])


def _numbered(names: Integers) -> Integers:
    """Labels 0, 1, ... in the order in which the names first occur."""
    _, first, inverse = np.unique(names, return_index=True, return_inverse=True)
    return np.argsort(np.argsort(first))[inverse.ravel()].astype(np.int64)


@kernel
def _tops(merges, keep, leaves):  # pragma: no cover - compiled
    """Highest cluster above each leaf that is kept whole; a kept merge keeps all below it."""
    total = leaves + len(merges)
    top = np.full(total, -1, np.int64)
    for i in range(len(merges) - 1, -1, -1):
        z = leaves + i
        mine = top[z] if top[z] >= 0 else (z if keep[i] else -1)
        top[z] = mine
        top[merges[i, 0]] = mine
        top[merges[i, 1]] = mine
    for i in range(leaves):
        if top[i] < 0:
            top[i] = i
    return top[:leaves]


@kernel
def _sound(merges, costs, areas, tolerance):  # pragma: no cover - compiled
    """Merges of which neither they nor any below exceed the tolerance."""
    leaves = len(areas) - len(merges)
    sound = np.ones(len(areas), np.bool_)
    whole = areas.max()
    for i in range(len(merges)):
        a, b = merges[i]
        added = costs[i]
        if a >= leaves:
            added -= costs[a - leaves]
        if b >= leaves:
            added -= costs[b - leaves]
        small = min(areas[a], areas[b])
        forced = added > (FORCED * tolerance) ** 2 * small and small > SPECK * whole
        fits = costs[i] <= tolerance**2 * areas[leaves + i]
        sound[leaves + i] = sound[a] and sound[b] and fits and not forced
    return sound[leaves:]


@kernel
def sums_up(merges, weight):  # pragma: no cover - compiled
    """Sum of the leaves' weights below each cluster."""
    leaves = len(weight)
    total = np.zeros(leaves + len(merges))
    total[:leaves] = weight
    for i in range(len(merges)):
        total[leaves + i] = total[merges[i, 0]] + total[merges[i, 1]]
    return total


@kernel
def _below(merges, node, leaves):  # pragma: no cover - compiled
    """Leaves below a cluster, as a mask."""
    inside = np.zeros(leaves + len(merges), np.bool_)
    inside[node] = True
    for i in range(len(merges) - 1, -1, -1):
        if inside[leaves + i]:
            inside[merges[i, 0]] = True
            inside[merges[i, 1]] = True
    return inside[:leaves]
