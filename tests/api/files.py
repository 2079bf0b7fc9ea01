"""Small files made up for the tests, good and bad."""

import io
import struct
import zipfile
from collections.abc import Iterator

STEP = b"""ISO-10303-21;
HEADER;
FILE_DESCRIPTION((''),'2;1');
FILE_NAME('part.step','2026-01-01T00:00:00',(''),(''),'','','');
FILE_SCHEMA(('AUTOMOTIVE_DESIGN { 1 0 10303 214 1 1 1 1 }'));
ENDSEC;
DATA;
#1=CARTESIAN_POINT('',(0.,0.,0.));
#2=DIRECTION('',(0.,0.,1.
"""
REAL_HEADER = (
    "Region,Curvature avg,neighbors,neighbor angles,neighbor edges,Shape complexity,Area/total area,Z avg,Z max,"
    "Corner Neighbors,region index,Solution\n"
)
REAL_TABLE = (
    REAL_HEADER
    + """a,5,"O,x,b,x,c,x,O","x,10,-10,x","0.5,0.5,0.5,0.5",0.7,0.25,0.8,0.9,"O,O,d,O","0,0","a,b,d,c"
b,6,"O,x,O,x,d,x,a","x,x,-10,-10","0.5,0.5,0.5,0.5",0.7,0.25,0.8,1,"O,O,O,c","0,1",
c,4,"a,x,d,x,O,x,O","10,10,x,x","0.5,0.5,0.5,0.5",0.7,0.25,0.6,0.7,"O,b,O,O","1,0",
d,3,"b,x,O,x,O,x,c","10,x,x,-10","0.5,0.5,0.5,0.5",0.7,0.25,0.5,0.6,"a,O,O,O","1,1",
"""
)
THREE_SIDES = REAL_TABLE.replace('d,3,"b,x,O,x,O,x,c"', 'd,3,"b,x,O,O,x,c"')  # the fault of the authors' real tool 13
SIDE_MISSING = REAL_TABLE.replace('d,3,"b,x,O,x,O,x,c"', 'd,3,"b,x,O,x,c"')


def binary_stl(triangles: list[list[float]]) -> bytes:
    records = b"".join(struct.pack("<12fH", 0, 0, 1, *corners, 0) for corners in triangles)
    return b"\0" * 80 + struct.pack("<I", len(triangles)) + records


def tetrahedron(last: float = 1.0) -> bytes:
    """A closed binary STL; `last` spoils one coordinate."""
    a, b, c, d = [0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, last]
    return binary_stl([[*a, *c, *b], [*a, *b, *d], [*a, *d, *c], [*b, *c, *d]])


def zip_bomb(megabytes: int) -> bytes:
    """A 3MF whose model unpacks to that many megabytes of blanks."""
    stored = io.BytesIO()
    with zipfile.ZipFile(stored, "w", zipfile.ZIP_DEFLATED) as archive, archive.open("3D/3dmodel.model", "w", force_zip64=True) as model:
        model.write(b'<?xml version="1.0"?><model unit="millimeter">')
        for _ in range(megabytes):
            model.write(b" " * 1_000_000)
        model.write(b"</model>")
    return stored.getvalue()


def multipart(name: str, size: int) -> Iterator[bytes]:
    """A multipart body made up while it is sent."""
    yield f'--b\r\nContent-Disposition: form-data; name="file"; filename="{name}"\r\n\r\n'.encode()
    block = b"\0" * 1_000_000
    for _ in range(size // len(block)):
        yield block
    yield b"\r\n--b--\r\n"
