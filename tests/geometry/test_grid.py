"""A shared grid over regions: cells of equal area, straight lines that run on into the neighbours, nothing lost."""

from collections import Counter

import numpy as np
import pytest

from app.errors import InvalidInput
from app.geometry.cleaning import areas, edge_table
from app.geometry.grid import grid_size, grid_split
from app.geometry.moulds import arc, straight, translational
from app.geometry.splitting import Surface
from tests.geometry.test_regions import surface as open_surface


def plate(columns: int = 2, rows: int = 1, fine: int = 4) -> Surface:
    """Level unit squares side by side; labels count column by column."""
    x, y = np.meshgrid(np.arange(columns * fine + 1) / fine, np.arange(rows * fine + 1) / fine, indexing="ij")
    i, j = np.meshgrid(np.arange(columns * fine) // fine, np.arange(rows * fine) // fine, indexing="ij")
    mesh, labels = open_surface(np.stack([x, y, np.zeros_like(x)], -1), i * rows + j)
    return Surface(
        mesh.vertices, mesh.faces.astype(np.int64), np.full(len(labels), -1, np.int32), labels.astype(np.int64), np.arange(len(labels))
    )


def cell_areas(cut: Surface) -> dict[int, float]:
    area = areas(cut.vertices, cut.faces)
    return {int(k): float(area[cut.labels == k].sum()) for k in np.unique(cut.labels)}


def test_a_plate_becomes_equal_cells_off_the_mesh_edges() -> None:
    cut = grid_split(plate(1), [0], 3, 5)
    assert sorted(cell_areas(cut)) == list(range(15))
    assert list(cell_areas(cut).values()) == pytest.approx([1 / 15] * 15)


def test_lines_run_on_from_a_region_into_its_neighbour() -> None:
    """Both regions get the same three rows: the lines y = 1/3 and 2/3 cross the border at one vertex each."""
    cut = grid_split(plate(2), [0, 1], 3, 2)
    assert list(cell_areas(cut).values()) == pytest.approx([1 / 3] * 6)
    for k in range(6):
        y = cut.vertices[np.unique(cut.faces[cut.labels == k])][:, 1]
        assert [y.min() * 3, y.max() * 3] == pytest.approx([round(y.min() * 3), round(y.max() * 3)])
        assert np.ptp(y) == pytest.approx(1 / 3)


def test_the_first_cell_keeps_the_number_and_stands_rear_left() -> None:
    cut = grid_split(plate(1), [0], 2, 2)
    middle = cut.vertices[np.unique(cut.faces[cut.labels == 0])].mean(axis=0)
    assert middle[0] < 0.5 < middle[1]


def test_borders_are_kept_or_joined() -> None:
    assert len(cell_areas(grid_split(plate(2), [0, 1], 1, 1))) == 2
    assert cell_areas(grid_split(plate(2), [0, 1], 1, 1, keep_borders=False)) == pytest.approx({0: 2.0})


def test_other_regions_and_the_closed_surface_stay() -> None:
    """Cutting one of two regions splits triangles of the other along the border only; no crack opens."""
    before = plate(2)
    cut = grid_split(before, [1], 3, 3)
    assert cell_areas(cut)[0] == pytest.approx(1)
    border = Counter(edge_table(cut.faces)[2].tolist())
    assert set(border) == {1, 2}
    assert areas(cut.vertices, cut.faces).sum() == pytest.approx(2)
    pieces = np.bincount(cut.source, weights=areas(cut.vertices, cut.faces))
    assert pieces == pytest.approx(areas(before.vertices, before.faces))


def test_a_curved_region_is_cut_into_equal_areas() -> None:
    mesh, labels = open_surface(*translational(arc(0.4, 1, np.radians(-70)), straight(0.5, 1)))
    start = Surface(
        mesh.vertices, mesh.faces.astype(np.int64), np.full(len(labels), -1, np.int32), labels.astype(np.int64), np.arange(len(labels))
    )
    cut = grid_split(start, [0], 2, 3)
    total = areas(mesh.vertices, mesh.faces).sum()
    assert list(cell_areas(cut).values()) == pytest.approx([total / 6] * 6, rel=0.01)


@pytest.mark.parametrize(
    ("columns", "cells", "aspect", "expected"), [(2, 8, 1, (2, 4)), (2, 8, 2, (2, 4)), (1, 4, 4, (4, 1)), (3, 3, 1, (1, 3))]
)
def test_size_and_aspect_choose_the_grid(columns: int, cells: int, aspect: float, expected: tuple[int, int]) -> None:
    rows, across = grid_size(plate(columns), list(range(columns)), cells, aspect)
    if aspect == 2:  # 2 x 1 plate in cells twice as wide as deep: 3 x 3 is nearest to 8 with that shape
        assert (columns / across) / (1 / rows) == pytest.approx(2, rel=0.4)
    else:
        assert (rows, across) == expected


def test_wrong_orders_are_refused() -> None:
    with pytest.raises(InvalidInput, match="no region 7"):
        grid_split(plate(), [7], 2, 2)
    with pytest.raises(InvalidInput, match="at least one"):
        grid_split(plate(), [], 2, 2)
    with pytest.raises(InvalidInput, match="1 to 20"):
        grid_split(plate(), [0], 0, 2)


def rolled(turn: float, radius: float = 2.0, cone: float = 0.0) -> Surface:
    """Part of a cylinder (a cone with `cone` > 0) about the y axis, 3 long, its middle on top."""
    angle, y = np.meshgrid(np.linspace(-turn / 2, turn / 2, 61), np.linspace(0, 3, 31), indexing="ij")
    r = radius + cone * y
    mesh, labels = open_surface(np.stack([r * np.sin(angle), y, r * np.cos(angle)], -1), np.zeros((60, 30), int))
    return Surface(
        mesh.vertices, mesh.faces.astype(np.int64), np.full(len(labels), -1, np.int32), labels.astype(np.int64), np.arange(len(labels))
    )


@pytest.mark.parametrize("cone", [0.0, 0.3])
def test_a_round_region_is_cut_unrolled(cone: float) -> None:
    """200 degrees in 5 columns: each spans 40 degrees of arc, also where it hangs over; by straight cuts they would differ."""
    cut = grid_split(rolled(np.radians(200), cone=cone), [0], 1, 5)
    spans = []
    for k in range(5):
        x, _, z = cut.vertices[np.unique(cut.faces[cut.labels == k])].T
        angle = np.degrees(np.arctan2(x, z))
        spans.append([angle.min(), angle.max()])
    assert np.sort(spans, axis=0) == pytest.approx(np.array([[-100 + 40 * k, -60 + 40 * k] for k in range(5)]), abs=0.3)


def test_a_ring_is_cut_all_around() -> None:
    cut = grid_split(rolled(np.radians(359.9)), [0], 2, 4)
    total = areas(cut.vertices, cut.faces).sum()
    assert list(cell_areas(cut).values()) == pytest.approx([total / 8] * 8, rel=0.01)


def test_lines_around_a_cylinder_meet_those_of_the_plane_beside_it() -> None:
    """Plane and cylinder of the same length along the axis: both have their three rows at the same y."""
    flat, bent = plate(1), rolled(np.radians(90))
    for surface in (flat, bent):
        cut, long = grid_split(surface, [0], 3, 1), float(np.ptp(surface.vertices[:, 1]))
        for k in range(3):
            y = cut.vertices[np.unique(cut.faces[cut.labels == k])][:, 1] / long * 3
            assert sorted([y.min(), y.max()]) == pytest.approx([2 - k, 3 - k], abs=1e-2)
