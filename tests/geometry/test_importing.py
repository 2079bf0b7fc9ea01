"""Units, up-direction, welding and the report of imported parts, on small parts written here and on public CAD files."""

import struct
from pathlib import Path

import numpy as np
import pytest

from app.errors import InvalidInput
from app.geometry.cleaning import RawSurface, clean, weld
from app.geometry.cleaning_report import size_words
from app.geometry.importing import METRES, UP, ImportedPart, load_part, read_file, rotation_to_up
from app.geometry.tool import Array
from tests.conftest import shared

# A closed box 6 x 4 x 2 with its +x +y +z corner cut off at a quarter of each side: no rotation maps it onto itself.
CORNERS = np.array(
    [[0, 0, 0], [6, 0, 0], [6, 4, 0], [0, 4, 0], [0, 0, 2], [6, 0, 2], [0, 4, 2], [4.5, 4, 2], [6, 3, 2], [6, 4, 1.5]], float
)  # fmt: skip
SIDES = ((3, 2, 1, 0), (0, 1, 5, 4), (0, 4, 6, 3), (1, 2, 9, 8, 5), (2, 3, 6, 7, 9), (4, 5, 8, 7, 6), (7, 8, 9))
TRIANGLES = np.array([(s[0], s[k], s[k + 1]) for s in SIDES for k in range(1, len(s) - 1)])


def stl(vertices: Array, faces: np.ndarray) -> bytes:
    """Binary STL: every triangle has corner points of its own."""
    body = b"".join(struct.pack("<12fH", 0, 0, 0, *vertices[f].ravel(), 0) for f in faces)
    return bytes(80) + struct.pack("<I", len(faces)) + body


def obj(vertices: Array, faces: np.ndarray) -> bytes:
    lines = [f"v {x} {y} {z}" for x, y, z in vertices] + [f"f {a} {b} {c}" for a, b, c in faces + 1]
    return "\n".join(lines).encode()


def saved(folder: Path, data: bytes) -> Path:
    path = folder / "upload"
    path.write_bytes(data)
    return path


def volume(part: ImportedPart) -> float:
    a, b, c = np.moveaxis(part.mesh.vertices[part.mesh.faces], 1, 0)
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)


def sentences(part: ImportedPart, level: str) -> list[str]:
    return [sentence for which, sentence in part.report.lines if which == level]


NOTHING_WRONG = (
    "Looked for and not found: triangles without area, doubled triangles, triangles facing the wrong way, "
    "edges with more than two triangles, holes."
)
BOX_VOLUME = 6 * 4 * 2 - 1.5 * 1 * 0.5 / 6


@pytest.mark.parametrize(("units", "metres"), [("mm", 1e-3), ("cm", 1e-2), ("m", 1.0), ("in", 0.0254)])
def test_units_scale_to_metres(units: str, metres: float, tmp_path: Path) -> None:
    part = load_part(saved(tmp_path, stl(CORNERS, TRIANGLES)), "box.stl", units, "+z")
    assert np.ptp(part.mesh.vertices, axis=0) == pytest.approx(np.array([6, 4, 2]) * metres)
    assert volume(part) == pytest.approx(BOX_VOLUME * metres**3)
    assert part.mesh.vertices.dtype == np.float64
    assert part.mesh.faces.dtype == np.int32
    assert part.report.lines[0] == ("info", f"16 triangles, {size_words((6, 4, 2), units)}.")
    assert set(METRES) == {"mm", "cm", "m", "in"}


def test_the_part_stands_in_the_middle_on_the_ground(tmp_path: Path) -> None:
    part = load_part(saved(tmp_path, obj(CORNERS + np.array([100, -50, 7]), TRIANGLES)), "box.obj", "m", "+z")
    low, high = part.mesh.vertices.min(axis=0), part.mesh.vertices.max(axis=0)
    assert low == pytest.approx([-3, -2, 0])
    assert high == pytest.approx([3, 2, 2])


@pytest.mark.parametrize("up", UP)
def test_rotation_takes_up_to_plus_z(up: str) -> None:
    rotation = rotation_to_up(up)
    direction = np.eye(3)["xyz".index(up[1])] * (1 if up[0] == "+" else -1)
    assert rotation @ direction == pytest.approx([0, 0, 1])
    assert rotation @ rotation.T == pytest.approx(np.eye(3))
    assert np.linalg.det(rotation) == pytest.approx(1)  # never a mirror image


@pytest.mark.parametrize(("up", "height"), [("+x", 6), ("-x", 6), ("+y", 4), ("-y", 4), ("+z", 2), ("-z", 2)])
def test_up_direction_turns_the_part_without_mirroring_it(up: str, height: float, tmp_path: Path) -> None:
    """The cut corner lies on the + side of every axis, so it ends up at the top exactly for +x, +y and +z."""
    part = load_part(saved(tmp_path, obj(CORNERS, TRIANGLES)), "box.obj", "m", up)
    assert np.ptp(part.mesh.vertices[:, 2]) == pytest.approx(height)
    assert volume(part) == pytest.approx(BOX_VOLUME)
    level = part.mesh.vertices[:, 2].round(6)
    top, bottom = (level == height).sum(), (level == 0).sum()
    assert (top > bottom) == (up[0] == "+")


@pytest.mark.parametrize("units", ["km", "MM", ""])
def test_unknown_units_name_the_accepted_ones(units: str, tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match=r"Accepted are mm, cm, m, in\."):
        load_part(saved(tmp_path, obj(CORNERS, TRIANGLES)), "box.obj", units, "+z")


def test_unknown_up_direction_names_the_accepted_ones(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match=r"'up'\. Accepted are \+x, -x, \+y, -y, \+z, -z\."):
        load_part(saved(tmp_path, obj(CORNERS, TRIANGLES)), "box.obj", "mm", "up")


class TestReadFile:
    def test_a_mesh_file_does_not_know_its_units(self, tmp_path: Path) -> None:
        found = read_file(saved(tmp_path, stl(CORNERS, TRIANGLES)), "box.stl")
        body = found.bodies[0]
        assert body.extents == pytest.approx((6, 4, 2))
        assert (found.units, len(found.bodies), body.name, body.faces, found.skipped, found.specks) == (None, 1, "Body 1", 16, 0, 0)

    @pytest.mark.parametrize(("order", "axis"), [((0, 1, 2), "z"), ((2, 0, 1), "x"), ((1, 2, 0), "y")])
    def test_up_is_guessed_across_the_flat_side(self, order: tuple[int, ...], axis: str, tmp_path: Path) -> None:
        """A wide flat pyramid lies on its base, whichever axis is across it; turned over, the guess turns too."""
        corners = np.array([[0, 0, 0], [10, 0, 0], [10, 10, 0], [0, 10, 0], [5, 5, 1]], float)
        faces = np.array([[2, 1, 0], [0, 3, 2], [0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])
        for sign in ("+", "-"):
            turned = (corners * [1, 1 if sign == "+" else -1, 1 if sign == "+" else -1])[:, order]
            assert read_file(saved(tmp_path, obj(turned, faces)), "pyramid.obj").bodies[0].up_guess == sign + axis


class TestCleaning:
    def test_weld_joins_corners_within_a_millionth_of_the_diagonal(self) -> None:
        """Diagonal 5: 4e-6 apart is one corner, 1e-4 apart two."""
        corners = np.array([[0, 0, 0], [3, 0, 0], [0, 4, 0], [3, 0, 4e-6], [3, 4, 0], [0, 4, 1e-4]], float)
        vertices, faces = weld(corners, np.array([[0, 1, 2], [3, 4, 5]]))
        assert len(vertices) == 5
        assert faces[0, 1] == faces[1, 0]
        assert faces[0, 2] != faces[1, 2]

    def test_stl_is_welded_and_says_so(self, tmp_path: Path) -> None:
        part = load_part(saved(tmp_path, stl(CORNERS, TRIANGLES)), "box.stl", "m", "+z")
        assert len(part.mesh.vertices) == 10
        assert sentences(part, "info")[1:] == ["Joined 38 doubled corner points.", "The surface is closed.", NOTHING_WRONG]
        assert sentences(part, "warning") == []
        assert sentences(part, "repaired") == []
        assert (part.cad_face == -1).all()
        assert len(part.cad_face) == 16

    def test_repairs_are_listed_and_made(self, tmp_path: Path) -> None:
        """One triangle twice, one without area, one turned over."""
        faces = np.concatenate([TRIANGLES, TRIANGLES[:1], [[0, 0, 1]]])
        faces[5] = faces[5, ::-1]
        part = load_part(saved(tmp_path, obj(CORNERS, faces)), "box.obj", "m", "+z")
        assert sentences(part, "repaired") == [
            "Removed 1 triangle without area.",
            "Removed 1 doubled triangle.",
            "Turned 1 triangle that faced the wrong way.",
        ]
        assert volume(part) == pytest.approx(BOX_VOLUME)

    def test_inside_out_solid_is_turned(self, tmp_path: Path) -> None:
        part = load_part(saved(tmp_path, obj(CORNERS, TRIANGLES[:, ::-1])), "box.obj", "m", "+z")
        assert sentences(part, "repaired") == ["Turned the surface inside out: all triangles faced inward."]
        assert volume(part) == pytest.approx(BOX_VOLUME)

    def test_open_sheet_faces_up_after_import(self, tmp_path: Path) -> None:
        corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0.1], [0, 1, 0.1]], float)
        part = load_part(saved(tmp_path, obj(corners, np.array([[2, 1, 0], [3, 2, 0]]))), "sheet.obj", "m", "+z")
        assert sentences(part, "repaired") == ["Turned the open surface over: it faced down."]
        assert sentences(part, "warning") == ["The surface is open: it has one border or hole, 4.01 m long."]
        a, b, c = np.moveaxis(part.mesh.vertices[part.mesh.faces], 1, 0)
        assert (np.cross(b - a, c - a)[:, 2] > 0).all()

    def test_largest_body_is_kept_and_the_loss_reported(self, tmp_path: Path) -> None:
        """The second body is half as long, so it has a quarter of the area: 80 % stay."""
        vertices = np.concatenate([CORNERS, CORNERS / 2 + [20, 0, 0]])
        part = load_part(saved(tmp_path, obj(vertices, np.concatenate([TRIANGLES, TRIANGLES + 10]))), "two.obj", "m", "+z")
        assert sentences(part, "refused") == ["Left out all bodies but Body 1, one of 2 (20.0 % of the area)."]
        assert len(part.mesh.faces) == 16
        assert volume(part) == pytest.approx(BOX_VOLUME)

    def test_cad_faces_follow_their_triangles(self) -> None:
        faces = np.concatenate([TRIANGLES[:3], TRIANGLES[:1], TRIANGLES[3:]])
        cad = np.arange(17)
        surface = clean(RawSurface(CORNERS, faces, cad))
        assert surface.cad_face.tolist() == [0, 1, 2, *range(4, 17)]

    @pytest.mark.parametrize("units", ["mm", "m"])
    def test_unlikely_size_asks_for_the_units(self, units: str, tmp_path: Path) -> None:
        scale = 0.5 if units == "mm" else 5
        part = load_part(saved(tmp_path, obj(CORNERS * scale, TRIANGLES)), "box.obj", units, "+z")
        assert [s.endswith(f"Check the units ({units}).") for s in sentences(part, "warning")] == [True]


class TestPublicFiles:
    def test_step_comes_in_metres_with_its_cad_faces(self) -> None:
        """featuretype.STEP is 5 x 2.5 x 1.375 inches and has 96 CAD faces."""
        path = shared("cad", "featuretype.STEP")
        found = read_file(path, "featuretype.STEP")
        assert found.units == "m"
        assert len(found.bodies) == 1
        assert found.bodies[0].up_guess == "+z"
        assert found.bodies[0].extents == pytest.approx(np.array([5, 2.5, 1.375]) * 0.0254, rel=1e-4)
        part = load_part(path, "featuretype.STEP", found.units, "+z")
        assert np.ptp(part.mesh.vertices, axis=0) == pytest.approx(np.array([5, 2.5, 1.375]) * 0.0254, rel=1e-4)
        assert np.unique(part.cad_face).tolist() == list(range(96))
        assert "The surface is closed." in sentences(part, "info")
        assert sentences(part, "warning") == []
        assert volume(part) > 0

    def test_airfoil_without_units(self) -> None:
        """In mm it would be 2 mm long: said. In m it is accepted silently."""
        path = shared("cad", "naca0012.stl")
        assert read_file(path, "naca0012.stl").units is None
        assert "Check the units (mm)" in sentences(load_part(path, "naca0012.stl", "mm", "+z"), "warning")[0]
        part = load_part(path, "naca0012.stl", "m", "+z")
        assert sentences(part, "warning") == []
        assert len(part.mesh.faces) == 788
        assert np.ptp(part.mesh.vertices, axis=0) == pytest.approx([0.98894, 2, 0.18088], rel=1e-4)

    def test_text_stl_of_a_tray_lies_across_y(self) -> None:
        path = shared("cad", "1002_tray_bottom.STL")
        assert read_file(path, "tray.STL").bodies[0].up_guess == "+y"
        part = load_part(path, "tray.STL", "mm", "+y")
        assert np.ptp(part.mesh.vertices, axis=0) == pytest.approx([0.3556, 0.3556, 0.003175])
        assert sentences(part, "warning") == []
        assert volume(part) > 0
