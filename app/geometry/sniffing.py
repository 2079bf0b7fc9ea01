"""Is this file what its name says? Checked on the bytes before any parser sees them."""

import io
import re
import struct
import zipfile

from app.errors import InvalidInput, TooLarge, UnreadableMesh

ACCEPTED = (".step", ".stp", ".iges", ".igs", ".stl", ".obj", ".ply", ".off", ".glb", ".3mf")
MOST_BYTES = 256 * 2**20
MOST_UNPACKED_BYTES = 512 * 2**20  # 3MF: sum of the unpacked parts
MOST_UNPACKED_RATIO = 100  # 3MF: XML of meshes packs about 5 to 20 times
MOST_ZIP_ENTRIES = 1000
STL_HEADER, STL_TRIANGLE = 84, 50  # bytes of a binary STL

FORMAT_NAMES = {"step": "STEP", "iges": "IGES", "stl": "STL", "obj": "OBJ", "ply": "PLY", "off": "OFF", "glb": "GLB", "3mf": "3MF"}
_ALIASES = {"stp": "step", "igs": "iges"}


def recognise(file_name: str, data: bytes) -> str:
    """Format of a file, one of the keys of FORMAT_NAMES.

    Raises:
        InvalidInput: The extension is not accepted.
        TooLarge: More bytes than we read, or a 3MF that unpacks to too much.
        UnreadableMesh: Empty, truncated, or the content does not belong to the extension.
    """
    kind = _kind_of_name(file_name)
    if not data:
        raise UnreadableMesh(f"{file_name} is empty (0 bytes). Export the part again.")
    if len(data) > MOST_BYTES:
        raise TooLarge(f"{file_name} has {len(data) / 2**20:.0f} MB; at most {MOST_BYTES // 2**20} MB are read.")
    actual = _kind_of_content(data)
    if actual != kind and not (actual is None and kind in ("stl", "obj", "off")):
        found = f"its content is {FORMAT_NAMES[actual]}" if actual in FORMAT_NAMES else f"its content is {actual or 'something else'}"
        raise UnreadableMesh(f"{file_name} is named as {FORMAT_NAMES[kind]}, but {found}. Export it again or correct the name.")
    _CHECKS[kind](file_name, data)
    return kind


def _kind_of_name(file_name: str) -> str:
    extension = file_name.rsplit(".", 1)[-1].lower() if "." in file_name else ""
    if "." + extension not in ACCEPTED:
        raise InvalidInput(f"{file_name} has the wrong extension. Accepted are {', '.join(ACCEPTED)}.")
    return _ALIASES.get(extension, extension)


def _kind_of_content(data: bytes) -> str | None:
    """Format by its first bytes; None when they decide nothing."""
    start = data[:4096].lstrip(b"\xef\xbb\xbf \t\r\n")
    if start.startswith(b"ISO-10303-21"):
        return "step"
    if start.startswith(b"glTF"):
        return "glb"
    if start.startswith(b"ply"):
        return "ply"
    if start.startswith(b"PK\x03\x04"):
        return "3mf" if _zip_holds_model(data) else "a ZIP archive without a 3D model"
    if re.match(rb"(ST|C|N|4|STC|CN|STCN)*OFF\b", start):
        return "off"
    if re.match(rb"[^\r\n]{72}S\s*1", data[:200]):
        return "iges"
    if len(data) >= STL_HEADER and len(data) == STL_HEADER + STL_TRIANGLE * struct.unpack("<I", data[80:84])[0]:
        return "stl"
    if start[:5].lower() == b"solid" and b"facet" in data[:65536]:
        return "stl"
    for magic, name in (
        (b"%PDF", "a PDF document"),
        (b"\x89PNG", "a PNG picture"),
        (b"\xff\xd8\xff", "a JPEG picture"),
        (b"\x7fELF", "a program"),
    ):
        if start.startswith(magic):
            return name
    if b"\0" not in data[:65536] and re.search(rb"(?m)^v\s+[-+.\d]", data[:65536]):
        return "obj"
    return None


def _zip_holds_model(data: bytes) -> bool:
    return b"3D/" in data and b".model" in data


def _check_step(file_name: str, data: bytes) -> None:
    if b"END-ISO-10303-21" not in data[-4096:]:
        raise UnreadableMesh(f"{file_name} is truncated: a STEP file ends with END-ISO-10303-21. Export or upload it again.")


def _check_iges(file_name: str, data: bytes) -> None:
    lines = data.rstrip().splitlines()
    if not lines or lines[-1][72:73] != b"T":
        raise UnreadableMesh(f"{file_name} is truncated: an IGES file ends with a terminate (T) line. Export or upload it again.")


def _check_stl(file_name: str, data: bytes) -> None:
    text = data[:512].lstrip()[:5].lower() == b"solid" and b"facet" in data[:65536]
    binary = len(data) >= STL_HEADER
    stated = struct.unpack("<I", data[80:84])[0] if binary else 0
    if binary and len(data) == STL_HEADER + STL_TRIANGLE * stated:
        if stated == 0:
            raise UnreadableMesh(f"{file_name} holds no triangles. Export the surface of the part, not only its outline.")
        return
    if text:
        _check_text_stl(file_name, data)
        return
    if not binary:
        raise UnreadableMesh(f"{file_name} is not an STL file: it has {len(data)} bytes and no header.")
    held = (len(data) - STL_HEADER) / STL_TRIANGLE
    if stated == int(held):
        needed = STL_HEADER + STL_TRIANGLE * stated
        raise UnreadableMesh(f"{file_name} has {len(data):,} bytes, but its {stated:,} triangles need {needed:,}. Export it again.")
    raise UnreadableMesh(
        f"{file_name} says it holds {stated:,} triangles, but its size fits {held:,.0f}. It is damaged or not an STL file; export it again."
    )


def _check_text_stl(file_name: str, data: bytes) -> None:
    ends, facets = len(re.findall(rb"(?i)\bendfacet\b", data)), len(re.findall(rb"(?i)\bfacet\b", data))
    if facets == 0:
        raise UnreadableMesh(f"{file_name} holds no triangles. Export the surface of the part, not only its outline.")
    if ends != facets or b"endsolid" not in data[-4096:].lower():
        raise UnreadableMesh(f"{file_name} is truncated: {facets:,} triangles begin and {ends:,} end. Export or upload it again.")


def _check_obj(file_name: str, data: bytes) -> None:
    if b"\0" in data:
        raise UnreadableMesh(f"{file_name} is not an OBJ file: OBJ is text, this is binary.")
    if not re.search(rb"(?m)^\s*v\s", data) or not re.search(rb"(?m)^\s*f\s", data):
        raise UnreadableMesh(f"{file_name} holds no faces (lines that begin with 'v' and 'f'). Export the surface of the part as OBJ.")


def _check_ply(file_name: str, data: bytes) -> None:
    header, end, _body = data[:65536].partition(b"end_header")
    if not end:
        raise UnreadableMesh(f"{file_name} is truncated: its PLY header has no end.")
    faces = re.search(rb"element\s+face\s+(\d+)", header)
    vertices = re.search(rb"element\s+vertex\s+(\d+)", header)
    if faces is None or int(faces.group(1)) == 0:
        raise UnreadableMesh(f"{file_name} holds points but no faces. Export a surface, not a point cloud.")
    stated = int(faces.group(1)) + (int(vertices.group(1)) if vertices else 0)
    if stated > len(data):  # every vertex and face takes more than a byte
        raise UnreadableMesh(
            f"{file_name} says it holds {stated:,} vertices and faces, more than its {len(data):,} bytes can. It is damaged."
        )


def _check_off(file_name: str, data: bytes) -> None:
    if not re.match(rb"(ST|C|N|4)*OFF\b", data.lstrip()):
        raise UnreadableMesh(f"{file_name} is not an OFF file: it does not begin with OFF.")
    numbers = re.search(rb"OFF\s+(?:#[^\n]*\n\s*)*(\d+)\s+(\d+)", data[:4096])
    if numbers is None or int(numbers.group(2)) == 0:
        raise UnreadableMesh(f"{file_name} holds no faces. Export a surface, not a point cloud.")
    if int(numbers.group(1)) + int(numbers.group(2)) > len(data):
        raise UnreadableMesh(f"{file_name} says it holds more vertices and faces than its {len(data):,} bytes can. It is damaged.")


def _check_glb(file_name: str, data: bytes) -> None:
    if len(data) < 20 or struct.unpack("<I", data[8:12])[0] > len(data):
        raise UnreadableMesh(f"{file_name} is truncated: it is shorter than its GLB header says. Export or upload it again.")


def _check_3mf(file_name: str, data: bytes) -> None:
    """Sizes are compared before anything is unpacked: a few KB can unpack to gigabytes."""
    try:
        entries = zipfile.ZipFile(io.BytesIO(data)).infolist()
    except (zipfile.BadZipFile, NotImplementedError, struct.error) as error:
        raise UnreadableMesh(f"{file_name} is a damaged 3MF archive. Export it again.") from error
    unpacked = sum(e.file_size for e in entries)
    packed = max(1, sum(e.compress_size for e in entries))
    if len(entries) > MOST_ZIP_ENTRIES:
        raise TooLarge(f"{file_name} holds {len(entries):,} files; a 3MF archive may hold {MOST_ZIP_ENTRIES:,}.")
    if unpacked > MOST_UNPACKED_BYTES or unpacked > MOST_UNPACKED_RATIO * packed + 2**20:
        raise TooLarge(
            f"{file_name} unpacks from {packed / 2**20:.1f} MB to {unpacked / 2**20:,.0f} MB. "
            f"Accepted are {MOST_UNPACKED_BYTES // 2**20} MB and {MOST_UNPACKED_RATIO} times the packed size."
        )


_CHECKS = {
    "step": _check_step, "iges": _check_iges, "stl": _check_stl, "obj": _check_obj,
    "ply": _check_ply, "off": _check_off, "glb": _check_glb, "3mf": _check_3mf,
}  # fmt: skip
