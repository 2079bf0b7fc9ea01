"""Files that can't become a tool are refused in a sentence that says why, and never crash the reader."""

import io
import struct
import zipfile
from pathlib import Path

import numpy as np
import pytest

from app.errors import AppError, InvalidInput, TooLarge, UnreadableMesh
from app.geometry import importing, parser_process, sniffing
from app.geometry.importing import load_part, read_file
from tests.conftest import shared

PYRAMID_OBJ = b"v 0 0 0\nv 10 0 0\nv 10 10 0\nv 0 10 0\nv 5 5 5\nf 2 1 4\nf 4 3 2\nf 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\n"


def binary_stl(triangles: int, stated: int, corner: float = 1.0) -> bytes:
    """A fan of triangles in the plane; the header may lie about their number."""
    body = b""
    for k in range(triangles):
        numbers = (0, 0, 1, 0, 0, 0, corner, k, 0, corner, k + 1, 0)
        body += struct.pack("<12fH", *numbers, 0)
    return bytes(80) + struct.pack("<I", stated) + body


def archive(model: bytes) -> bytes:
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr("[Content_Types].xml", b"<Types/>")
        file.writestr("3D/3dmodel.model", model)
    return packed.getvalue()


def glb_with(json_bytes: bytes) -> bytes:
    json_bytes += b" " * (-len(json_bytes) % 4)
    return struct.pack("<4sIIII", b"glTF", 2, 20 + len(json_bytes), len(json_bytes), 0x4E4F534A) + json_bytes


NO_FACES_3MF = (
    b'<?xml version="1.0"?><model unit="millimeter" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02"><resources>'
    b'<object id="1" type="model"><mesh><vertices><vertex x="0" y="0" z="0"/></vertices><triangles/></mesh></object>'
    b'</resources><build><item objectid="1"/></build></model>'
)
PLY = b"ply\nformat ascii 1.0\nelement vertex %d\nproperty float x\nproperty float y\nproperty float z\nelement face %d\n"
PLY += b"property list uchar int vertex_indices\nend_header\n"
GARBAGE = np.random.default_rng(1).bytes(5000)

BAD: dict[str, tuple[str, bytes, type[AppError], str]] = {
    "empty": ("part.stl", b"", AppError, "empty"),
    "empty step": ("part.step", b"", AppError, "empty"),
    "wrong extension": ("part.docx", PYRAMID_OBJ, InvalidInput, "wrong extension. Accepted are .step"),
    "no extension": ("part", PYRAMID_OBJ, InvalidInput, "wrong extension"),
    "mesh named step": ("part.step", PYRAMID_OBJ, AppError, "OBJ"),
    "picture named stl": ("part.stl", b"\x89PNG\r\n\x1a\n" + bytes(200), AppError, "PNG picture"),
    "half a step header": ("part.step", b"ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\n#1=CARTESIAN_POINT('',(0.,", UnreadableMesh, "truncated"),
    "step without shapes": ("part.step", b"ISO-10303-21;\nDATA;\nENDSEC;\nEND-ISO-10303-21;\n", UnreadableMesh, "part.step"),
    "obj points": ("points.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\n", UnreadableMesh, "no faces"),
    "off points": ("points.off", b"OFF\n3 0 0\n0 0 0\n1 0 0\n0 1 0\n", UnreadableMesh, "no faces"),
    "ply points": ("points.ply", PLY % (2, 0) + b"0 0 0\n1 1 1\n", UnreadableMesh, "no faces"),
    "ply lies": ("lies.ply", PLY % (3, 1_000_000) + b"0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", UnreadableMesh, "1,000,003"),
    "3mf without faces": ("points.3mf", archive(NO_FACES_3MF), UnreadableMesh, "no triangles"),
    "obj index": ("index.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", UnreadableMesh, "index.obj"),
    "obj nan": ("nan.obj", PYRAMID_OBJ.replace(b"5 5 5", b"5 nan 5"), UnreadableMesh, "NaN"),
    "stl nan": ("nan.stl", binary_stl(12, 12, corner=float("nan")), UnreadableMesh, "NaN"),
    "stl infinite": ("inf.stl", binary_stl(12, 12, corner=float("inf")), UnreadableMesh, "infinite"),
    "stl flat": ("flat.stl", binary_stl(12, 12, corner=0.0), UnreadableMesh, "area"),
    "stl count too large": ("lies.stl", binary_stl(12, 4_000_000_000), UnreadableMesh, "says it holds 4,000,000,000 triangles"),
    "stl count too small": ("lies.stl", binary_stl(12, 3), UnreadableMesh, "its size fits 12"),
    "stl none": ("none.stl", binary_stl(0, 0), UnreadableMesh, "no triangles"),
    "stl text cut": ("cut.stl", b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n", UnreadableMesh, "truncated"),
    "zip bomb": ("bomb.3mf", archive(bytes(300 * 2**20)), TooLarge, "unpacks from"),
    "zip without model": ("other.3mf", b"PK\x03\x04" + bytes(100), AppError, "ZIP"),
    "garbage glb": ("part.glb", GARBAGE, UnreadableMesh, "part.glb"),
    "garbage glb body": ("part.glb", struct.pack("<4sII", b"glTF", 2, 5012) + GARBAGE, UnreadableMesh, "part.glb"),
    "empty glb": ("part.glb", glb_with(b'{"asset":{"version":"2.0"}}'), UnreadableMesh, "part.glb"),
    "garbage stl": ("part.stl", GARBAGE, UnreadableMesh, "part.stl"),
    "garbage ply": ("part.ply", b"ply\n" + GARBAGE, UnreadableMesh, "part.ply"),
    "garbage off": ("part.off", b"OFF\n4 4 0\n" + GARBAGE, UnreadableMesh, "part.off"),
    "garbage iges": ("part.igs", GARBAGE, UnreadableMesh, "part.igs"),
}  # fmt: skip


def write(folder: Path, data: bytes) -> Path:
    path = folder / "upload"
    path.write_bytes(data)
    return path


@pytest.mark.parametrize("case", BAD)
def test_refused_with_a_sentence(case: str, tmp_path: Path) -> None:
    name, data, kind, words = BAD[case]
    with pytest.raises((UnreadableMesh, InvalidInput, TooLarge)) as caught:
        read_file(write(tmp_path, data), name)
    sentence = str(caught.value)
    assert isinstance(caught.value, kind)
    assert words in sentence
    assert name in sentence
    assert sentence.endswith(".")
    assert "Traceback" not in sentence
    assert "Error" not in sentence
    assert str(tmp_path) not in sentence


def test_control_loads(tmp_path: Path) -> None:
    """The same pyramid the bad files are made of is accepted whole: 10 mm wide, 5 mm high, closed."""
    part = load_part(write(tmp_path, PYRAMID_OBJ), "pyramid.obj", "mm", "+z")
    assert len(part.mesh.faces) == 6
    assert len(part.mesh.vertices) == 5
    assert np.ptp(part.mesh.vertices, axis=0) == pytest.approx([0.01, 0.01, 0.005])


def test_soup_is_refused_and_says_how_little_touches(tmp_path: Path) -> None:
    path = shared("cad", "soup.stl")
    with pytest.raises(UnreadableMesh, match="don't form a surface: only 0 %"):
        load_part(path, "soup.stl", "mm", "+z")


def test_half_a_step_file_is_truncated(tmp_path: Path) -> None:
    data = shared("cad", "featuretype.STEP").read_bytes()
    with pytest.raises(UnreadableMesh, match=r"half\.STEP is truncated"):
        read_file(write(tmp_path, data[: len(data) // 2]), "half.STEP")


def test_step_with_a_hole_in_the_middle(tmp_path: Path) -> None:
    """The end is there, so the kernel gets to see it; whatever it does must end in a sentence."""
    data = shared("cad", "featuretype.STEP").read_bytes()
    with pytest.raises(UnreadableMesh, match=r"holed\.STEP"):
        read_file(write(tmp_path, data[:2000] + data[-2000:]), "holed.STEP")


def test_too_many_bytes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importing, "MOST_BYTES", 50)
    with pytest.raises(TooLarge, match="at most 0 MB"):
        read_file(write(tmp_path, PYRAMID_OBJ), "pyramid.obj")


def test_slow_reader_is_stopped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(parser_process, "WALL_SECONDS", 0.0001)
    with pytest.raises(UnreadableMesh, match="took longer than"):
        read_file(write(tmp_path, PYRAMID_OBJ), "pyramid.obj")


def test_every_accepted_ending_has_a_name() -> None:
    assert {sniffing._ALIASES.get(e[1:], e[1:]) for e in sniffing.ACCEPTED} == set(sniffing._CHECKS) == set(sniffing.FORMAT_NAMES)
