"""The piece of a region under a click: ever smaller clusters of the merge tree, and the patch a click beside the regions adds."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.errors import InvalidInput
from app.geometry.carry_over import PROBES, locate
from app.geometry.cleaning import CleaningReport, areas, face_pairs
from app.geometry.editing import best_neighbour, name_of
from app.geometry.importing import ImportedPart
from app.geometry.merge_tree import MergeTree
from app.geometry.segmentation import part_tree
from app.geometry.slicing import nearest_face
from app.geometry.splitting import Integers, connected
from app.geometry.tool import Array, Tool

PATCH = 1e-3  # RMS distance to a primitive / diagonal up to which faces beside the regions are one patch
WHOLE = 0.98  # share of its region from which a piece is the region
FAR = 0.02  # share of the diagonal a clicked point may lie off the part


@dataclass(frozen=True)
class Piece:
    """Some faces of one region, or of the part beside the regions."""

    faces: NDArray[np.bool_]  # (F,)
    region: int | None  # None beside the regions
    level: int  # 1 for the largest, counted on with every smaller one
    area: float  # m^2
    share: float  # of the region's area; beside the regions of the part's
    to: int | None  # the neighbour it shares most border with


def tree_for(tool: Tool, part: ImportedPart | None, tree: MergeTree | None) -> MergeTree:
    """The merge tree on a tool's triangles: that of its part where there is one, else one of its own."""
    if part is None:
        alone = ImportedPart(tool.mesh, np.full(len(tool.mesh.faces), -1, np.int32), CleaningReport(()))
        return part_tree(alone)
    return (tree or part_tree(part)).on(locate(tool.mesh, part.mesh, PROBES[:1])[:, 0])


def piece_under(tool: Tool, tree: MergeTree, point: Array, level: int) -> Piece:
    """What a click on `point` (metres) means at a level; after the smallest piece comes the largest again.

    Raises:
        InvalidInput: The point is off the part, or its region has no smaller piece there.
    """
    face, distance = nearest_face(tool.mesh, point)
    if distance > FAR * float(np.linalg.norm(np.ptp(tool.mesh.vertices, axis=0))):
        raise InvalidInput("The point doesn't lie on the part.")
    region = int(tool.labels[face])
    area = areas(tool.mesh.vertices, tool.mesh.faces.astype(np.int64))
    pairs = face_pairs(tool.mesh.faces)
    pieces = _walk(tool, tree, face, area, pairs) if region >= 0 else _patches(tool, tree, face, pairs)
    if not pieces:
        raise InvalidInput(f"{name_of(tool, region)} has no smaller piece at this point. Cut it along a line or by a plane instead.")
    at = (level - 1) % len(pieces)
    faces = pieces[at]
    whole = area[tool.labels == region].sum()
    size = float(area[faces].sum())
    return Piece(faces, region if region >= 0 else None, at + 1, size, size / float(whole), best_neighbour(tool, faces))


def _walk(tool: Tool, tree: MergeTree, face: int, area: Array, pairs: Integers) -> list[NDArray[np.bool_]]:
    region = tool.labels == tool.labels[face]
    whole = area[region].sum()
    pieces: list[NDArray[np.bool_]] = []
    last = WHOLE * whole
    for mask in tree.children_of(tool.labels, face):
        piece = _connected_part(mask, face, pairs)
        size = area[piece].sum()
        if size < last:
            pieces.append(piece)
            last = WHOLE * size
    return pieces


def _patches(tool: Tool, tree: MergeTree, face: int, pairs: Integers) -> list[NDArray[np.bool_]]:
    patch = tree.cut(tolerance=PATCH)
    first = _connected_part((patch == patch[face]) & (tool.labels < 0), face, pairs)
    below = np.where(first, tool.n, tool.labels)
    smaller = [_connected_part(mask, face, pairs) for mask in tree.children_of(below, face)]
    return [first, *(mask for mask in smaller if mask.sum() < first.sum())]


def _connected_part(mask: NDArray[np.bool_], face: int, pairs: Integers) -> NDArray[np.bool_]:
    """What of a mask hangs together with a face."""
    inside = np.flatnonzero(mask)
    place = np.full(len(mask), -1)
    place[inside] = np.arange(len(inside))
    both = place[pairs]
    piece = connected(np.zeros(len(inside), np.int64), both[(both[:, 0] >= 0) & (both[:, 1] >= 0)])
    result = np.zeros(len(mask), bool)
    result[inside] = piece == piece[place[face]]
    return result
