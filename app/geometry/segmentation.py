"""Cut a part's working surface into a handful of regions (Sec. V).

CAD faces, where the file has them, or single triangles are merged greedily into planes, cylinders and spheres; the part
that can be reached from above is kept; what is too small or too much is merged on.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from app.errors import InvalidInput, UnreadableMesh
from app.geometry.cleaning import areas, face_pairs
from app.geometry.fitting import AREA, NORMAL_WEIGHT, SIZE, face_sums, fit
from app.geometry.importing import ImportedPart
from app.geometry.merging import Integers, build_tree
from app.geometry.tool import Array, Mesh
from app.geometry.working_surface import reachable

Report = Callable[[float, str], None]
MOST_TARGET = 60
LEAST_REGIONS = 6  # fewer primitives than this are split further, as one region leaves nothing to sequence
SMALL_FACES = 0.1  # a region is only split when no triangle has more than this share of it


def ignore(fraction: float, message: str) -> None:
    """The progress report of a caller who doesn't want one."""


@dataclass(frozen=True)
class SegmentationParameters:
    """How finely to cut."""

    target: int | None = None  # regions wanted; None: as many as the tolerance needs, at most `most`
    tolerance: float = 1e-3  # allowed RMS distance to the primitives / diagonal
    minimum_area: float = 0.005  # smaller shares of the working surface are merged with a neighbour
    most: int = 14  # regions without a target; sequencing is exact well above, people are not


@dataclass(frozen=True)
class _Patches:
    """Clusters of the working surface."""

    sums: Array  # (P, 54)
    pairs: Integers  # (Q, 2) neighbours


def segment(
    part: ImportedPart, parameters: SegmentationParameters, report: Report = ignore
) -> tuple[NDArray[np.int32], NDArray[np.bool_]]:
    """Region of each face (F,), -1 outside the working surface, and the working surface (F,).

    Raises:
        InvalidInput: A parameter is out of range.
        UnreadableMesh: Nothing of the part can be reached from above.
    """
    _check(parameters)
    mesh = part.mesh
    report(0.0, "Looking for neighbouring triangles")
    pairs = face_pairs(mesh.faces)
    sums = _unit_sums(mesh)
    leaf = _first_clusters(part.cad_face, pairs)
    report(0.1, "Finding what can be reached from above")
    seen = reachable(mesh)
    tree = build_tree(_add_up(sums, leaf), leaf[pairs], lambda f: report(0.2 + 0.6 * f, "Fitting planes, cylinders and spheres"))
    patch = tree.cut(tree.clusters_within(parameters.tolerance))[leaf]
    labels = _working_patches(patch, seen, sums[:, AREA], pairs)
    report(0.85, "Merging small pieces")
    labels = _merge_small(labels, sums, pairs, parameters.minimum_area)
    wanted = parameters.target or parameters.most
    labels = _merge_down(labels, sums, pairs, wanted)
    labels = _split_up(labels, mesh, pairs, parameters.target or LEAST_REGIONS)
    report(1.0, f"{labels.max() + 1} regions")
    return labels.astype(np.int32), labels >= 0


def _check(parameters: SegmentationParameters) -> None:
    if parameters.target is not None and not 1 <= parameters.target <= MOST_TARGET:
        raise InvalidInput(f"{parameters.target} regions were asked for; accepted are 1 to {MOST_TARGET}.")
    if not 0 < parameters.tolerance <= 0.1:
        raise InvalidInput(f"The tolerance {parameters.tolerance:g} is out of range; accepted are shares of the diagonal up to 0.1.")


def _unit_sums(mesh: Mesh) -> Array:
    """Sums per face in centred coordinates of unit diagonal: a far origin would eat the digits of the fourth powers."""
    middle = (mesh.vertices.min(axis=0) + mesh.vertices.max(axis=0)) / 2
    return face_sums((mesh.vertices - middle) / np.linalg.norm(np.ptp(mesh.vertices, axis=0)), mesh.faces)


def _add_up(sums: Array, label: NDArray[np.integer]) -> Array:
    """Sums per label; faces with label -1 are left out."""
    total = np.zeros((int(label.max()) + 1, SIZE))
    np.add.at(total, label[label >= 0], sums[label >= 0])
    return total


def _connected(group: NDArray[np.integer], pairs: Integers) -> Integers:
    """Number of the connected piece of equal `group` that each face lies in."""
    same = pairs[group[pairs[:, 0]] == group[pairs[:, 1]]]
    n = len(group)
    graph = coo_matrix((np.ones(len(same)), (same[:, 0], same[:, 1])), shape=(n, n))
    return connected_components(graph, directed=False)[1].astype(np.int64)


def _first_clusters(cad_face: NDArray[np.int32], pairs: Integers) -> Integers:
    """Leaf of each face: its CAD face, or the face itself where there is none."""
    alone = cad_face.max(initial=-1) + 1 + np.arange(len(cad_face))
    return _connected(np.where(cad_face >= 0, cad_face, alone), pairs)


def _working_patches(patch: Integers, seen: NDArray[np.bool_], area: Array, pairs: Integers) -> Integers:
    """Keep whole patches of which more than half can be reached."""
    share = np.bincount(patch, weights=area * seen) / np.bincount(patch, weights=area)
    keep = (share > 0.5)[patch]
    if not keep.any():
        raise UnreadableMesh("Nothing of the part can be reached from above. Choose another up-direction.")
    return _renumber(np.where(keep, patch, -1))


def _renumber(labels: Integers) -> Integers:
    """Labels 0, 1, ... without gaps; -1 stays."""
    result = np.full(len(labels), -1, np.int64)
    inside = labels >= 0
    result[inside] = np.unique(labels[inside], return_inverse=True)[1].ravel()
    return result


def _label_pairs(labels: Integers, pairs: Integers) -> Integers:
    """Neighbouring labels (Q, 2), each pair once."""
    both = labels[pairs]
    both = both[(both >= 0).all(axis=1) & (both[:, 0] != both[:, 1])]
    return np.unique(np.sort(both, axis=1), axis=0)


def _merge_small(labels: Integers, sums: Array, pairs: Integers, minimum_area: float) -> Integers:
    """Give every region below the minimum area to the neighbour it fits best; drop it when it has none."""
    while True:
        total = _add_up(sums, labels)
        share = total[:, AREA] / total[:, AREA].sum()
        small = int(np.argmin(share))
        if share[small] >= minimum_area or len(share) == 1:
            return labels
        touching = _label_pairs(labels, pairs)
        touching = touching[(touching == small).any(axis=1)]
        others = touching[touching != small]
        if len(others) == 0:
            labels = _renumber(np.where(labels == small, -1, labels))
            continue
        extra = [_cost(total[small] + total[o]) - _cost(total[o]) for o in others]
        labels = _renumber(np.where(labels == small, others[int(np.argmin(extra))], labels))


def _cost(sums: Array) -> float:
    return float(fit(sums, NORMAL_WEIGHT, np.empty(5)))


def _merge_down(labels: Integers, sums: Array, pairs: Integers, wanted: int) -> Integers:
    """Merge on until at most `wanted` regions are left."""
    if labels.max() + 1 <= wanted:
        return labels
    tree = build_tree(_add_up(sums, labels), _label_pairs(labels, pairs), lambda _: None)
    joined = tree.cut(wanted)
    return np.where(labels >= 0, joined[labels], -1)


def _split_up(labels: Integers, mesh: Mesh, pairs: Integers, wanted: int) -> Integers:
    """Halve the largest region across its long side until `wanted` regions exist or triangles are too coarse."""
    area = areas(mesh.vertices, mesh.faces)
    centres = mesh.vertices[mesh.faces].mean(axis=1)
    closed: set[int] = set()
    while labels.max() + 1 < wanted:
        size = np.bincount(labels[labels >= 0], weights=area[labels >= 0])
        size[list(closed)] = 0
        largest = int(np.argmax(size))
        if size[largest] == 0:
            return labels
        inside = np.flatnonzero(labels == largest)
        half = _half(centres[inside], area[inside])
        trial = labels.copy()
        trial[inside[half]] = labels.max() + 1
        pieces = len(np.unique(_connected(trial, pairs)[inside]))
        if area[inside].max() > SMALL_FACES * size[largest] or pieces != 2:
            closed.add(largest)
            continue
        labels = trial
    return labels


def _half(centres: Array, area: Array) -> NDArray[np.bool_]:
    """The faces beyond the area median along the longest direction."""
    offset = centres - np.average(centres, axis=0, weights=area)
    _, axes = np.linalg.eigh((offset * area[:, None]).T @ offset)
    along = offset @ axes[:, -1]
    order = np.argsort(along)
    beyond = np.cumsum(area[order]) > area.sum() / 2
    half = np.zeros(len(area), bool)
    half[order[beyond]] = True
    return half
