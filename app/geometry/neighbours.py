"""Which regions touch and how: along a border, across a narrow rounding, or in a corner; and at which angle their faces meet."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from app.geometry.borders import FREE, Borders, find_borders
from app.geometry.main_faces import MainFaces, find_main_faces
from app.geometry.tool import Array, Tool

Touch = Literal["border", "rounding", "corner"]
ROUNDING_WIDTH = 0.06  # share of the working surface's diagonal; wider roundings are regions that count as faces themselves
SMOOTH = np.radians(20)  # a rounding runs into the faces beside it without an edge, its own facets aside
LEAST_SIDE = 0.2  # share of its perimeter along which a rounding touches either face


@dataclass(frozen=True)
class Neighbours:
    """Two regions that touch."""

    a: int  # the smaller number
    b: int
    touch: Touch
    border: float  # m, the length they share; of a rounding between them, the mean length of its two sides; 0 for corners
    angle: float | None  # rad by which the surface turns from one face to the other, + outwards (a ridge), 0 level; None for corners
    across: int | None  # the rounding between them


def find_neighbours(tool: Tool) -> tuple[Neighbours, ...]:
    """All pairs of regions of a tool on a mesh that touch, in the order of their numbers.

    Paper: the angle between neighbours. Along a border it is the mean over its length. Where one of them has a narrow fillet at its
    edge, the angle is that of the flat faces beyond; where the fillet is a region of its own, the faces on both sides are neighbours
    across it too, at the angle the fillet turns by.
    """
    borders = find_borders(tool.mesh, tool.labels)
    faces = find_main_faces(tool)
    shared, angle = borders.shared(tool.n), border_angles(tool, borders, faces)
    touching = [
        Neighbours(int(a), int(b), "border", float(shared[a, b]), float(angle[a, b]), None) for a, b in np.argwhere(np.triu(shared) > 0)
    ]
    across = _across(tool, borders, faces, shared, angle)
    known = {(pair.a, pair.b) for pair in across}
    corners = [
        Neighbours(int(a), int(b), "corner", 0.0, None, None)
        for a, b in np.argwhere(np.triu(tool.graph.corner | tool.graph.corner.T))
        if (int(a), int(b)) not in known
    ]
    return tuple(sorted([*touching, *across, *corners], key=lambda pair: (pair.a, pair.b)))


def border_angles(tool: Tool, borders: Borders, faces: MainFaces) -> Array:
    """Mean turn of the surface across the border of two regions (n, n), rad, + outwards."""
    inner = np.flatnonzero(borders.beyond != FREE)
    a, b = borders.region[inner], borders.beyond[inner]
    ends = tool.mesh.vertices[borders.ends[inner]]
    middle, along = ends.mean(axis=1), ends[:, 1] - ends[:, 0]
    turn = _turns(faces.at(a, borders.face[inner], middle), faces.at(b, borders.beyond_face[inner], middle), along)
    total, length = np.zeros((tool.n, tool.n)), np.zeros((tool.n, tool.n))
    np.add.at(total, (a, b), turn * borders.length[inner])
    np.add.at(length, (a, b), borders.length[inner])
    return np.divide(total, length, out=np.zeros_like(total), where=length > 0)


def _turns(own: Array, other: Array, along: Array) -> Array:
    """Angle from one normal (K, 3) to the other, + where a ridge runs `along` an edge that has its own face to the left."""
    cross = np.cross(own, other)
    size = np.arctan2(np.linalg.norm(cross, axis=1), np.einsum("ki,ki->k", own, other))
    return np.where(np.einsum("ki,ki->k", cross, along) < 0, -size, size)


def _across(tool: Tool, borders: Borders, faces: MainFaces, shared: Array, angle: Array) -> list[Neighbours]:
    """Pairs on both sides of a rounding, each pair once."""
    found: dict[tuple[int, int], Neighbours] = {}
    for between, a, b in _roundings(tool, borders, shared, angle):
        length = (shared[between, a] + shared[between, b]) / 2
        if shared[a, b] == 0 and length > getattr(found.get((a, b)), "border", 0.0):
            turn = _turn_across(tool, borders, faces, between, a, b)
            found[a, b] = Neighbours(a, b, "rounding", float(length), turn, between)
    return list(found.values())


def _roundings(tool: Tool, borders: Borders, shared: Array, angle: Array) -> Iterator[tuple[int, int, int]]:
    """Narrow bent regions, with two regions that each runs smoothly into."""
    used = tool.mesh.vertices[np.unique(tool.mesh.faces[tool.labels >= 0])]
    narrow, perimeter = ROUNDING_WIDTH * float(np.linalg.norm(np.ptp(used, axis=0))), borders.perimeter(tool.n)
    for k, region in enumerate(tool.regions):
        beside = np.flatnonzero((shared[k] > LEAST_SIDE * perimeter[k]) & (np.abs(angle[k]) < SMOOTH))
        if region.kind == "plane" or len(beside) < 2:
            continue
        for a, b in combinations(beside.tolist(), 2):
            if 2 * region.area < narrow * (shared[k, a] + shared[k, b]):
                yield k, a, b


def _turn_across(tool: Tool, borders: Borders, faces: MainFaces, between: int, a: int, b: int) -> float:
    """Mean angle between the faces on both sides of a rounding, each place against the nearest on the other side."""
    one, other = (np.flatnonzero((borders.region == r) & (borders.beyond == between)) for r in (a, b))
    ends = tool.mesh.vertices[borders.ends]
    middle, along = ends.mean(axis=1), ends[:, 1] - ends[:, 0]
    facing = other[KDTree(middle[other]).query(middle[one])[1]]
    own, beyond = (_labels(len(k), r) for k, r in ((one, a), (facing, b)))
    turn = _turns(faces.at(own, borders.face[one], middle[one]), faces.at(beyond, borders.face[facing], middle[facing]), along[one])
    return float(np.average(turn, weights=borders.length[one]))


def _labels(count: int, region: int) -> NDArray[np.int64]:
    return np.full(count, region, np.int64)
