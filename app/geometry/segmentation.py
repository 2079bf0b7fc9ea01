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
from app.geometry.cleaning import face_pairs
from app.geometry.compiled import kernel
from app.geometry.denoise import denoised
from app.geometry.exact_shapes import CadSurfaces, by_surface, surface_of
from app.geometry.fitting import AREA, NORMAL_WEIGHT, PLANE, PRODUCT, add_up, face_sums
from app.geometry.importing import ImportedPart
from app.geometry.merge_tree import Integers, MergeTree
from app.geometry.merging import absorb_small, build_tree
from app.geometry.quadrics import fit_any
from app.geometry.relaxing import relaxed
from app.geometry.splitting import LARGE, Surface, connected, split_large
from app.geometry.tool import Array, Mesh
from app.geometry.working_surface import reachable

Report = Callable[[float, str], None]
MOST_TARGET = 60
FILLET_WIDTH = 0.06  # of the diagonal; wider roundings are regions of their own
SIMILAR_LEAST, SIMILAR_MOST = 0.04, 0.16  # shares of the working surface between which the paper-like regions lie, roughly
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


@dataclass(frozen=True)
class Patches:
    """What a part's working surface is made of before patches are merged to the number of regions wanted.

    It depends on the part, the tolerance and the denoise switch alone: made once, a slider from few to many only merges and cuts.
    """

    labels: Integers  # (F,) patch of each face, -1 outside the working surface
    sums: Array  # (P, 54) numbers of each patch, for fitting
    pairs: Integers  # (Q, 2) neighbouring patches


def segment(
    part: ImportedPart,
    parameters: SegmentationParameters,
    report: Report = ignore,
    tree: MergeTree | None = None,
    patches: Patches | None = None,
) -> Cut:
    """Find the regions of a part's working surface.

    Args:
        part: The cleaned part.
        parameters: How finely to cut.
        report: Told the progress.
        tree: The merge tree of this very part (`part_tree`) where it was kept: then only the cut is made anew.
        patches: Of this part and tree, with these parameters (`find_patches`), where they were kept.

    Raises:
        InvalidInput: A parameter is out of range.
        UnreadableMesh: Nothing of the part can be reached from above.
    """
    _check(parameters)
    tree = tree or part_tree(part, lambda f: report(0.7 * f, "Fitting planes, cylinders, spheres and cones"), parameters.denoise)
    report(0.7, "Finding what can be reached from above")
    patches = patches or find_patches(part, parameters, tree)
    report(0.85, "Merging small pieces")
    labels = _to_regions(patches, parameters)
    if parameters.denoise and (part.cad_face < 0).all():
        labels = relaxed(labels, unit_sums(_fitted(part, True)), face_pairs(part.mesh.faces), NORMAL_WEIGHT)
    report(0.9, "Cutting large pieces")
    wanted = parameters.target or parameters.most
    least = min(parameters.target or LEAST_REGIONS, wanted)
    start = Surface(part.mesh.vertices, part.mesh.faces.astype(np.int64), part.cad_face, labels, np.arange(len(labels)))
    surface = split_large(start, least, wanted, SIMILAR_MOST if parameters.preset == "paper-like" else LARGE)
    report(1.0, f"{surface.labels.max() + 1} regions")
    finer = replace(part, mesh=Mesh(surface.vertices, surface.faces.astype(np.int32)), cad_face=surface.cad_face)
    return Cut(finer, surface.labels.astype(np.int32), tree.on(surface.source), surface.source)


def find_patches(part: ImportedPart, parameters: SegmentationParameters, tree: MergeTree) -> Patches:
    """The patches of a part that its tolerance asks for, and that can be reached."""
    pairs, sums = face_pairs(part.mesh.faces), unit_sums(_fitted(part, parameters.denoise))
    found = tree.cut(tolerance=parameters.tolerance)
    if part.cad_faces:
        surface = surface_of(part.cad_faces, float(np.linalg.norm(np.ptp(part.mesh.vertices, axis=0))))
        found = by_surface(found, CadSurfaces(part.cad_face, part.cad_faces), surface, pairs)
    labels = _working_patches(found, reachable(part.mesh), sums[:, AREA])
    return Patches(labels, add_up(sums, labels), _label_pairs(labels, pairs))


def patches_beside(patches: Patches, mesh: Mesh, held: NDArray[np.bool_]) -> Patches:
    """What is left of the patches of a mesh beside the faces `held` (F,)."""
    pairs = face_pairs(mesh.faces)
    left = np.where(held, -1, patches.labels)
    labels = _numbered(np.where(left >= 0, connected(left, pairs), -1))
    return Patches(labels, add_up(unit_sums(mesh), labels), _label_pairs(labels, pairs))


def _to_regions(patches: Patches, parameters: SegmentationParameters) -> Integers:
    """Region of each face (F,): patches merged as far as is wanted."""
    sums, pairs, into = patches.sums, patches.pairs, np.arange(len(patches.sums))
    similar, wanted = parameters.preset == "paper-like", parameters.target or parameters.most
    if parameters.absorb_fillets or similar:
        into = _absorb_fillets(sums, pairs)
        sums, pairs = add_up(sums, into), _label_pairs(into, pairs)
    smallest = SIMILAR_LEAST if similar else parameters.minimum_area
    kept = _numbered(absorb_small(sums, pairs, smallest, parameters.target or 1, NORMAL_WEIGHT))
    into, sums, pairs = kept[into], add_up(sums, kept), _label_pairs(kept, pairs)
    if len(sums) > wanted:
        into = np.where(into >= 0, build_tree(sums, np.arange(len(sums)), pairs, lambda _: None).cut(wanted)[into], -1)
    return np.where(patches.labels >= 0, into[patches.labels], -1)


def part_tree(part: ImportedPart, progress: Callable[[float], None] = lambda _: None, denoise: bool = False) -> MergeTree:
    """Merge the faces of a part, or its CAD faces, until each connected piece is one cluster."""
    pairs = face_pairs(part.mesh.faces)
    leaf = _first_clusters(part.cad_face, pairs)
    return build_tree(add_up(unit_sums(_fitted(part, denoise)), leaf), leaf, leaf[pairs], progress)


def _fitted(part: ImportedPart, denoise: bool) -> Mesh:
    """The mesh to which primitives are fitted; a file with CAD faces is no scan."""
    return denoised(part.mesh) if denoise and (part.cad_face < 0).all() else part.mesh


def _check(parameters: SegmentationParameters) -> None:
    if parameters.target is not None and not 1 <= parameters.target <= MOST_TARGET:
        raise InvalidInput(f"{parameters.target} regions were asked for; accepted are 1 to {MOST_TARGET}.")
    if not 0 < parameters.tolerance <= 0.1:
        raise InvalidInput(f"The tolerance {parameters.tolerance:g} is out of range; accepted are shares of the diagonal up to 0.1.")


def unit_sums(mesh: Mesh) -> Array:
    """Sums per face in coordinates centred on the part, in which it is about one diagonal large.

    A far origin would eat the digits of the fourth powers; the box's own diagonal would change when the part is turned.
    """
    middle, spread = _weighted(mesh.vertices, mesh.faces)
    return face_sums((mesh.vertices - middle) / np.sqrt(12 * spread), mesh.faces)


@kernel
def _weighted(vertices, faces):  # pragma: no cover - compiled
    """Middle of a surface (3,), and the mean square distance of its triangles' corners from it, both by area."""
    total, middle, square = 0.0, np.zeros(3), 0.0
    for turn in range(2):
        for f in range(len(faces)):
            a, b, c = vertices[faces[f, 0]], vertices[faces[f, 1]], vertices[faces[f, 2]]
            twice = 0.0
            for k in range(3):
                i, j = (k + 1) % 3, (k + 2) % 3
                twice += ((b[i] - a[i]) * (c[j] - a[j]) - (b[j] - a[j]) * (c[i] - a[i])) ** 2
            area = np.sqrt(twice) / 2
            for k in range(3):
                if turn == 0:
                    middle[k] += area * (a[k] + b[k] + c[k]) / 3
                else:
                    square += area * ((a[k] - middle[k]) ** 2 + (b[k] - middle[k]) ** 2 + (c[k] - middle[k]) ** 2) / 3
            if turn == 0:
                total += area
        if turn == 0:
            middle /= total
    return middle, square / total


def _first_clusters(cad_face: NDArray[np.int32], pairs: Integers) -> Integers:
    """Leaf of each face: its CAD face, or the face itself where there is none."""
    alone = cad_face.max(initial=-1) + 1 + np.arange(len(cad_face))
    return connected(np.where(cad_face >= 0, cad_face, alone), pairs)


def _working_patches(patch: Integers, seen: NDArray[np.bool_], area: Array) -> Integers:
    """Keep whole patches of which more than half can be reached."""
    share = np.bincount(patch, weights=area * seen) / np.bincount(patch, weights=area)
    keep = share > 0.5
    if not keep.any():
        raise UnreadableMesh("Nothing of the part can be reached from above. Choose another up-direction.")
    return np.where(keep, np.cumsum(keep) - 1, -1)[patch]


def _numbered(labels: Integers) -> Integers:
    """Labels 0, 1, ... without gaps; -1 stays."""
    result = np.full(len(labels), -1, np.int64)
    inside = labels >= 0
    result[inside] = np.unique(labels[inside], return_inverse=True)[1].ravel()
    return result


def _label_pairs(labels: Integers, pairs: Integers) -> Integers:
    """Neighbouring labels (Q, 2), each pair once."""
    both = labels[pairs]
    both = both[(both >= 0).all(axis=1) & (both[:, 0] != both[:, 1])]
    n = int(labels.max()) + 1
    key = np.unique(both.min(axis=1) * n + both.max(axis=1))
    return np.stack([key // n, key % n], axis=1)


def _absorb_fillets(sums: Array, touching: Integers) -> Integers:
    """What each patch becomes when every narrow bent one goes to the larger neighbour that it fits best."""
    out, into = np.empty(5), np.arange(len(sums))
    for k in np.argsort(sums[:, AREA]):
        m, others = sums[k], np.unique(touching[(touching == k).any(axis=1)])
        others = others[(others != k) & (sums[others, AREA] > m[AREA])]
        fit_any(m, NORMAL_WEIGHT, True, out)
        middle = m[PRODUCT[0, 1:4]] / m[0]
        along = np.sqrt(12 * np.linalg.eigvalsh(m[PRODUCT[1:4, 1:4]] / m[0] - np.outer(middle, middle))[-1])
        if out[0] == PLANE or len(others) < 2 or m[AREA] / along > FILLET_WIDTH:
            continue
        into[k] = others[int(np.argmin([_cost(m + sums[o]) - _cost(sums[o]) for o in others]))]
    while (into != into[into]).any():
        into = into[into]
    return _numbered(into)


def _cost(sums: Array) -> float:
    return float(fit_any(sums, NORMAL_WEIGHT, True, np.empty(5)))
