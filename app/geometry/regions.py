"""Labelled mesh -> Tool: regions in reading order with their graph, attributes and descriptions (Sec. V)."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from app.errors import InvalidInput
from app.geometry.attributes import Attributes, Shape, find_attributes, nearest_middles, region_boxes
from app.geometry.borders import corner_neighbours, find_borders, opposite_lengths
from app.geometry.cleaning import face_pairs
from app.geometry.creases import creased
from app.geometry.descriptions import describe
from app.geometry.distances import surface_distances
from app.geometry.exact_shapes import CadSurfaces, exact_shapes
from app.geometry.fitting import NORMAL_WEIGHT, add_up, face_sums
from app.geometry.main_faces import facing
from app.geometry.merging import absorb_small, build_tree
from app.geometry.plan_frame import plan_boxes
from app.geometry.splitting import Surface, split_large
from app.geometry.tool import Array, Mesh, Region, RegionGraph, Tool, region_letters

ROW_OVERLAP = 0.5  # share of the smaller region's depth that two regions of one row have in common


def measure(mesh: Mesh, labels: NDArray[np.int32], cad: CadSurfaces | None = None) -> Tool:
    """Build the tool of a segmented mesh.

    Args:
        mesh: The whole part.
        labels: (F,) any numbers >= 0 per region, -1 outside the working surface; each region connected.
        cad: The CAD model's own surfaces, where the mesh comes from one.

    Returns:
        The tool; its regions are renumbered row by row from the rear left, so region i has the i-th letter.

    Raises:
        InvalidInput: The labels don't fit the mesh or name no region.
    """
    if labels.shape != (len(mesh.faces),) or not (labels >= 0).any():
        raise InvalidInput("The segmentation names no region of this mesh.")
    inside = labels >= 0
    compact = np.full(len(labels), -1, np.int32)
    compact[inside] = np.unique(labels[inside], return_inverse=True)[1].ravel()
    rank = np.argsort(reading_order(*_plan_boxes(mesh, compact)))
    ordered = np.where(inside, rank[compact], -1).astype(np.int32)
    return measure_labelled(mesh, ordered, shapes=None if cad is None else exact_shapes(mesh, ordered, cad))


def measure_labelled(
    mesh: Mesh, labels: NDArray[np.int32], names: Sequence[str] | None = None, shapes: Sequence[Shape | None] | None = None
) -> Tool:
    """Build the tool of a mesh whose regions are numbered 0, 1, ... already.

    Args:
        mesh: The whole part.
        labels: (F,) region of each face, -1 outside the working surface.
        names: What the regions are called; letters without.
        shapes: Curvature and kind of the regions of which they are known; all others are fitted.
    """
    attributes = find_attributes(mesh, labels, shapes)
    graph = _graph(mesh, labels, attributes)
    return Tool(mesh, labels, _regions(attributes, names), graph)


def _plan_boxes(mesh: Mesh, labels: NDArray[np.int32]) -> tuple[Array, Array]:
    """Lower and upper corner (n, 2) of every region's box in plan view."""
    low, high = region_boxes(mesh.vertices, mesh.faces, labels, int(labels.max()) + 1)
    return low[:, :2], high[:, :2]


def reading_order(low: Array, high: Array) -> NDArray[np.int64]:
    """Regions (n,) row by row from the rear (+y), each row from left (-x) to right.

    A row holds every remaining region that overlaps the rearmost one by more than half of the smaller depth.
    """
    left = list(range(len(low)))
    order: list[int] = []
    while left:
        lead = max(left, key=lambda i: (round(high[i, 1], 9), -low[i, 0]))
        row = [i for i in left if i == lead or _overlap(low[i, 1], high[i, 1], low[lead, 1], high[lead, 1]) > ROW_OVERLAP]
        row.sort(key=lambda i: (round(low[i, 0] + high[i, 0], 9), -high[i, 1], i))
        order += row
        left = [i for i in left if i not in row]
    return np.array(order)


def _overlap(a0: float, a1: float, b0: float, b1: float) -> float:
    """Common part of two intervals / the shorter one."""
    shorter = min(a1 - a0, b1 - b0)
    common = min(a1, b1) - max(a0, b0)
    return common / shorter if shorter > 1e-12 else float(common >= 0)


def _graph(mesh: Mesh, labels: NDArray[np.int32], attributes: Attributes) -> RegionGraph:
    n = len(attributes.area)
    borders = find_borders(mesh, labels)
    shared = borders.shared(n)
    perimeter = borders.perimeter(n)[:, None]
    neighbour = shared > 0
    tilt = np.arccos(np.clip(facing(mesh, labels, attributes.kind, attributes.normal)[:, 2], -1, 1))
    total, plan = attributes.area.sum(), _plan_area(attributes)
    height, top = attributes.high[:, 2], attributes.high[:, 2].max()
    depth = top - attributes.low[:, 2].min()
    low, high = plan_boxes(mesh, labels, n)
    return RegionGraph(
        source="mesh",
        shared=_divide(shared, perimeter),
        opposite=_divide(opposite_lengths(mesh, borders, attributes.normal), perimeter),
        angle=np.where(neighbour, tilt[None, :] - tilt[:, None], 0.0),
        neighbour=neighbour,
        corner=corner_neighbours(mesh, labels, shared),
        first=np.where(neighbour.any(axis=1), neighbour.argmax(axis=1), -1).astype(np.int64),
        curvature=np.clip(attributes.curvature * np.sqrt(total), -1, 1),
        height=1 - (top - height) / depth if depth > 1e-9 * np.sqrt(total) else np.ones(n),
        area=plan / plan.sum(),
        low=low / np.sqrt(plan.sum()),
        high=high / np.sqrt(plan.sum()),
    )


def _plan_area(attributes: Attributes) -> Array:
    """Areas seen from above; an upright sheet has none, so its true areas stand in."""
    return attributes.projected if attributes.projected.sum() > 1e-6 * attributes.area.sum() else attributes.area


def _divide(matrix: Array, perimeter: Array) -> Array:
    """Rows over perimeters; a closed surface that is one region has no border at all."""
    return np.divide(matrix, perimeter, out=np.zeros_like(matrix), where=perimeter > 0)


def _regions(attributes: Attributes, names: Sequence[str] | None) -> tuple[Region, ...]:
    rows = zip(names or region_letters(len(attributes.area)), describe(attributes), strict=True)
    return tuple(
        Region(
            name=name,
            description=description,
            centroid=attributes.centroid[i],
            normal=attributes.normal[i],
            area=float(attributes.area[i]),
            curvature=float(attributes.curvature[i]),
            kind=attributes.kind[i],
        )
        for i, (name, description) in enumerate(rows)
    )


def warm_up() -> None:
    """Compile the fitting kernels, or load them from the cache, before somebody waits for them."""
    vertices = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.1], [1.0, 1.0, 0.0], [0.0, 1.0, 0.2]])
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    sums, pairs = face_sums(vertices, faces), face_pairs(faces)
    tree = build_tree(sums, np.arange(2), pairs, lambda _: None)
    tree.children_of(tree.cut(1, tolerance=0.1), 0)
    absorb_small(sums, pairs, 0.1, 1, NORMAL_WEIGHT)
    add_up(sums, np.arange(2))
    split_large(Surface(vertices, faces, np.full(2, -1, np.int32), np.zeros(2, np.int64), np.arange(2)), 2, 2)
    tool = measure(Mesh(vertices, faces.astype(np.int32)), np.zeros(2, np.int32))
    nearest_middles(tool.mesh, tool.labels, vertices[:1])
    creased(tool.mesh, tool.labels)
    surface_distances(Mesh(vertices, faces.astype(np.int32)), np.zeros(2, np.int32), vertices[:1])
