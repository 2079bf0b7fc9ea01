"""Cut regions by one shared grid: straight cuts that run on from a region into its neighbours, as on the paper's real tools.

Triangles are sliced where a grid line runs, so lines are straight whatever the mesh; every triangle at a new vertex is split on
both sides of its edge, so a closed solid stays closed. On a cylinder or cone the lines run around and along its axis, as if it
were unrolled; those around it lie where a neighbour of the same length has its own.

Paper: the real tools have rows of identical patches (tool 14 is 2 x 3), which no fit of primitives finds.
"""

from collections.abc import Sequence

import numpy as np

from app.errors import InvalidInput
from app.geometry.cleaning import areas, face_pairs
from app.geometry.splitting import Integers, Surface, connected, quantiles, rectangle
from app.geometry.tool import Array
from app.geometry.unrolling import Straight, Way, round_ways

MOST_LINES = 20  # rows or columns
SCRAP = 0.1  # pieces below this share of an average cell go to the neighbour in the same region with the longest common border


def grid_split(surface: Surface, regions: Sequence[int], rows: int, columns: int, keep_borders: bool = True) -> Surface:
    """Cut regions by a grid that they share.

    Args:
        surface: The part with its regions.
        regions: One region or several; the grid is laid over all of them together.
        rows: Number of cells from front to rear of the grid's rectangle (the side nearer to the tool's y).
        columns: Number of cells across.
        keep_borders: Whether the borders between the regions stay; without, a cell joins what lies in it.

    Returns:
        The surface with more triangles and labels; each old region keeps its number for its first cell (rear left), other cells
        get new numbers from the largest one on.

    Raises:
        InvalidInput: Unknown region, or a number of rows or columns that isn't accepted.
    """
    _check(surface, regions, rows, columns)
    inside = np.isin(surface.labels, regions)
    ways = grid_ways(surface, regions)
    old, together = surface.labels, int(surface.labels.max()) + 1
    # while the cuts run, all chosen regions are one; `cad_face` remembers the old labels, `source` the faces before the cuts
    joined = np.where(inside, together, old)
    tagged = Surface(surface.vertices, surface.faces, old.astype(np.int32), joined, np.arange(len(old)))
    lines = [_lines(tagged, inside, way, count) for way, count in zip(ways, (columns, rows), strict=True)]
    for way, places, count in zip(ways, lines, (columns, rows), strict=True):
        for place in [*places, *([np.pi] if count > 1 and way.closed else [])]:
            tagged = way.cut(tagged, together, float(place))
    inside = tagged.labels == together
    middle = tagged.vertices[tagged.faces].mean(axis=1)
    column = np.searchsorted(lines[0], ways[0].at(middle))
    row = rows - 1 - np.searchsorted(lines[1], ways[1].at(middle))
    region = tagged.cad_face.astype(np.int64) if keep_borders else np.full(len(middle), min(regions))
    cell = (region * rows + row) * columns + column
    labels = np.where(inside, -1, tagged.cad_face)
    labels[inside] = _named(_whole(tagged, inside, cell), cell[inside], region[inside], int(old.max()) + 1)
    return Surface(tagged.vertices, tagged.faces, surface.cad_face[tagged.source], labels, surface.source[tagged.source])


def grid_size(surface: Surface, regions: Sequence[int], cells: int, aspect: float = 1.0) -> tuple[int, int]:
    """Rows and columns for about `cells` cells whose width over depth comes nearest to `aspect`."""
    _check(surface, regions, 1, 1)
    if not 1 <= cells <= MOST_LINES**2 or not 0.05 <= aspect <= 20:
        raise InvalidInput(f"Accepted are 1 to {MOST_LINES**2} cells and an aspect of 0.05 to 20; got {cells} and {aspect:g}.")
    corners = surface.vertices[surface.faces[np.isin(surface.labels, regions)]].reshape(-1, 3)
    width, depth = (max(way.unit * float(np.ptp(way.at(corners))), 1e-12) for way in grid_ways(surface, regions))

    def effort(rows: int, columns: int) -> float:
        return abs(np.log(rows * columns / cells)) * 2 + abs(np.log(width / columns / (depth / rows) / aspect))

    return min(((r, c) for r in range(1, MOST_LINES + 1) for c in range(1, MOST_LINES + 1)), key=lambda rc: effort(*rc))


def grid_frame(surface: Surface, regions: Sequence[int]) -> Array:
    """Unit vectors (2, 3) across and along the grid: the sides of the tightest rectangle, the first nearer to the tool's x."""
    joined = np.where(np.isin(surface.labels, regions), 0, -1)
    frame, _ = rectangle(Surface(surface.vertices, surface.faces, surface.cad_face, joined, surface.source), 0)
    if abs(frame[0, 0]) < abs(frame[1, 0]):
        frame = frame[::-1]
    across, along = frame[0] * _sign(frame[0], 0), frame[1] * _sign(frame[1], 1)
    return np.stack([across, along])


def grid_ways(surface: Surface, regions: Sequence[int]) -> tuple[Way, Way]:
    """Across and along the grid: straight, or unrolled where the regions together are one cylinder or cone."""
    faces = surface.faces[np.isin(surface.labels, regions)]
    found = round_ways(surface.vertices, faces)
    if found is None:
        across, along = grid_frame(surface, regions)
        return Straight(across), Straight(along)
    turning, straight = found
    if abs(turning.tangent[0]) > abs(straight.direction[0]):
        return turning.towards(_sign(turning.tangent, 0)), Straight(straight.direction * _sign(straight.direction, 1))
    return Straight(straight.direction * _sign(straight.direction, 0)), turning.towards(_sign(turning.tangent, 1))


def _sign(direction: Array, axis: int) -> float:
    """Which way makes the direction rise along `axis`, or along z where it has no part along it."""
    leading = direction[axis] if abs(direction[axis]) > 1e-9 else direction[2]
    return 1.0 if leading >= 0 else -1.0


def _check(surface: Surface, regions: Sequence[int], rows: int, columns: int) -> None:
    missing = sorted(set(regions) - set(np.unique(surface.labels[surface.labels >= 0]).tolist()))
    if missing or not regions:
        raise InvalidInput("Choose at least one region." if not regions else f"There is no region {missing[0]} to cut.")
    if not (1 <= rows <= MOST_LINES and 1 <= columns <= MOST_LINES):
        raise InvalidInput(f"A grid of {rows} x {columns} was asked for; accepted are 1 to {MOST_LINES} rows and columns.")


def _lines(surface: Surface, inside: np.ndarray, way: Way, count: int) -> Array:
    """Places of the grid lines that leave equal areas between them."""
    faces = surface.faces[inside]
    return quantiles(way.corners(surface.vertices, faces), areas(surface.vertices, faces), np.arange(1, count) / count)


def _whole(surface: Surface, inside: np.ndarray, cell: Integers) -> Integers:
    """Connected pieces of the cells, scraps joined to their neighbours; for the faces inside."""
    faces = surface.faces[inside]
    pairs = face_pairs(faces)
    piece = connected(cell[inside], pairs)
    area, region = areas(surface.vertices, faces), surface.cad_face[inside]
    first, second = faces[pairs[:, 0]], faces[pairs[:, 1]]
    common = np.sort(np.where((first[:, :, None] == second[:, None, :]).any(axis=2), first, -1), axis=1)[:, 1:]
    length = np.linalg.norm(surface.vertices[common[:, 1]] - surface.vertices[common[:, 0]], axis=1)
    least = SCRAP * area.sum() / len(np.unique(cell[inside]))
    while True:
        size = np.bincount(piece, weights=area)
        for scrap in np.flatnonzero((size > 0) & (size < least)):
            both = piece[pairs]
            near = ((both == scrap).sum(axis=1) == 1) & (region[pairs[:, 0]] == region[pairs[:, 1]])
            if near.any():
                border = np.bincount(both[near].sum(axis=1) - scrap, weights=length[near])
                piece = np.where(piece == scrap, int(np.argmax(border)), piece)
                break
        else:
            return piece


def _named(piece: Integers, cell: Integers, region: Integers, free: int) -> Integers:
    """Final labels: per region the piece in its first cell keeps the region's number."""
    result = np.empty(len(piece), np.int64)
    first = np.full(int(piece.max()) + 1, np.iinfo(np.int64).max)
    np.minimum.at(first, piece, cell)
    for old in np.unique(region):
        names = np.unique(piece[region == old])
        for k, name in enumerate(names[np.argsort(first[names], kind="stable")]):
            result[(piece == name) & (region == old)] = old if k == 0 else free
            free += k > 0
    return result
