"""Cut a part's working surface into a handful of regions (Sec. V).

CAD faces, where the file has them, or single triangles are merged greedily into planes, cylinders, spheres, cones and freeform
patches; the part that can be reached from above is kept; small pieces and holes go to their surroundings, large ones are cut.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from app.errors import InvalidInput, UnreadableMesh
from app.geometry.cleaning import areas, face_pairs
from app.geometry.denoise import denoised
from app.geometry.fitting import AREA, NORMAL_WEIGHT, PLANE, PRODUCT, SIZE, face_sums
from app.geometry.importing import ImportedPart
from app.geometry.merge_tree import Integers, MergeTree
from app.geometry.merging import build_tree
from app.geometry.quadrics import fit_any
from app.geometry.relaxing import relaxed
from app.geometry.splitting import LARGE, Surface, connected, split_large
from app.geometry.tool import Array, Mesh
from app.geometry.working_surface import reachable

Report = Callable[[float, str], None]
MOST_TARGET = 60
FILLET_WIDTH = 0.06  # of the diagonal; wider roundings are regions of their own
SIMILAR_LEAST, SIMILAR_MOST = 0.04, 0.13  # shares of the working surface between which the paper-like regions lie, roughly
LEAST_REGIONS = 6  # fewer primitives than this are cut further, as one region leaves nothing to sequence


def ignore(fraction: float, message: str) -> None:
    """The progress report of a caller who doesn't want one."""


@dataclass(frozen=True)
class SegmentationParameters:
    """How finely to cut."""

    target: int | None = None  # regions wanted; None: as many as the tolerance needs, at most `most`
    tolerance: float = 5e-4  # allowed RMS distance to the primitives / diagonal
    minimum_area: float = 0.02  # smaller shares of the working surface (holes) go to a neighbour, while more than wanted
    most: int = 14  # regions without a target; sequencing is exact well above, people are not
    denoise: bool = False  # smooth the normals first: for scans; it blurs the edges of clean CAD
    absorb_fillets: bool = False  # give narrow roundings between two larger regions to these
    preset: Literal["default", "paper-like"] = "default"  # paper-like: 6 to 14 similar patches in rows, for a layup tool


@dataclass(frozen=True)
class Cut:
    """A part cut into regions; it has more triangles than before where planes cut it."""

    part: ImportedPart
    labels: NDArray[np.int32]  # (F,) region of each face of this part, -1 outside the working surface
    tree: MergeTree  # all merges, its `leaf` for the faces of this part; to be kept for the slider and for picking smaller clusters
    source: Integers  # (F,) face of the part as it came that each face is, or is a piece of


def segment(part: ImportedPart, parameters: SegmentationParameters, report: Report = ignore, tree: MergeTree | None = None) -> Cut:
    """Find the regions of a part's working surface.

    Args:
        part: The cleaned part.
        parameters: How finely to cut.
        report: Told the progress.
        tree: The merge tree of this very part (`part_tree`) where it was kept: then only the cut is made anew.

    Raises:
        InvalidInput: A parameter is out of range.
        UnreadableMesh: Nothing of the part can be reached from above.
    """
    _check(parameters)
    mesh = part.mesh
    report(0.0, "Looking for neighbouring triangles")
    pairs = face_pairs(mesh.faces)
    sums = unit_sums(_fitted(part, parameters))
    tree = tree or part_tree(part, lambda f: report(0.1 + 0.7 * f, "Fitting planes, cylinders, spheres and cones"), parameters.denoise)
    report(0.8, "Finding what can be reached from above")
    seen = reachable(mesh)
    labels = _working_patches(tree.cut(tolerance=parameters.tolerance), seen, sums[:, AREA], pairs)
    report(0.85, "Merging small pieces")
    similar = parameters.preset == "paper-like"
    if parameters.absorb_fillets or similar:
        labels = _absorb_fillets(labels, sums, pairs)
    smallest = SIMILAR_LEAST if similar else parameters.minimum_area
    labels = _merge_small(labels, sums, pairs, smallest, parameters.target or 1)
    wanted = parameters.target or parameters.most
    labels = _merge_down(labels, sums, pairs, wanted)
    if parameters.denoise and (part.cad_face < 0).all():
        labels = relaxed(labels, sums, pairs, NORMAL_WEIGHT)
    report(0.9, "Cutting large pieces")
    least = min(parameters.target or LEAST_REGIONS, wanted)
    start = Surface(mesh.vertices, mesh.faces.astype(np.int64), part.cad_face, labels, np.arange(len(labels)))
    surface = split_large(start, least, wanted, SIMILAR_MOST if similar else LARGE)
    report(1.0, f"{surface.labels.max() + 1} regions")
    finer = replace(part, mesh=Mesh(surface.vertices, surface.faces.astype(np.int32)), cad_face=surface.cad_face)
    return Cut(finer, surface.labels.astype(np.int32), tree.on(surface.source), surface.source)


def part_tree(part: ImportedPart, progress: Callable[[float], None] = lambda _: None, denoise: bool = False) -> MergeTree:
    """Merge the faces of a part, or its CAD faces, until each connected piece is one cluster."""
    pairs = face_pairs(part.mesh.faces)
    leaf = _first_clusters(part.cad_face, pairs)
    sums = unit_sums(_fitted(part, SegmentationParameters(denoise=denoise)))
    return build_tree(_add_up(sums, leaf), leaf, leaf[pairs], progress)


def _fitted(part: ImportedPart, parameters: SegmentationParameters) -> Mesh:
    """The mesh to which primitives are fitted; a file with CAD faces is no scan."""
    return denoised(part.mesh) if parameters.denoise and (part.cad_face < 0).all() else part.mesh


def _check(parameters: SegmentationParameters) -> None:
    if parameters.target is not None and not 1 <= parameters.target <= MOST_TARGET:
        raise InvalidInput(f"{parameters.target} regions were asked for; accepted are 1 to {MOST_TARGET}.")
    if not 0 < parameters.tolerance <= 0.1:
        raise InvalidInput(f"The tolerance {parameters.tolerance:g} is out of range; accepted are shares of the diagonal up to 0.1.")


def unit_sums(mesh: Mesh) -> Array:
    """Sums per face in coordinates centred on the part, in which it is about one diagonal large.

    A far origin would eat the digits of the fourth powers; the box's own diagonal would change when the part is turned.
    """
    corners, area = mesh.vertices[mesh.faces], areas(mesh.vertices, mesh.faces)
    middle = np.average(corners.mean(axis=1), axis=0, weights=area)
    spread = np.average(((corners - middle) ** 2).sum(axis=2).mean(axis=1), weights=area)
    return face_sums((mesh.vertices - middle) / np.sqrt(12 * spread), mesh.faces)


def _add_up(sums: Array, label: NDArray[np.integer]) -> Array:
    """Sums per label; faces with label -1 are left out."""
    total = np.zeros((int(label.max()) + 1, SIZE))
    np.add.at(total, label[label >= 0], sums[label >= 0])
    return total


def _first_clusters(cad_face: NDArray[np.int32], pairs: Integers) -> Integers:
    """Leaf of each face: its CAD face, or the face itself where there is none."""
    alone = cad_face.max(initial=-1) + 1 + np.arange(len(cad_face))
    return connected(np.where(cad_face >= 0, cad_face, alone), pairs)


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


def _absorb_fillets(labels: Integers, sums: Array, pairs: Integers) -> Integers:
    """Give each narrow bent region to the larger neighbour that it fits best."""
    total, touching = _add_up(sums, labels), _label_pairs(labels, pairs)
    out, into = np.empty(5), np.arange(len(total))
    for k in np.argsort(total[:, AREA]):
        m, others = total[k], np.unique(touching[(touching == k).any(axis=1)])
        others = others[(others != k) & (total[others, AREA] > m[AREA])]
        fit_any(m, NORMAL_WEIGHT, True, out)
        middle = m[PRODUCT[0, 1:4]] / m[0]
        along = np.sqrt(12 * np.linalg.eigvalsh(m[PRODUCT[1:4, 1:4]] / m[0] - np.outer(middle, middle))[-1])
        if out[0] == PLANE or len(others) < 2 or m[AREA] / along > FILLET_WIDTH:
            continue
        into[k] = others[int(np.argmin([_cost(m + total[o]) - _cost(total[o]) for o in others]))]
    while (into != into[into]).any():
        into = into[into]
    return _renumber(np.where(labels >= 0, into[labels], -1))


def _merge_small(labels: Integers, sums: Array, pairs: Integers, minimum_area: float, wanted: int) -> Integers:
    """Give regions below the minimum area, smallest first, to the neighbour they fit best while there are more than wanted.

    A region without a neighbour is dropped from the working surface.
    """
    total, touching = _add_up(sums, labels), _label_pairs(labels, pairs)
    into = np.arange(len(total))
    alive = np.ones(len(total), bool)
    while alive.sum() > wanted:
        area = np.where(alive, total[:, AREA], np.inf)
        small = int(np.argmin(area))
        if area[small] >= minimum_area * total[alive, AREA].sum() or alive.sum() == 1:
            break
        others = touching[(touching == small).any(axis=1)]
        others = np.unique(others[others != small])
        alive[small] = False
        if len(others) == 0:
            into[into == small] = -1
            continue
        extra = [_cost(total[small] + total[o]) - _cost(total[o]) for o in others]
        best = int(others[int(np.argmin(extra))])
        total[best] += total[small]
        into[into == small] = best
        touching = np.where(touching == small, best, touching)
        touching = touching[touching[:, 0] != touching[:, 1]]
    return _renumber(np.where(labels >= 0, into[labels], -1))


def _cost(sums: Array) -> float:
    return float(fit_any(sums, NORMAL_WEIGHT, True, np.empty(5)))


def _merge_down(labels: Integers, sums: Array, pairs: Integers, wanted: int) -> Integers:
    """Merge on until at most `wanted` regions are left."""
    if labels.max() + 1 <= wanted:
        return labels
    total = _add_up(sums, labels)
    joined = build_tree(total, np.arange(len(total)), _label_pairs(labels, pairs), lambda _: None).cut(wanted)
    return np.where(labels >= 0, joined[labels], -1)
