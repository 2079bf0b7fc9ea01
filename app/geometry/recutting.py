"""Cut a tool anew by parameters, around regions that a person has locked."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from app.geometry.carry_over import map_regions
from app.geometry.cleaning import areas, face_pairs, shared_length
from app.geometry.exact_shapes import CadSurfaces, known_shape
from app.geometry.importing import ImportedPart
from app.geometry.merge_tree import MergeTree
from app.geometry.pieces import tree_for
from app.geometry.regions import measure, measure_labelled
from app.geometry.segmentation import Cut, Patches, Report, SegmentationParameters, find_patches, ignore, patches_beside, segment
from app.geometry.splitting import connected
from app.geometry.tool import Tool, region_letters

LETTERS = 702  # A to ZZ: names nobody gave
SCRAP = 0.01  # share of the working surface below which what is left of a new region beside a locked one goes to a neighbour


@dataclass(frozen=True)
class Recut:
    """A tool cut anew."""

    tool: Tool
    held: tuple[int, ...]  # the numbers the locked regions have in it
    tree: MergeTree  # the merge tree on its triangles


def recut(
    part: ImportedPart,
    parameters: SegmentationParameters,
    tree: MergeTree,
    before: Tool | None = None,
    locked: Sequence[int] = (),
    report: Report = ignore,
    patches: Patches | None = None,
    here: MergeTree | None = None,
) -> Recut:
    """Cut a part; with its kept trees and patches that takes no time.

    Args:
        part: The part.
        parameters: How finely to cut.
        tree: Its merge tree, of the smoothed part when that is asked for.
        before: The tool as it was cut so far; regions that stay the same keep the names people gave them.
        locked: Regions of `before` that stay.
        report: Told the progress.
        patches: What `find_patches` found with these parameters, with locked regions `beside_locked`, where it was kept.
        here: The merge tree on the triangles of `before`, where it was kept; only of use with locked regions.
    """
    if before is not None and locked:
        here = replace(tree, leaf=(here or tree_for(before, part, tree)).leaf)
        patches = patches or beside_locked(before, locked, find_patches(part, parameters, tree), tree, here)
        return recut_around(before, locked, part, parameters, here, patches)
    cut = segment(part, parameters, report, tree, patches)
    tool = measure(cut.part.mesh, cut.labels, CadSurfaces(cut.part.cad_face, cut.part.cad_faces))
    return Recut(tool if before is None else _with_given_names(before, tool), (), cut.tree)


def _with_given_names(before: Tool, tool: Tool) -> Tool:
    """Names that are no letters stay with regions that stay."""
    letters = set(region_letters(LETTERS))
    if all(r.name in letters for r in before.regions):
        return tool
    new_of = map_regions(before, tool).new_of
    given = {int(new_of[a]): r.name for a, r in enumerate(before.regions) if r.name not in letters and new_of[a] >= 0}
    return replace(tool, regions=tuple(replace(r, name=given.get(i, r.name)) for i, r in enumerate(tool.regions)))


def beside_locked(tool: Tool, locked: Sequence[int], patches: Patches, tree: MergeTree, here: MergeTree) -> Patches:
    """What is left of a part's patches on a tool's triangles beside its locked regions.

    Args:
        tool: The tool as it is.
        locked: Regions that stay.
        patches: Of the part.
        tree: The part's merge tree.
        here: The same tree on the tool's triangles.
    """
    patch = np.full(tree.leaves, -1, np.int64)
    patch[tree.leaf] = patches.labels  # a patch holds whole leaves
    return patches_beside(replace(patches, labels=patch[here.leaf]), tool.mesh, np.isin(tool.labels, list(locked)))


def recut_around(
    tool: Tool, locked: Sequence[int], part: ImportedPart, parameters: SegmentationParameters, tree: MergeTree, patches: Patches
) -> Recut:
    """Cut everything but the locked regions anew; they keep their names, and get the first numbers.

    Args:
        tool: The tool as it is.
        locked: Regions that stay.
        part: The part it was made from, for its CAD faces.
        parameters: How finely to cut the rest.
        tree: The merge tree on the tool's triangles.
        patches: What there is beside the locked regions, on the tool's triangles.
    """
    here = replace(part, mesh=tool.mesh, cad_face=np.full(len(tool.mesh.faces), -1, np.int32))
    if (patches.labels >= 0).any():
        made, labels = _cut_beside(here, tool, locked, parameters, tree, patches)
    else:  # all of it is locked
        made, labels = Cut(here, tool.labels, tree, np.arange(len(tool.labels))), np.searchsorted(sorted(locked), tool.labels)
        labels = np.where(tool.labels >= 0, labels, -1).astype(np.int32)
    kept = [tool.regions[a].name for a in sorted(locked)]
    count = int(labels.max()) + 1
    free = [name for name in region_letters(count + len(kept)) if name not in kept]
    names = [*kept, *free[: count - len(kept)]]
    shapes = [known_shape(tool, a) for a in sorted(locked)] + [None] * count
    return Recut(measure_labelled(made.part.mesh, labels, names, shapes[:count]), tuple(range(len(kept))), made.tree)


def _cut_beside(
    part: ImportedPart, tool: Tool, locked: Sequence[int], parameters: SegmentationParameters, tree: MergeTree, patches: Patches
) -> tuple[Cut, NDArray[np.int32]]:
    """The cut with the locked regions of the tool as labels 0, 1, ... and new ones, of the patches beside them, behind."""
    wanted, most = parameters.target, max(1, parameters.most - len(locked))
    fewer = replace(parameters, target=None if wanted is None else max(1, wanted - len(locked)), most=most)
    cut = segment(part, fewer, tree=tree, patches=patches)
    before = tool.labels[cut.source]
    held = np.isin(before, list(locked))
    labels = np.where(cut.labels >= 0, cut.labels + len(locked), -1).astype(np.int64)
    labels[held] = np.searchsorted(sorted(locked), before[held])
    labels = _without_scraps(cut.part, labels, len(locked))
    present = np.unique(labels[labels >= 0])
    return cut, np.where(labels >= 0, np.searchsorted(present, labels), -1).astype(np.int32)


def _without_scraps(part: ImportedPart, labels: np.ndarray, locked: int) -> np.ndarray:
    """Every label connected; small leftovers go to the neighbour, not a locked one, they share most border with."""
    pairs = face_pairs(part.mesh.faces)
    area = areas(part.mesh.vertices, part.mesh.faces.astype(np.int64))
    piece = connected(labels, pairs)
    owner = np.full(int(piece.max()) + 1, -1, np.int64)
    owner[piece] = labels
    least = SCRAP * area[labels >= 0].sum()
    between = pairs[piece[pairs[:, 0]] != piece[pairs[:, 1]]]
    length = shared_length(part.mesh.vertices, part.mesh.faces, between)
    into, size, both = np.arange(len(owner)), np.bincount(piece, weights=area), piece[between]
    while True:
        small = [p for p in np.argsort(size).tolist() if 0 < size[p] < least and owner[p] >= locked]
        for scrap in small:
            a, b = both.T
            beyond = np.where(a == scrap, b, a)
            near = ((a == scrap) != (b == scrap)) & (owner[beyond] >= locked)
            if near.any():
                onto = int(np.argmax(np.bincount(beyond[near], weights=length[near])))
                into[into == scrap], size[onto], size[scrap] = onto, size[onto] + size[scrap], 0
                both = np.where(both == scrap, onto, both)
                break
        else:
            return np.where(owner[into] >= locked, locked + into, owner[into])[piece]
