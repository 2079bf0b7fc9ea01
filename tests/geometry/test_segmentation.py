"""Segmentation against surfaces whose primitives are known, and on public CAD files."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

from app.benches.composites import noisy, rand_index, strip
from app.geometry.cad_faces import CadFace
from app.geometry.cleaning import CleaningReport
from app.geometry.editing import merge
from app.geometry.exact_shapes import CadSurfaces, exact_shapes
from app.geometry.importing import ImportedPart, load_part
from app.geometry.moulds import Piece, solid, straight, trace, translational
from app.geometry.regions import measure
from app.geometry.segmentation import SegmentationParameters, find_patches, part_tree, segment
from app.geometry.splitting import Surface, split_large
from app.geometry.tool import Mesh
from tests.conftest import shared
from tests.geometry.test_regions import surface

BEND = np.radians(60)
TRUE_PARTS = 5  # plane, concave cylinder, plane, convex cylinder, plane


def composite() -> tuple[Mesh, NDArray[np.int32]]:
    """Planes and cylinders in a row, borders on mesh edges; the label is the primitive, -1 outside."""
    pieces = (Piece(0, 0.12), Piece(1, 0.10, BEND), Piece(2, 0.10), Piece(3, 0.10, -BEND), Piece(4, 0.12))
    return solid(*translational(trace(pieces), straight(0.2, 1)))


def part_of(mesh: Mesh) -> ImportedPart:
    return ImportedPart(mesh, np.full(len(mesh.faces), -1, np.int32), CleaningReport(()))


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


def test_a_scan_is_cut_where_its_primitives_end() -> None:
    """0.05 % of the diagonal of noise; smooth joints, no creases: without the switch the borders are ragged."""
    rng = np.random.default_rng(1)
    scanned = strip(6000, rng)
    areas = trimesh.triangles.area(scanned.mesh.vertices[scanned.mesh.faces])
    rough = part_of(noisy(scanned.mesh, 5e-4, rng))
    index = {}
    for denoise in (False, True):
        cut = segment(rough, SegmentationParameters(target=5, denoise=denoise, minimum_area=0.01))
        index[denoise] = rand_index(cut.labels, scanned.truth, areas)
    assert index[True] > 0.95 > index[False]


def test_fillets_are_absorbed_on_request() -> None:
    """Two planes and a rounding of 24 mm between them: three primitives, two without the rounding."""
    mesh, _ = solid(*translational(trace((Piece(0, 0.2), Piece(1, 0.024, BEND), Piece(2, 0.2))), straight(0.2, 1)))
    found = {}
    for absorb in (False, True):
        cut = segment(part_of(mesh), SegmentationParameters(minimum_area=1e-4, absorb_fillets=absorb, most=40))
        solid_part = trimesh.Trimesh(cut.part.mesh.vertices, cut.part.mesh.faces, process=False)
        regions = [cut.labels == k for k in range(cut.labels.max() + 1)]
        means = [np.average(solid_part.face_normals[r, 2], weights=solid_part.area_faces[r]) for r in regions]
        found[absorb] = sum(0.6 < mean < 0.95 for mean in means)  # level is 1, the slope 0.5
    assert found[False] > 0
    assert found[True] == 0


@pytest.mark.parametrize(("name", "units", "up"), [("1002_tray_bottom.STL", "mm", "+y"), ("naca0012.stl", "m", "+z")])
def test_paper_like_regions_are_similar(name: str, units: str, up: str) -> None:
    part = load_part(shared("cad", name), name, units, up)
    cut = segment(part, SegmentationParameters(preset="paper-like"))
    areas = trimesh.triangles.area(cut.part.mesh.vertices[cut.part.mesh.faces])
    size = np.bincount(cut.labels[cut.labels >= 0], weights=areas[cut.labels >= 0])
    assert 6 <= len(size) <= 14
    assert size.max() / size.sum() < 0.25


def test_a_kept_tree_gives_the_same_cut() -> None:
    part = part_of(composite()[0])
    first = segment(part, SegmentationParameters(target=7))
    again = segment(part, SegmentationParameters(target=7), tree=part_tree(part))
    assert (first.labels == again.labels).all()


def creased(turn: float) -> ImportedPart:
    """A level sheet of two CAD faces, then one that turns up by `turn`, then a wall of a cylinder of 0.1 m."""
    t = np.linspace(0, np.pi / 2, 13)
    flat = [(0.0, 0.0), (0.2, 0.0), (0.4, 0.0), (0.4 + 0.4 * np.cos(turn), 0.4 * np.sin(turn))]
    x, z = np.array([*flat, *zip(flat[-1][0] + 0.1 * np.sin(t[1:]), flat[-1][1] + 0.1 * (1 - np.cos(t[1:])), strict=True)]).T
    grid = np.stack([np.stack([x, np.full_like(x, y), z], -1) for y in (0.0, 0.2, 0.4)], axis=1)
    mesh, labels = surface(grid, np.repeat(np.minimum(np.arange(len(x) - 1), 3)[:, None], 2, axis=1))
    faces = (
        CadFace("plane", (0.1, 0.1, 0.0), (0.0, 0.0, 1.0)),
        CadFace("plane", (0.3, 0.3, 0.0), (0.0, 0.0, -1.0)),
        CadFace("plane", (flat[-1][0], 0.0, flat[-1][1]), (-np.sin(turn), 0.0, np.cos(turn))),
        CadFace("cylinder", (flat[-1][0], 0.0, flat[-1][1] + 0.1), (0.0, 1.0, 0.0), radius=0.1),
    )
    return ImportedPart(mesh, labels, CleaningReport(()), faces)


def test_cad_faces_on_one_surface_are_one_patch_and_others_are_not() -> None:
    """The first strip of the cylinder is within the tolerance of the plane beside it; to the CAD model it isn't on it."""
    part = creased(np.radians(5))
    found = find_patches(part, SegmentationParameters(), part_tree(part)).labels
    first = [np.unique(found[part.cad_face == k]).tolist() for k in range(4)]
    assert first[0] == first[1]
    assert sorted(first[1:]) == [[0], [1], [2]]
    alone = replace(part, cad_face=np.full_like(part.cad_face, -1), cad_faces=())
    fitted = find_patches(alone, SegmentationParameters(), part_tree(alone)).labels
    assert len(np.unique(fitted[part.cad_face == 3])) == 2


def test_regions_are_what_the_cad_model_says() -> None:
    """The cylinder with a strip of the plane beside it: no fit, but the model's radius; hollow upwards is negative."""
    part = creased(np.radians(10))
    together = np.where(part.cad_face == 0, 0, 1).astype(np.int32)
    cad = CadSurfaces(part.cad_face, part.cad_faces)
    folded, round_one = exact_shapes(part.mesh, np.where(part.cad_face == 3, 1, 0).astype(np.int32), cad)
    assert round_one == (-10.0, "cylinder")
    assert exact_shapes(part.mesh, together, cad) == ((0.0, "plane"), None)
    assert folded is not None
    assert folded[1] == "freeform"
    assert folded[0] < 0
    tool = measure(part.mesh, part.cad_face, cad)
    assert sorted(r.kind for r in tool.regions) == ["cylinder", "plane", "plane", "plane"]


def test_an_edit_leaves_what_other_regions_are() -> None:
    part = creased(np.radians(10))
    tool = measure(part.mesh, part.cad_face, CadSurfaces(part.cad_face, part.cad_faces))
    given = tuple(replace(r, kind="cone", curvature=3.0) if r.kind == "cylinder" else r for r in tool.regions)
    after = merge(replace(tool, regions=given), [0, 1]).tool
    assert [(r.kind, r.curvature) for r in after.regions if r.curvature] == [("cone", 3.0)]
    assert after.n == 3


def test_panels_of_two_bands_line_up() -> None:
    """A band of 1 m x 0.3 m beside one of 1 m x 0.12 m whose middle lies elsewhere: cut alone, their borders wouldn't meet."""
    x, y = np.meshgrid(np.linspace(0, 1, 41), [0.0, 0.15, 0.3, 0.36, 0.42], indexing="ij")
    x = x + np.where(y > 0.35, 0.02 * x, 0)
    mesh, labels = surface(np.stack([x, y, np.zeros_like(x)], -1), np.tile([0, 0, 1, 1], (40, 1)))
    start = Surface(mesh.vertices, mesh.faces.astype(np.int64), np.full(len(labels), -1, np.int32), labels.astype(np.int64), labels)
    cut = split_large(start, 6, 14, 0.2)
    middle = cut.vertices[cut.faces].mean(axis=1)
    ends = []
    for band in (middle[:, 1] < 0.3, middle[:, 1] > 0.3):
        ends.append({round(float(cut.vertices[cut.faces[cut.labels == k], 0].max()), 6) for k in np.unique(cut.labels[band])})
    wide, narrow = (set(sorted(e)[:-1]) for e in ends)
    assert len(wide) >= 2
    assert narrow
    assert narrow <= wide


def test_a_square_becomes_even_rows() -> None:
    """Seven wanted at least: nine squares in three rows rather than rows of two, two and three."""
    x, y = np.meshgrid(np.linspace(0, 1, 13), np.linspace(0, 1, 13), indexing="ij")
    mesh, labels = surface(np.stack([x, y, np.zeros_like(x)], -1), np.zeros((12, 12), int))
    start = Surface(mesh.vertices, mesh.faces.astype(np.int64), np.full(len(labels), -1, np.int32), labels.astype(np.int64), labels)
    assert split_large(start, 6, 14, 0.16).shares() == pytest.approx(np.full(9, 1 / 9))
