"""Edits of a tool's regions by hand: merge, split by a plane, cut along a line, move a piece, add to or take from the working surface.

Every edit takes a tool and gives new labels; regions it doesn't touch keep their order, what is new comes at the end. Every
region stays connected: what an edit tears apart becomes regions of its own.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.errors import InvalidInput
from app.geometry.cleaning import areas, face_pairs, shared_length
from app.geometry.exact_shapes import known_shape
from app.geometry.regions import measure_labelled
from app.geometry.slicing import Integers, Sliced, split_edges
from app.geometry.splitting import connected
from app.geometry.tool import Array, Mesh, Tool, region_letters

SCRAP = 2e-3  # share of a region below which a piece of it goes to its neighbour
ON_PLANE = 1e-5  # share of the diagonal within which a vertex lies on the cutting plane
NEW = -1  # in `kept` and `named`: no region of before


@dataclass(frozen=True)
class Edited:
    """A tool after an edit."""

    tool: Tool
    kept: NDArray[np.int64]  # (N,) the region of before that each region still is, NEW where it was made or changed
    changed: tuple[int, ...]  # regions of before that are no longer what they were
    source: Integers  # (F,) face of before that each face is a part of


def merge(tool: Tool, regions: Sequence[int]) -> Edited:
    """Make touching regions one; it keeps the name of the largest.

    Raises:
        InvalidInput: Fewer than two, or they don't touch.
    """
    chosen = sorted(set(regions))
    if len(chosen) < 2:
        raise InvalidInput("Select two or more regions to merge.")
    labels = tool.labels.astype(np.int64)
    inside = np.isin(labels, chosen)
    group = np.where(inside, 0, 1 + np.arange(len(labels)))
    piece = connected(group, face_pairs(tool.mesh.faces))[inside]
    if len(np.unique(piece)) > 1:
        apart = [name_of(tool, a) for a in chosen if piece[labels[inside] == a][0] != piece[labels[inside] == chosen[0]][0]]
        raise InvalidInput(f"{name_of(tool, chosen[0])} and {apart[0]} don't touch. Only regions with a common border can be merged.")
    area = [tool.regions[a].area for a in chosen]
    largest = chosen[int(np.argmax(area))]
    labels[inside] = largest
    return finish(tool, Sliced(tool.mesh, np.arange(len(labels)), np.empty(0, np.int64)), labels)


def split_by_plane(tool: Tool, region: int, point: Array, normal: Array) -> Edited:
    """Divide a region along the plane through `point` (metres).

    Raises:
        InvalidInput: No direction, or the plane misses the region.
    """
    size = float(np.linalg.norm(normal))
    if not np.isfinite(size) or size < 1e-12:
        raise InvalidInput("The plane has no direction; choose two points that are apart.")
    mesh, inside = tool.mesh, tool.labels == region
    height = (mesh.vertices - point) @ (normal / size)
    height[np.abs(height) < ON_PLANE * np.linalg.norm(np.ptp(mesh.vertices, axis=0))] = 0
    corners = mesh.faces[inside].astype(np.int64)
    ends = np.sort(np.stack([corners, np.roll(corners, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
    ends = np.unique(ends[height[ends].prod(axis=1) < 0], axis=0)
    sliced = split_edges(mesh, ends, height[ends[:, 0]] / (height[ends[:, 0]] - height[ends[:, 1]]))
    labels = tool.labels[sliced.source].astype(np.int64)
    centres = sliced.mesh.vertices[sliced.mesh.faces].mean(axis=1)
    above = (centres - point) @ normal > 0
    return finish_division(tool, sliced, labels, region, np.where(labels == region, above.astype(np.int64), -1), "The plane")


def upright_plane(tool: Tool, region: int, first: Array, second: Array) -> Array:
    """Normal of the plane that stands upright on a region and holds two of its points."""
    corners = tool.mesh.vertices[tool.mesh.faces[tool.labels == region]]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    centres = corners.mean(axis=1)
    near = [int(np.argmin(np.linalg.norm(centres - point, axis=1))) for point in (first, second)]
    upward = (cross[near] / np.linalg.norm(cross[near], axis=1)[:, None]).sum(axis=0)
    return np.cross(np.asarray(second - first, np.float64), np.asarray(upward, np.float64)).astype(np.float64)


def plane_trace(tool: Tool, region: int, point: Array, normal: Array) -> Array:
    """Segments (S, 2, 3) in which a plane meets a region, metres."""
    corners = tool.mesh.vertices[tool.mesh.faces[tool.labels == region]]
    height = (corners - point) @ normal
    following, after = np.roll(corners, -1, axis=1), np.roll(height, -1, axis=1)
    crossed = (height < 0) != (after < 0)
    at = crossed.sum(axis=1) == 2
    step = np.where(crossed, height / np.where(crossed, height - after, 1), 0)
    places = corners + step[..., None] * (following - corners)
    order = np.argsort(~crossed[at], axis=1, kind="stable")[:, :2]
    return np.take_along_axis(places[at], order[..., None], axis=1)


def move_piece(tool: Tool, piece: NDArray[np.bool_], to: int | None) -> Edited:
    """Give the faces `piece` (F,) of one region to another one that they touch, or make them a region (None).

    Raises:
        InvalidInput: They don't touch it.
    """
    labels = tool.labels.astype(np.int64)
    if to is None:
        labels[piece] = tool.n
    else:
        pairs = face_pairs(tool.mesh.faces)
        across = (piece[pairs[:, 0]] & (labels[pairs[:, 1]] == to)) | (piece[pairs[:, 1]] & (labels[pairs[:, 0]] == to))
        if not across.any():
            raise InvalidInput(f"This piece has no border with {name_of(tool, to)}, so it can't become a part of it.")
        labels[piece] = to
    return finish(tool, Sliced(tool.mesh, np.arange(len(labels)), np.empty(0, np.int64)), labels)


def best_neighbour(tool: Tool, piece: NDArray[np.bool_]) -> int | None:
    """The region that a piece of another one shares most border with; None when it touches only its own."""
    pairs = face_pairs(tool.mesh.faces)
    border = pairs[piece[pairs[:, 0]] != piece[pairs[:, 1]]]
    inner = np.where(piece[border[:, 0]], border[:, 0], border[:, 1])
    outer = border.sum(axis=1) - inner
    beyond = tool.labels[outer]
    other = (beyond >= 0) & (beyond != tool.labels[inner])
    if not other.any():
        return None
    length = shared_length(tool.mesh.vertices, tool.mesh.faces, np.stack([inner[other], outer[other]], axis=1))
    return int(np.argmax(np.bincount(beyond[other], weights=length)))


def take_off(tool: Tool, regions: Sequence[int]) -> Edited:
    """Take regions from the working surface.

    Raises:
        InvalidInput: None would be left.
    """
    labels = tool.labels.astype(np.int64)
    labels[np.isin(labels, list(regions))] = -1
    if not (labels >= 0).any():
        raise InvalidInput("A tool needs one region at least; this would take all of them from the working surface.")
    return finish(tool, Sliced(tool.mesh, np.arange(len(labels)), np.empty(0, np.int64)), labels)


def add_patch(tool: Tool, patch: NDArray[np.bool_]) -> Edited:
    """Add faces (F,) outside the working surface as a region."""
    labels = tool.labels.astype(np.int64)
    labels[patch & (labels < 0)] = tool.n
    return finish(tool, Sliced(tool.mesh, np.arange(len(labels)), np.empty(0, np.int64)), labels)


def finish_division(tool: Tool, sliced: Sliced, labels: Integers, region: int, side: Integers, what: str) -> Edited:
    """Label the connected pieces of equal `side` in a region; the largest keeps its name.

    Raises:
        InvalidInput: There is only one piece.
    """
    inside = np.flatnonzero(labels == region)
    faces = sliced.mesh.faces[inside]
    pairs = face_pairs(faces)
    piece = gather_scraps(sliced.mesh, inside, pairs, connected(side[inside], pairs))
    if piece.max() == 0:
        raise InvalidInput(f"{what} doesn't divide {name_of(tool, region)}. It has to run from border to border, or around a part of it.")
    labels = labels.copy()
    labels[inside] = np.where(piece == 0, region, tool.n + piece - 1)
    return finish(tool, sliced, labels)


def gather_scraps(mesh: Mesh, inside: Integers, pairs: Integers, piece: Integers) -> Integers:
    """Pieces numbered from the largest on; scraps belong to the piece they share most border with."""
    area = areas(mesh.vertices, mesh.faces[inside].astype(np.int64))
    length = shared_length(mesh.vertices, mesh.faces, inside[pairs])
    while True:
        names, piece = np.unique(piece, return_inverse=True)
        size = np.bincount(piece, weights=area)
        least = int(np.argmin(size))
        both = piece[pairs]
        touching = (both == least).sum(axis=1) == 1
        if len(names) == 1 or size[least] >= SCRAP * area.sum() or not touching.any():
            break
        border = np.bincount(both[touching].sum(axis=1) - least, weights=length[touching], minlength=len(names))
        piece = np.where(piece == least, int(np.argmax(border)), piece)
    rank = np.empty(len(size), np.int64)
    rank[np.argsort(-size, kind="stable")] = np.arange(len(size))
    return rank[piece]


def finish(tool: Tool, sliced: Sliced, labels: Integers) -> Edited:
    """Measure the tool with new labels: numbers of regions that stay, `tool.n` and above for new ones."""
    labels = _reconnect(sliced.mesh, labels)
    present = np.unique(labels[labels >= 0])
    before = tool.labels[sliced.source]
    kept = np.full(len(present), NEW, np.int64)
    for new, label in enumerate(present):
        if label < tool.n and ((labels == label) == (before == label)).all():
            kept[new] = label
    names = _names(tool, present)
    compact = np.full(len(labels), -1, np.int32)
    compact[labels >= 0] = np.searchsorted(present, labels[labels >= 0])
    changed = tuple(a for a in range(tool.n) if a not in kept)
    shapes = [known_shape(tool, a) if a != NEW else None for a in kept.tolist()]
    return Edited(measure_labelled(sliced.mesh, compact, names, shapes), kept, changed, sliced.source)


def _reconnect(mesh: Mesh, labels: Integers) -> Integers:
    """What an edit tore off a region becomes regions of its own; the largest piece keeps the label."""
    piece = connected(labels, face_pairs(mesh.faces))
    area = areas(mesh.vertices, mesh.faces.astype(np.int64))
    size = np.bincount(piece, weights=area)
    owner = np.full(len(size), -1, np.int64)
    owner[piece] = labels
    labels, following = labels.copy(), int(labels.max()) + 1
    for label in np.unique(labels[labels >= 0]):
        mine = np.flatnonzero(owner == label)
        for extra in mine[np.argsort(-size[mine], kind="stable")][1:]:
            labels[piece == extra] = following
            following += 1
    return labels


def _names(tool: Tool, present: Integers) -> tuple[str, ...]:
    """Names of before for the labels of before, the lowest free letters for new ones."""
    taken = {name_of(tool, int(label)) for label in present if label < tool.n}
    free = iter(name for name in region_letters(2 * len(present) + len(taken) + 1) if name not in taken)
    return tuple(name_of(tool, int(label)) if label < tool.n else next(free) for label in present)


def name_of(tool: Tool, region: int) -> str:
    """How people call it."""
    return tool.regions[region].name
