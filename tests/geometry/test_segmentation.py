"""Segmentation against surfaces whose primitives are known, and on public CAD files."""

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

from app.geometry.cleaning import CleaningReport
from app.geometry.importing import ImportedPart, load_part
from app.geometry.moulds import Piece, solid, straight, trace, translational
from app.geometry.segmentation import SegmentationParameters, segment
from app.geometry.tool import Mesh
from tests.conftest import shared

BEND = np.radians(60)
TRUE_PARTS = 5  # plane, concave cylinder, plane, convex cylinder, plane


def composite() -> tuple[Mesh, NDArray[np.int32]]:
    """Planes and cylinders in a row, borders on mesh edges; the label is the primitive, -1 outside."""
    pieces = (Piece(0, 0.12), Piece(1, 0.10, BEND), Piece(2, 0.10), Piece(3, 0.10, -BEND), Piece(4, 0.12))
    return solid(*translational(trace(pieces), straight(0.2, 1)))


def part_of(mesh: Mesh) -> ImportedPart:
    return ImportedPart(mesh, np.full(len(mesh.faces), -1, np.int32), CleaningReport(()))


def rand_index(a: NDArray[np.int32], b: NDArray[np.int32], weight: NDArray[np.float64]) -> float:
    """Area-weighted adjusted Rand index (Hubert and Arabie 1985, counts replaced by areas)."""
    table = np.zeros((a.max() + 1, b.max() + 1))
    np.add.at(table, (a, b), weight)
    table /= table.sum()
    both, rows, columns = (table**2).sum(), (table.sum(1) ** 2).sum(), (table.sum(0) ** 2).sum()
    return (both - rows * columns) / ((rows + columns) / 2 - rows * columns)


def agreement(mesh: Mesh, found: NDArray[np.int32], truth: NDArray[np.int32]) -> float:
    areas = trimesh.triangles.area(mesh.vertices[mesh.faces])
    inside = (found >= 0) & (truth >= 0)
    assert areas[inside].sum() > 0.95 * areas[truth >= 0].sum()
    return rand_index(found[inside], truth[inside], areas[inside])


@pytest.mark.parametrize("change", ["none", "turned", "scaled", "shuffled", "far"])
def test_planes_and_cylinders_are_found(change: str) -> None:
    """Known optimum: five primitives and the four outer walls, whatever the pose, size and numbering of the part."""
    mesh, truth = composite()
    vertices, faces = mesh.vertices, mesh.faces
    if change == "turned":
        vertices = vertices @ trimesh.transformations.rotation_matrix(0.7, [0, 0, 1])[:3, :3].T
    elif change == "scaled":
        vertices = vertices * 1000
    elif change == "far":
        vertices = vertices + np.array([300.0, -200.0, 0.0])
    elif change == "shuffled":
        order = np.random.default_rng(3).permutation(len(faces))
        faces, truth = faces[order], truth[order]
    cut = segment(part_of(Mesh(vertices, faces)), SegmentationParameters(target=TRUE_PARTS + 4))
    assert len(cut.labels) == len(faces)
    assert agreement(cut.part.mesh, cut.labels, truth) > 0.99


def test_wrong_labels_would_be_noticed() -> None:
    mesh, truth = composite()
    shifted = np.where(truth >= 0, np.maximum(truth - 1, 0), -1).astype(np.int32)
    assert agreement(mesh, shifted, truth) < 0.9


@pytest.mark.parametrize(
    ("name", "units", "up"), [("featuretype.STEP", "m", "+z"), ("1002_tray_bottom.STL", "mm", "+y"), ("naca0012.stl", "m", "+z")]
)
def test_public_parts_become_tools_of_similar_regions(name: str, units: str, up: str) -> None:
    part = load_part(shared("cad", name), name, units, up)
    cut = segment(part, SegmentationParameters())
    n = int(cut.labels.max()) + 1
    assert 6 <= n <= 14
    mesh = trimesh.Trimesh(cut.part.mesh.vertices, cut.part.mesh.faces, process=False)
    areas = np.bincount(cut.labels[cut.labels >= 0], weights=mesh.area_faces[cut.labels >= 0])
    assert areas.max() < 0.4 * areas.sum()
    assert mesh.area == pytest.approx(trimesh.triangles.area(part.mesh.vertices[part.mesh.faces]).sum(), rel=1e-9)
    for region in range(n):
        faces = np.flatnonzero(cut.labels == region)
        pairs = mesh.face_adjacency[np.isin(mesh.face_adjacency, faces).all(axis=1)]
        assert len(trimesh.graph.connected_components(pairs, nodes=faces)) == 1
