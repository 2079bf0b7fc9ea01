"""Region graph of rectangles in plan view: who borders whom over which length, and at which angle."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from app.geometry.tool import Array, RegionGraph

Side = Literal["back", "right", "front", "left"]
ORDER: tuple[Side, ...] = ("back", "right", "front", "left")
EQUAL = 1e-6  # relative: lengths and angles closer than this agree
TOUCH = 1e-6  # share of the tool's size within which rectangles touch


@dataclass(frozen=True)
class Neighbour:
    """A neighbour as a row lists it."""

    side: Side
    region: int
    length: float  # m
    angle: float | None  # rad, + where it is steeper than the row's own region


@dataclass(frozen=True)
class Box:
    """One region of the table, SI."""

    id: str
    x: float  # left edge
    y: float  # front edge
    width: float
    depth: float
    height: float
    curvature: float  # 1/m, + convex
    tilt_right: float  # rad, + rises to the right
    tilt_back: float  # rad, + rises to the back
    neighbours: tuple[Neighbour, ...] | None  # None: those whose rectangles touch
    corners: tuple[int, ...] | None  # None: those whose rectangles touch in a corner


def graph_of(boxes: list[Box]) -> tuple[RegionGraph, list[str]]:
    """The region graph of a table and a sentence for everything that does not fit together.

    Paper: definitions are those of meshes (feature set `clean`): shared length over perimeter, antisymmetric angles, curvature
    times the tool's size, height and area as shares.
    """
    low = np.array([[b.x, b.y] for b in boxes])
    high = low + np.array([[b.width, b.depth] for b in boxes])
    touching = _touching(low, high)
    listed = [_as_listed(a, box, touching[a]) for a, box in enumerate(boxes)]
    found = _faults(boxes, listed, touching, low, high)
    n = len(boxes)
    shared, angle, corner = np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n), bool)
    for a, mine in enumerate(listed):
        for entry in mine:
            shared[a, entry.region] += entry.length
            angle[a, entry.region] = _angle(boxes, a, entry, listed)
    neighbour = shared > 0
    for a, box in enumerate(boxes):
        own = np.flatnonzero(_corner_touch(low, high, a)) if box.corners is None else np.array(box.corners, int)
        corner[a, own[~neighbour[a, own]]] = True
    size = high - low
    perimeter = 2 * size.sum(axis=1)
    area, height = size.prod(axis=1), np.array([b.height for b in boxes])
    span = float(np.ptp(height))
    graph = RegionGraph(
        source="mesh",
        shared=shared / perimeter[:, None],
        opposite=_opposite(boxes, listed) / perimeter[:, None],
        angle=angle,
        neighbour=neighbour,
        corner=corner,
        first=np.array([mine[0].region if mine else -1 for mine in listed], np.int64),
        curvature=np.clip([b.curvature * np.sqrt(area.sum()) for b in boxes], -1, 1),
        height=(height - height.min()) / span if span else np.zeros(n),
        area=area / area.sum(),
        low=low,
        high=high,
    )
    return graph, found


def _touching(low: Array, high: Array) -> list[list[Neighbour]]:
    """Per region, the neighbours whose rectangles share part of a side."""
    near = TOUCH * float(np.ptp(np.concatenate([low, high]), axis=0).max())
    found: list[list[Neighbour]] = []
    for a in range(len(low)):
        mine = []
        for side in ORDER:
            along, across = (0, 1) if side in ("back", "front") else (1, 0)
            edge = high[a, across] if side in ("back", "right") else low[a, across]
            facing = low[:, across] if side in ("back", "right") else high[:, across]
            common = np.minimum(high[a, along], high[:, along]) - np.maximum(low[a, along], low[:, along])
            others = np.flatnonzero((np.abs(facing - edge) <= near) & (common > near))
            mine += [Neighbour(side, int(b), float(common[b]), None) for b in others if b != a]
        found.append(mine)
    return found


def _corner_touch(low: Array, high: Array, a: int) -> NDArray[np.bool_]:
    """Regions whose rectangles touch that of `a` in one point only."""
    near = TOUCH * float(np.ptp(np.concatenate([low, high]), axis=0).max())
    common = np.minimum(high[a], high) - np.maximum(low[a], low)
    return np.asarray((np.abs(common) <= near).all(axis=1))


def _as_listed(a: int, box: Box, touching: list[Neighbour]) -> list[Neighbour]:
    """The row's own neighbours, clockwise from the back; those that touch where it lists none."""
    if box.neighbours is None:
        return touching
    return sorted((e for e in box.neighbours if e.region != a), key=lambda e: ORDER.index(e.side))


def _angle(boxes: list[Box], a: int, entry: Neighbour, listed: list[list[Neighbour]]) -> float:
    """The listed angle; else the other row's, negated; else how much steeper the neighbour is."""
    if entry.angle is not None:
        return entry.angle
    back = next((e.angle for e in listed[entry.region] if e.region == a and e.angle is not None), None)
    if back is not None:
        return -back
    return _steepness(boxes[entry.region]) - _steepness(boxes[a])


def _steepness(box: Box) -> float:
    """Angle between the region's normal and straight up, rad."""
    return float(np.arctan(np.hypot(np.tan(box.tilt_right), np.tan(box.tilt_back))))


def _opposite(boxes: list[Box], listed: list[list[Neighbour]]) -> Array:
    """Length of the neighbours on the side across from one that lies at the tool's edge."""
    opposite = np.zeros((len(boxes), len(boxes)))
    for a, (box, mine) in enumerate(zip(boxes, listed, strict=True)):
        for i, side in enumerate(ORDER):
            length = box.width if side in ("back", "front") else box.depth
            if sum(e.length for e in mine if e.side == side) < (1 - EQUAL) * length:
                for entry in mine:
                    if entry.side == ORDER[(i + 2) % 4]:
                        opposite[a, entry.region] += entry.length
    return opposite


def _faults(boxes: list[Box], listed: list[list[Neighbour]], touching: list[list[Neighbour]], low: Array, high: Array) -> list[str]:
    found: list[str] = []
    for a, box in enumerate(boxes):
        for entry in box.neighbours or ():
            if entry.region == a:
                found.append(f"Row {box.id}: lists itself as a neighbour; left out.")
        found += _faults_of_row(boxes, a, listed)
        if box.neighbours is not None:
            missing = {e.region for e in touching[a]} - {e.region for e in listed[a]}
            found += [f"Row {box.id}: touches {boxes[b].id} but doesn't list it as a neighbour." for b in sorted(missing)]
        for b in box.corners or ():
            other = boxes[b].corners
            if other is not None and a not in other:
                found.append(f"Row {box.id}: lists {boxes[b].id} as a corner neighbour, but row {boxes[b].id} doesn't list {box.id}.")
        for b in range(a):
            common = np.minimum(high[a], high[b]) - np.maximum(low[a], low[b])
            if (common > TOUCH * float(np.ptp(np.concatenate([low, high])))).all():
                found.append(f"Rows {boxes[b].id} and {box.id}: their rectangles overlap by {1e6 * common.prod():g} mm².")
    return found


def _faults_of_row(boxes: list[Box], a: int, listed: list[list[Neighbour]]) -> list[str]:
    found, name = [], boxes[a].id
    for side in ORDER:
        length = boxes[a].width if side in ("back", "front") else boxes[a].depth
        total = sum(e.length for e in listed[a] if e.side == side)
        if total > (1 + EQUAL) * length:
            found.append(f"Row {name}: the neighbours at the {side} take {1000 * total:g} mm of a side that is {1000 * length:g} mm long.")
    for entry in listed[a]:
        b, other = entry.region, boxes[entry.region].id
        back = [e for e in listed[b] if e.region == a]
        if not back:
            found.append(f"Row {name}: lists {other} as a neighbour, but row {other} doesn't list {name}.")
        elif a < b:
            length, theirs = (sum(e.length for e in row if e.region == r) for row, r in ((listed[a], b), (listed[b], a)))
            if abs(length - theirs) > EQUAL * length:
                told = f"{1000 * length:g} mm in row {name} and {1000 * theirs:g} mm in row {other}"
                found.append(f"Rows {name} and {other}: their common border is {told}.")
            if entry.angle is not None and back[0].angle is not None and abs(entry.angle + back[0].angle) > EQUAL:
                told = f"{np.degrees(entry.angle):g} degrees in row {name} and {np.degrees(back[0].angle):g} in row {other}"
                found.append(f"Rows {name} and {other}: the angle between them is {told}; expected opposite signs.")
    return list(dict.fromkeys(found))
