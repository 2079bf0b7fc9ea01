"""What CAD files know that meshes don't: units, exact surfaces, colours, bodies; and what several bodies become."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from app.errors import InvalidInput, UnreadableMesh
from app.geometry import parser_process
from app.geometry.importing import ImportedPart, load_part, make_part, read_file
from app.geometry.parsed import ParsedFile
from tests.geometry.cad_files import bump, exported, glb, iges, step

METRES = {"mm": 1e-3, "cm": 1e-2, "m": 1.0, "in": 0.0254}
TWO = (((0.0, 0.0, 0.0), 50.0, 30.0), ((200.0, 0.0, 0.0), 20.0, 10.0))  # mm


def saved(folder: Path, data: bytes) -> Path:
    path = folder / "upload"
    path.write_bytes(data)
    return path


def sag(part: ImportedPart, radius: float) -> float:
    """Largest distance between the round side of the cylinder and its triangles, as a share of the diagonal."""
    vertices = part.mesh.vertices
    side = [k for k, face in enumerate(part.cad_faces) if face.kind == "cylinder"]
    corners = vertices[part.mesh.faces[np.isin(part.cad_face, side)]]
    middles = (corners + np.roll(corners, 1, axis=1)) / 2
    nearest = np.linalg.norm(middles[..., :2], axis=-1).min()
    return float((radius - nearest) / np.linalg.norm(np.ptp(vertices, axis=0)))


@pytest.mark.parametrize("unit", METRES)
def test_step_is_in_metres_whatever_its_unit(unit: str, tmp_path: Path) -> None:
    """A cylinder of radius 50 mm written in mm, cm, m and inches: the same part with the same fineness."""
    k = 1e-3 / METRES[unit]
    parsed = read_file(saved(tmp_path, step([((0, 0, 0), 50 * k, 30 * k)], unit)), "part.step")
    assert parsed.units == "m"
    part = make_part(parsed, "m", "+z")
    assert np.ptp(part.mesh.vertices, axis=0) == pytest.approx([0.1, 0.1, 0.03], rel=2e-3)
    assert len(part.mesh.faces) == len(load_part(saved(tmp_path, step()), "part.step", "m", "+z").mesh.faces)


@pytest.mark.parametrize("size", [0.01, 1.0, 100.0])
def test_fineness_follows_the_size_of_the_part(size: float, tmp_path: Path) -> None:
    """A part a hundred times larger or smaller has as many triangles, off the true surface by at most 1/2000 of its diagonal."""
    part = load_part(saved(tmp_path, step([((0, 0, 0), 50 * size, 30 * size)])), "part.step", "m", "+z")
    assert len(part.mesh.faces) == 328
    assert 0 < sag(part, 0.05 * size) < 1 / 1500


def test_cad_faces_keep_surface_and_colour_and_follow_the_part(tmp_path: Path) -> None:
    """Bottom, side and top in red, half green, blue; turned over to -x they keep radius and colours, point and axis turn along."""
    path = saved(tmp_path, step([((10, 20, 5), 50, 30)], colours=[(1, 0, 0), (0, 0.5, 0), (0, 0, 1)]))
    part = load_part(path, "part.step", "m", "+z")
    assert [face.kind for face in part.cad_faces] == ["plane", "cylinder", "plane"]
    np.testing.assert_allclose([face.colour for face in part.cad_faces], [(255, 0, 0), (0, 128, 0), (0, 0, 255)], atol=2)
    side = part.cad_faces[1]
    assert side.radius == pytest.approx(0.05)
    assert side.axis == pytest.approx((0, 0, 1))
    assert side.point == pytest.approx((0, 0, 0), abs=1e-4)
    assert part.report.lines[1] == ("info", "3 CAD faces kept (2 planes, 1 cylinder), painted in 3 colours.")
    for k, height in ((0, 0), (2, 0.03)):
        assert part.mesh.vertices[part.mesh.faces[part.cad_face == k]][..., 2] == pytest.approx(height)
    turned = load_part(path, "part.step", "m", "-x")
    assert turned.cad_faces[1].axis is not None
    assert turned.cad_faces[1].axis[2] == pytest.approx(0)
    assert turned.cad_faces[1].radius == pytest.approx(0.05)
    for k in (0, 2):  # the triangles of each plane lie on it
        plane = turned.cad_faces[k]
        points = turned.mesh.vertices[turned.mesh.faces[turned.cad_face == k]].reshape(-1, 3)
        assert (points - plane.point) @ np.array(plane.axis) == pytest.approx(0, abs=1e-6)


@pytest.mark.parametrize(("unit", "metres"), [((2, "MM"), 1e-3), ((1, "IN"), 0.0254), ((6, "M"), 1.0)])
def test_iges_knows_its_size_and_its_faces(unit: tuple[int, str], metres: float, tmp_path: Path) -> None:
    """The kernel hands IGES out in millimetres, but labels it metres."""
    parsed = read_file(saved(tmp_path, iges(unit=unit)), "part.igs")
    assert parsed.units == "mm"
    part = make_part(parsed, "mm", "+z")
    assert np.ptp(part.mesh.vertices, axis=0) == pytest.approx(np.array([60, 40, 20]) * metres)
    assert [face.kind for face in part.cad_faces] == ["freeform"] * 6
    assert np.unique(part.cad_face).tolist() == list(range(6))
    assert parsed.bodies[0].closed


class TestBodies:
    def test_bodies_are_listed_largest_first(self, tmp_path: Path) -> None:
        parsed = read_file(saved(tmp_path, step(TWO)), "part.step")
        assert [body.name for body in parsed.bodies] == ["bracket 1", "bracket 2"]
        assert parsed.bodies[0].extents == pytest.approx((0.1, 0.1, 0.03), rel=2e-3)
        assert parsed.bodies[1].extents == pytest.approx((0.04, 0.04, 0.01), rel=2e-3)
        assert parsed.guess == "1"

    def test_names_come_from_the_file(self, tmp_path: Path) -> None:
        parsed = read_file(saved(tmp_path, glb((("clamp", 0.5), ("base plate", 1.0)))), "part.glb")
        assert [(body.name, body.faces) for body in parsed.bodies] == [("base plate", 14), ("clamp", 14)]

    @pytest.mark.parametrize(("body", "radius", "faces"), [("1", 0.05, 3), ("2", 0.02, 3), (None, 0.05, 3)])
    def test_one_body_becomes_the_part(self, body: str | None, radius: float, faces: int, tmp_path: Path) -> None:
        part = load_part(saved(tmp_path, step(TWO)), "part.step", "m", "+z", body)
        assert np.ptp(part.mesh.vertices[:, 0]) == pytest.approx(2 * radius, rel=2e-3)
        assert len(part.cad_faces) == faces == part.cad_face.max() + 1
        assert any(level == "refused" and "Left out all bodies but bracket" in text for level, text in part.report.lines)

    def test_all_bodies_become_the_part(self, tmp_path: Path) -> None:
        part = load_part(saved(tmp_path, step(TWO)), "part.step", "m", "+z", "all")
        assert np.ptp(part.mesh.vertices[:, 0]) == pytest.approx(0.27, rel=2e-3)
        assert len(part.cad_faces) == 6
        assert ("info", "Made of all 2 bodies of the file.") in part.report.lines
        assert ("info", "All bodies are closed.") in part.report.lines
        assert trimesh.Trimesh(part.mesh.vertices, part.mesh.faces, process=False).is_watertight

    @pytest.mark.parametrize("body", ["0", "3", "one", "", "-1", "²"])
    def test_other_bodies_are_refused(self, body: str, tmp_path: Path) -> None:
        parsed = read_file(saved(tmp_path, step(TWO)), "part.step")
        with pytest.raises(InvalidInput, match="Choose 1 to 2, or all"):
            make_part(parsed, "m", "+z", body)

    def test_a_mesh_of_two_pieces_has_two_bodies_and_crumbs_are_left_out(self, tmp_path: Path) -> None:
        small, crumb = bump(), bump()
        small.apply_scale(0.5)
        small.apply_translation([100, 0, 0])
        crumb.apply_scale(0.001)
        crumb.apply_translation([300, 0, 0])
        both = trimesh.util.concatenate([small, crumb, bump()])
        parsed = read_file(saved(tmp_path, both.export(file_type="stl")), "part.stl")
        assert [(body.name, body.faces) for body in parsed.bodies] == [("Body 1", 14), ("Body 2", 14)]
        assert parsed.specks == 1
        lines = make_part(parsed, "mm", "+z").report.lines
        assert ("refused", "Left out 1 tiny separate piece.") in lines
        assert ("refused", "Left out all bodies but Body 1, one of 2 (20.0 % of the area).") in lines

    def test_lines_and_points_are_left_out_and_said(self, tmp_path: Path) -> None:
        scene = trimesh.Scene(bump())
        scene.add_geometry(trimesh.load_path(np.array([[[0, 0, 0], [50, 0, 0]], [[50, 0, 0], [50, 50, 0]]], float)))
        part = load_part(saved(tmp_path, scene.export(file_type="glb")), "part.glb", "m", "+z")
        assert ("refused", "Left out 1 entry that is lines or points, not surfaces.") in part.report.lines
        assert len(part.mesh.faces) == 14

    def test_a_file_of_lines_alone_is_refused(self, tmp_path: Path) -> None:
        scene = trimesh.Scene(trimesh.load_path(np.array([[[0, 0, 0], [50, 0, 0]]], float)))
        with pytest.raises(UnreadableMesh, match="holds no triangles"):
            read_file(saved(tmp_path, scene.export(file_type="glb")), "part.glb")


def test_what_was_parsed_survives_storage(tmp_path: Path) -> None:
    parsed = read_file(saved(tmp_path, step(TWO, colours=[(1, 0, 0)])), "part.step")
    again = ParsedFile.from_bytes(parsed.to_bytes())
    assert again.cad_faces == parsed.cad_faces
    assert again.bodies == parsed.bodies
    assert all(np.array_equal(getattr(again, k), getattr(parsed, k)) for k in ("vertices", "faces", "cad_face", "body"))


def test_a_process_that_died_is_replaced(tmp_path: Path) -> None:
    path = saved(tmp_path, exported("stl"))
    read_file(path, "part.stl")
    for process in parser_process._idle:
        process.kill()
        process.wait()
    assert read_file(path, "part.stl").bodies[0].faces == 14


def test_reading_is_quick_once_the_process_is_ready(tmp_path: Path) -> None:
    """Two and a half seconds of imports are paid once, not per file."""
    path = saved(tmp_path, exported("stl"))
    read_file(path, "part.stl")
    process = parser_process._idle[-1]
    read_file(path, "part.stl")
    assert parser_process._idle[-1] is process
