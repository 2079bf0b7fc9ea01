"""Cut large regions into near-equal parts by planes; triangles are split where a plane runs, so borders are straight.

A region is cut in the rectangle that encloses it most tightly: first into rows, then the rows into columns, where it can along
planes that a larger region was cut along before, so that rows line up. Every triangle at
a new vertex is split on both sides of its edge, so a closed solid stays closed.

Paper: Sec. V's regions aren't only primitives: the real tools have rows of identical patches on one surface.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from app.geometry.borders import smallest_rectangle
from app.geometry.cleaning import areas, diagonal, face_pairs, joined, shared_length
from app.geometry.compiled import kernel
from app.geometry.slicing import at_new_vertices, subdivide
from app.geometry.tool import Array

Integers = NDArray[np.int64]
ON_PLANE = 1e-5  # share of the diagonal of the surface that is cut within which a vertex lies on the cutting plane
LARGE = 0.2  # regions with a larger share of the working surface are cut
SCRAP = 0.35  # pieces below this share of an equal part go to the piece they share most border with
UNEVEN = 0.5  # what rows of different length cost, against the log aspect of a part and the log of too many parts
MOST_EXTRA = 2
ALIGNED = 0.4  # what rows are worth that line up with those of a region cut before
PARALLEL = np.cos(np.radians(2))
FITTING = (0.75, 1.33)  # area of a part between such planes over that of an equal one
SWEEP = 257  # places at which the area before is known
ROUNDS = 4  # scraps leave fewer parts than planned; so often we cut again


@dataclass(frozen=True)
class Surface:
    """A triangle mesh with what each triangle belongs to."""

    vertices: Array  # (V, 3) metres
    faces: Integers  # (F, 3)
    cad_face: NDArray[np.int32]  # (F,) -1 without
    labels: Integers  # (F,) region, -1 outside the working surface
    source: Integers  # (F,) face of the part that this one is, or is a piece of

    def shares(self) -> Array:
        """Area of each region over that of all (N,)."""
        inside = self.labels >= 0
        area = np.bincount(self.labels[inside], weights=areas(self.vertices, self.faces)[inside])
        return area / area.sum()


def split_large(surface: Surface, least: int, most: int, large: float = LARGE) -> Surface:
    """Cut the largest regions until there are `least` and none has a larger share than `large`, but never more than `most`."""
    known: list[Planes] = []
    for _ in range(ROUNDS):
        shares = surface.shares()
        parts = _parts(shares, least, most, large)
        if (parts == 1).all():
            break
        room = most - int(parts.sum())
        for region in np.argsort(-shares, kind="stable"):
            if parts[region] == 1:
                continue
            apart = _taken_out(surface, int(region))
            free = int(surface.labels.max()) + 1
            near, extra, planes = _split(apart.near, int(region), int(parts[region]), min(room, MOST_EXTRA), free, known)
            surface = _put_back(surface, replace(apart, near=near))
            known += planes
            room -= extra
    return surface


@dataclass(frozen=True)
class Planes:
    """Parallel planes along which a region is cut."""

    normal: Array  # (3,) unit
    offsets: Array  # (K,) ascending, m


@dataclass(frozen=True)
class _Apart:
    """A region with the faces that touch it, as a surface of its own: cutting the few is quicker than cutting all."""

    near: Surface
    others: NDArray[np.bool_]  # (F,) faces of the whole surface that are not in it
    vertices: Integers  # vertex of the whole surface that each of its first vertices is


def _taken_out(surface: Surface, region: int) -> _Apart:
    mark = np.zeros(len(surface.vertices), bool)
    mark[surface.faces[surface.labels == region]] = True
    a, b, c = mark[surface.faces].T
    near: NDArray[np.bool_] = a | b | c
    faces = surface.faces[near]
    mark[faces] = True
    number = np.cumsum(mark) - 1
    small = Surface(surface.vertices[mark], number[faces], surface.cad_face[near], surface.labels[near], surface.source[near])
    return _Apart(small, ~near, np.flatnonzero(mark))


def _put_back(whole: Surface, apart: _Apart) -> Surface:
    """The whole surface again; new vertices come behind the old ones."""
    near, others, known = apart.near, apart.others, len(apart.vertices)
    number = np.concatenate([apart.vertices, len(whole.vertices) + np.arange(len(near.vertices) - known)])
    return Surface(
        np.concatenate([whole.vertices, near.vertices[known:]]),
        np.concatenate([whole.faces[others], number[near.faces]]),
        np.concatenate([whole.cad_face[others], near.cad_face]),
        np.concatenate([whole.labels[others], near.labels]),
        np.concatenate([whole.source[others], near.source]),
    )


def connected(group: NDArray[np.integer], pairs: Integers) -> Integers:
    """Number of the connected piece of equal `group` that each face lies in."""
    return joined(pairs[group[pairs[:, 0]] == group[pairs[:, 1]]], len(group))


def cut_by_plane(surface: Surface, region: int, normal: Array, offset: float, ahead: NDArray[np.bool_] | None = None) -> Surface:
    """Split the triangles of `region` along the plane normal . x = offset, and their neighbours at the new vertices.

    With `ahead` (V,) only edges between two such vertices are split: a half plane cuts, not a plane.
    """
    height = surface.vertices @ normal - offset
    height[np.abs(height) < ON_PLANE * diagonal(surface.vertices)] = 0
    total = len(surface.vertices)
    crossed = np.unique(_crossed(surface.faces, surface.labels, region, height, np.ones(0, bool) if ahead is None else ahead))
    if len(crossed) == 0:
        return surface
    low, high = crossed // total, crossed % total
    along = height[low] / (height[low] - height[high])
    points = surface.vertices[low] + along[:, None] * (surface.vertices[high] - surface.vertices[low])
    middle = at_new_vertices(surface.faces, low, high, total)
    vertices = np.concatenate([surface.vertices, points])
    faces, source = subdivide(surface.faces, middle, vertices)
    return Surface(vertices, faces, surface.cad_face[source], surface.labels[source], surface.source[source])


@kernel
def _crossed(faces, labels, region, height, ahead):  # pragma: no cover - compiled
    """Edges (lower vertex * vertices + higher one) of a region whose ends have different signs, once per side."""
    found, count = np.empty(2 * len(faces), np.int64), 0
    for f in range(len(faces)):
        if labels[f] != region:
            continue
        for k in range(3):
            a, b = faces[f, k], faces[f, (k + 1) % 3]
            if height[a] * height[b] < 0 and (len(ahead) == 0 or (ahead[a] and ahead[b])):
                found[count] = min(a, b) * len(height) + max(a, b)
                count += 1
    return found[:count]


def _parts(shares: Array, least: int, most: int, large: float) -> Integers:
    """Into how many parts each region is cut (N,): always one more for the largest parts."""
    parts = np.ones(len(shares), np.int64)
    while parts.sum() < most and (parts.sum() < least or (shares / parts).max() > large):
        parts[np.argmax(shares / parts)] += 1
    return parts


def _split(surface: Surface, region: int, parts: int, spare: int, free: int, known: Sequence[Planes]) -> tuple[Surface, int, list[Planes]]:
    """Cut one region into parts named from `free` on, up to `spare` more when that fits better; also how many more, and where."""
    frame, size = rectangle(surface, region)
    like = [_in_line(surface, region, side, parts + spare, known) for side in frame]
    planned, rows = _layout(parts, size[0] / max(size[1], 1e-9 * size[0]), spare, [[p is not None for p in side] for side in like])
    per_row = [planned // rows + (r < planned % rows) for r in range(rows)]
    surface, marked = _cut_along(
        surface, region, frame[0], np.cumsum(per_row)[:-1] / planned, like[0][rows] if planned % rows == 0 else None
    )
    used = [marked]
    if planned % rows == 0:
        surface, columns = _cut_along(surface, region, frame[1], np.arange(1, per_row[0]) / per_row[0], like[1][per_row[0]])
        inside = surface.labels == region
        cells = _cell(surface, inside, marked) * per_row[0] + _cell(surface, inside, columns)
        used.append(columns)
    else:
        surface, cells = _cut_rows(surface, region, frame, marked, per_row)
    return _gather(surface, region, cells, planned, free), planned - parts, [p for p in used if len(p.offsets)]


def _in_line(surface: Surface, region: int, direction: Array, most: int, known: Sequence[Planes]) -> list[Planes | None]:
    """For 0, 1, ... `most` parts, planes across a direction that are known already and cut a region into about equal ones."""
    found: list[Planes | None] = [None] * (most + 1)
    faces = surface.faces[surface.labels == region]
    for planes in known:
        if abs(planes.normal @ direction) < PARALLEL:
            continue
        corners, area = (surface.vertices @ planes.normal)[faces], areas(surface.vertices, faces)
        grid = np.linspace(corners.min(), corners.max(), SWEEP)
        before = np.interp(planes.offsets, grid, _area_before(corners, area, grid) / area.sum())
        for count in range(2, most + 1):
            nearest = np.abs(before[:, None] - np.arange(1, count) / count).argmin(axis=0)
            share = np.diff([0.0, *before[nearest], 1.0]) * count
            if found[count] is None and FITTING[0] <= share.min() and share.max() <= FITTING[1]:
                found[count] = Planes(planes.normal, planes.offsets[nearest])
    return found


def _cut_rows(surface: Surface, region: int, frame: Array, marked: Planes, per_row: list[int]) -> tuple[Surface, Integers]:
    """Cut rows of different length into columns each; the surface and the cell of each face of the region."""
    aside = int(surface.labels.max()) + 1
    inside = surface.labels == region
    labels = surface.labels.copy()
    labels[inside] = aside + _cell(surface, inside, marked)
    surface = replace(surface, labels=labels)
    cell = np.full(len(labels), -1, np.int64)
    for r, n in enumerate(per_row):
        surface, columns = _cut_along(surface, aside + r, frame[1], np.arange(1, n) / n)
        per_row_columns = _cell(surface, surface.labels == aside + r, columns)
        labels = surface.labels.copy()
        labels[surface.labels == aside + r] = aside + len(per_row) + sum(per_row[:r]) + per_row_columns
        surface = replace(surface, labels=labels)
    inside = surface.labels >= aside
    cell = surface.labels[inside] - aside
    return replace(surface, labels=np.where(inside, region, surface.labels)), cell


def _cut_along(surface: Surface, region: int, direction: Array, fractions: Array, given: Planes | None = None) -> tuple[Surface, Planes]:
    """Cut a region along the given planes, or where the given fractions of its area lie before; also the planes."""
    if given is None:
        faces = surface.faces[surface.labels == region]
        given = Planes(direction, quantiles((surface.vertices @ direction)[faces], areas(surface.vertices, faces), fractions))
    for offset in given.offsets:
        surface = cut_by_plane(surface, region, given.normal, float(offset))
    return surface, given


def quantiles(corners: Array, area: Array, fractions: Array) -> Array:
    """Positions with the given fractions of the area before, by a sweep that spreads each triangle from end to end."""
    grid = np.linspace(corners.min(), corners.max(), SWEEP)
    return np.interp(fractions * area.sum(), _area_before(corners, area, grid), grid)


@kernel
def _area_before(corners, area, grid):  # pragma: no cover - compiled
    """Area of triangles with corner positions (F, 3) before each place of the grid, which is even."""
    before, whole = np.zeros(len(grid)), np.zeros(len(grid) + 1)
    steps = (len(grid) - 1) / max(grid[-1] - grid[0], 1e-300)
    for f in range(len(area)):
        u, v, w = corners[f]
        first, last = min(u, v, w), max(u, v, w)
        middle = u + v + w - first - last
        k = min(max(int((first - grid[0]) * steps), 0), len(grid) - 1)
        while k > 0 and grid[k - 1] >= first:
            k -= 1
        while k < len(grid) and grid[k] < first:
            k += 1
        while k < len(grid) and grid[k] < last:
            x = grid[k]
            if x <= middle and middle > first:
                before[k] += area[f] * (x - first) ** 2 / ((last - first) * (middle - first))
            elif x > middle:
                before[k] += area[f] * (1 - (last - x) ** 2 / ((last - first) * (last - middle)))
            k += 1
        whole[k] += area[f]
    return before + np.cumsum(whole)[:-1]


def _cell(surface: Surface, inside: NDArray[np.bool_], planes: Planes) -> Integers:
    """Number of planes before the middle of each chosen face."""
    a, b, c = (surface.vertices @ planes.normal)[surface.faces[inside]].T
    return np.searchsorted(planes.offsets, (a + b + c) / 3).astype(np.int64)


def rectangle(surface: Surface, region: int) -> tuple[Array, Array]:
    """The two sides of the tightest rectangle around a region, longer first, as unit vectors (2, 3), and their lengths."""
    faces = surface.faces[surface.labels == region]
    weight = np.bincount(faces.ravel(), np.repeat(areas(surface.vertices, faces), 3))
    used = np.flatnonzero(weight)
    corners, weight = surface.vertices[used], weight[used]
    middle = weight @ corners / weight.sum()
    _, axes = np.linalg.eigh((corners - middle).T * weight @ (corners - middle))
    plane = axes[:, :0:-1].T  # the two widest directions
    flat = (corners - middle) @ plane.T
    axes, sides = smallest_rectangle(flat)
    order = np.argsort(-sides)
    return axes[order] @ plane, sides[order]


def _layout(parts: int, aspect: float, spare: int, like: Sequence[Sequence[bool]]) -> tuple[int, int]:
    """Number of parts and of rows across the long side that make the parts squarest, rows `like` others preferred."""

    def effort(planned: int, rows: int) -> float:
        squareness, even = abs(np.log(aspect / rows * (planned / rows))), planned % rows == 0
        aligned = even and (like[0][rows] or like[1][planned // rows])
        return float(squareness + UNEVEN * (not even) + np.log(planned / parts) - ALIGNED * aligned)

    choices = [(planned, rows) for planned in range(parts, parts + 1 + spare) for rows in range(1, planned + 1)]
    return min(choices, key=lambda c: effort(*c))


def _gather(surface: Surface, region: int, cells: Integers, parts: int, free: int) -> Surface:
    """Label the connected pieces of the cells; scraps go to the piece of this region they share most border with."""
    inside = np.flatnonzero(surface.labels == region)
    faces = surface.faces[inside]
    pairs = face_pairs(faces)
    piece = connected(cells, pairs)
    area = areas(surface.vertices, faces)
    between = pairs[piece[pairs[:, 0]] != piece[pairs[:, 1]]]
    length = shared_length(surface.vertices, faces, between)
    while True:
        size = np.bincount(piece, weights=area)
        least = int(np.argmin(size))
        if len(size) == 1 or (len(size) <= parts and size[least] >= SCRAP * area.sum() / parts):
            break
        a, b = piece[between].T
        touching = (a == least) != (b == least)
        border = np.bincount(np.where(a == least, b, a)[touching], weights=length[touching], minlength=len(size))
        piece = np.where(piece == least, int(np.argmax(border)), piece)
        piece -= piece > least
    labels = surface.labels.copy()
    labels[inside] = np.where(piece == 0, region, free - 1 + piece)
    return replace(surface, labels=labels)
