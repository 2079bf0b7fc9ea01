"""Small CAD and mesh files made up for the tests, one per format: text written here, nothing copied."""

import io
import zipfile
from collections.abc import Sequence

import numpy as np
import trimesh

Point = tuple[float, float, float]
Colour = tuple[float, float, float]
UNITS = {
    "mm": "( LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT(.MILLI.,.METRE.) )",
    "cm": "( LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT(.CENTI.,.METRE.) )",
    "m": "( LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT($,.METRE.) )",
}
FRAME = """ISO-10303-21;
HEADER;
FILE_DESCRIPTION((''),'2;1');
FILE_NAME('','2026-01-01T00:00:00',(''),(''),'','','');
FILE_SCHEMA(('AUTOMOTIVE_DESIGN { 1 0 10303 214 1 1 1 1 }'));
ENDSEC;
DATA;
%s
ENDSEC;
END-ISO-10303-21;
"""


class StepWriter:
    """Collects the numbered lines of a STEP file."""

    def __init__(self) -> None:
        self.lines: list[str] = []

    def raw(self, text: str) -> str:
        """A line's number, to refer to it."""
        self.lines.append(f"#{len(self.lines) + 1}={text};")
        return f"#{len(self.lines)}"

    def add(self, kind: str, *values: str | float) -> str:
        """An entity with an empty name and these values."""
        shown = [v if isinstance(v, str) else f"{v:.9f}" for v in values]
        return self.raw(f"{kind}({','.join(['', *shown])})".replace("(,", "('',", 1))

    def triple(self, kind: str, values: Sequence[float]) -> str:
        """A point or direction."""
        return self.add(kind, f"({','.join(f'{v:.9f}' for v in values)})")

    def place(self, at: Point) -> str:
        """A frame with the axes of the file."""
        point, z, x = self.triple("CARTESIAN_POINT", at), self.triple("DIRECTION", (0, 0, 1)), self.triple("DIRECTION", (1, 0, 0))
        return self.add("AXIS2_PLACEMENT_3D", point, z, x)

    def cylinder(self, at: Point, radius: float, height: float) -> tuple[str, list[str]]:
        """A solid of three faces: bottom, side, top."""
        x, y, z = at
        ends = [(x, y, z), (x, y, z + height)]
        starts = [self.triple("CARTESIAN_POINT", (x + radius, y, end[2])) for end in ends]
        corners = [self.add("VERTEX_POINT", point) for point in starts]
        circles = [self.add("CIRCLE", self.place(end), radius) for end in ends]
        rings = [self.add("EDGE_CURVE", v, v, c, ".T.") for v, c in zip(corners, circles, strict=True)]
        line = self.add("LINE", starts[0], self.add("VECTOR", self.triple("DIRECTION", (0, 0, 1)), 1.0))
        seam = self.add("EDGE_CURVE", corners[0], corners[1], line, ".T.")
        side = [(rings[0], ".T."), (seam, ".T."), (rings[1], ".F."), (seam, ".F.")]
        faces = [
            self.face([(rings[0], ".F.")], self.add("PLANE", self.place(ends[0])), ".F."),
            self.face(side, self.add("CYLINDRICAL_SURFACE", self.place(at), radius), ".T."),
            self.face([(rings[1], ".T.")], self.add("PLANE", self.place(ends[1])), ".T."),
        ]
        return self.add("MANIFOLD_SOLID_BREP", self.add("CLOSED_SHELL", many(faces))), faces

    def face(self, edges: list[tuple[str, str]], surface: str, same: str) -> str:
        """A face with one loop of edges."""
        loop = self.add("EDGE_LOOP", many([self.add("ORIENTED_EDGE", "*", "*", e, forward) for e, forward in edges]))
        return self.add("ADVANCED_FACE", many([self.add("FACE_OUTER_BOUND", loop, ".T.")]), surface, same)

    def paint(self, face: str, colour: Colour) -> str:
        """A face's colour."""
        fill = self.add("FILL_AREA_STYLE", many([self.add("FILL_AREA_STYLE_COLOUR", self.add("COLOUR_RGB", *map(float, colour)))]))
        side = self.add("SURFACE_SIDE_STYLE", many([self.raw(f"SURFACE_STYLE_FILL_AREA({fill})")]))
        style = self.raw(f"PRESENTATION_STYLE_ASSIGNMENT(({self.raw(f'SURFACE_STYLE_USAGE(.BOTH.,{side})')}))")
        return self.add("STYLED_ITEM", many([style]), face)

    def context(self, unit: str) -> str:
        """Where lengths, angles and accuracy are said."""
        if unit == "in":
            size = self.raw("DIMENSIONAL_EXPONENTS(1.,0.,0.,0.,0.,0.,0.)")
            inch = self.raw(f"LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(25.4),{self.raw(UNITS['mm'])})")
            length = self.raw(f"( CONVERSION_BASED_UNIT('INCH',{inch}) LENGTH_UNIT() NAMED_UNIT({size}) )")
        else:
            length = self.raw(UNITS[unit])
        angle = self.raw("( NAMED_UNIT(*) PLANE_ANGLE_UNIT() SI_UNIT($,.RADIAN.) )")
        solid = self.raw("( NAMED_UNIT(*) SI_UNIT($,.STERADIAN.) SOLID_ANGLE_UNIT() )")
        exact = self.raw(f"UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE(1.E-06),{length},'distance_accuracy_value','')")
        return self.raw(
            f"( GEOMETRIC_REPRESENTATION_CONTEXT(3) GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT(({exact}))"
            f" GLOBAL_UNIT_ASSIGNED_CONTEXT(({length},{angle},{solid})) REPRESENTATION_CONTEXT('','3D') )"
        )

    def product(self) -> str:
        """The part that has the shape."""
        application = self.raw("APPLICATION_CONTEXT('automotive design')")
        context = self.add("PRODUCT_CONTEXT", application, "'mechanical'")
        formation = self.add("PRODUCT_DEFINITION_FORMATION", "''", self.raw(f"PRODUCT('bracket','bracket','',({context}))"))
        about = self.raw(f"PRODUCT_DEFINITION_CONTEXT('part definition',{application},'design')")
        return self.add("PRODUCT_DEFINITION_SHAPE", "''", self.add("PRODUCT_DEFINITION", "''", formation, about))


def many(numbers: Sequence[str]) -> str:
    return f"({','.join(numbers)})"


def step(
    cylinders: Sequence[tuple[Point, float, float]] = (((0, 0, 0), 50, 30),), unit: str = "mm", colours: Sequence[Colour] = ()
) -> bytes:
    """Upright cylinders (base centre, radius, height) in the given unit; `colours` paint the faces of the first one."""
    s = StepWriter()
    context, shape = s.context(unit), s.product()
    made = [s.cylinder(*about) for about in cylinders]
    items = many([s.place((0, 0, 0)), *(body for body, _ in made)])
    s.raw(f"SHAPE_DEFINITION_REPRESENTATION({shape},{s.add('ADVANCED_BREP_SHAPE_REPRESENTATION', items, context)})")
    painted = [s.paint(face, colour) for face, colour in zip(made[0][1], colours, strict=False)]
    if painted:
        s.add("MECHANICAL_DESIGN_GEOMETRIC_PRESENTATION_REPRESENTATION", many(painted), context)
    return (FRAME % "\n".join(s.lines)).encode()


def iges(size: Point = (60, 40, 20), unit: tuple[int, str] = (2, "MM")) -> bytes:
    """A box of six bilinear patches (entity 128); units are (1, "IN"), (2, "MM"), (6, "M")."""
    x, y, z = size
    c = [(0, 0, 0), (x, 0, 0), (x, y, 0), (0, y, 0), (0, 0, z), (x, 0, z), (x, y, z), (0, y, z)]
    flag, name = unit
    text = (
        f"1H,,1H;,4Hpart,8Hpart.igs,4Htest,4Htest,32,38,6,308,15,4Hpart,1.0,{flag},{len(name)}H{name},1,0.01,"
        "15H20260101.000000,1E-06,1000.0,4Htest,4Htest,11,0,15H20260101.000000;"
    )
    directory: list[str] = []
    parameters: list[str] = []
    for k, (p, q, r, s) in enumerate(((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))):
        values = ["128,1,1,1,1,0,0,1,0,0,0.,0.,1.,1.,0.,0.,1.,1.,1.,1.,1.,1.", *(f"{v:.4f}" for i in (p, q, s, r) for v in c[i])]
        record = ",".join([*values, "0.,1.,0.,1."]) + ";"
        lines = [record[i : i + 64] for i in range(0, len(record), 64)]
        directory.append("".join(f"{v:>8}" for v in (128, len(parameters) + 1, 0, 0, 0, 0, 0, 0, "00000000")))
        directory.append("".join(f"{v:>8}" for v in (128, 0, 0, len(lines), 0, "", "", "", 0)))
        parameters += [f"{line:<64}{2 * k + 1:>8}" for line in lines]
    sections = {"S": ["made for a test"], "G": [text[i : i + 72] for i in range(0, len(text), 72)], "D": directory, "P": parameters}
    sections["T"] = ["".join(f"{letter}{len(lines):>7}" for letter, lines in sections.items())]
    out = [f"{line:<72}{letter}{k:>7}" for letter, lines in sections.items() for k, line in enumerate(lines, start=1)]
    return ("\n".join(out) + "\n").encode()


def bump() -> trimesh.Trimesh:
    """A small closed part: a box with a pyramid on top."""
    vertices = np.array(
        [[0, 0, 0], [60, 0, 0], [60, 40, 0], [0, 40, 0], [0, 0, 10], [60, 0, 10], [60, 40, 10], [0, 40, 10], [30, 20, 25]], float
    )
    quads = [(3, 2, 1, 0), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
    faces = [(q[0], q[k], q[k + 1]) for q in quads for k in (1, 2)] + [(4, 5, 8), (5, 6, 8), (6, 7, 8), (7, 4, 8)]
    return trimesh.Trimesh(vertices, faces, process=False)


def text_stl(mesh: trimesh.Trimesh) -> bytes:
    rows = ["solid part"]
    for corners in mesh.triangles:
        points = "\n".join("vertex " + " ".join(f"{v:.6g}" for v in p) for p in corners)
        rows.append(f"facet normal 0 0 1\nouter loop\n{points}\nendloop\nendfacet")
    return "\n".join([*rows, "endsolid part", ""]).encode()


def threemf(model: bytes | None = None) -> bytes:
    """The part as 3MF, or an archive around another model."""
    mesh = bump()
    if model is None:
        points = "".join(f'<vertex x="{x:g}" y="{y:g}" z="{z:g}"/>' for x, y, z in mesh.vertices)
        triangles = "".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in mesh.faces)
        model = (
            '<?xml version="1.0"?><model unit="millimeter" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02"><resources>'
            f'<object id="1" type="model" name="bump"><mesh><vertices>{points}</vertices><triangles>{triangles}</triangles></mesh></object>'
            '</resources><build><item objectid="1"/></build></model>'
        ).encode()
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr("[Content_Types].xml", b"<Types/>")
        file.writestr("3D/3dmodel.model", model)
    return packed.getvalue()


def model_of(content: bytes) -> bytes:
    """The model inside a 3MF."""
    with zipfile.ZipFile(io.BytesIO(content)) as file:
        return file.read("3D/3dmodel.model")


def glb(bodies: Sequence[tuple[str, float]] = (("bump", 1.0),)) -> bytes:
    """Named, scaled copies of the part side by side, in metres."""
    scene = trimesh.Scene()
    for k, (name, scale) in enumerate(bodies):
        mesh = bump()
        mesh.apply_scale(scale / 1000)
        mesh.apply_translation([0.2 * k, 0, 0])
        scene.add_geometry(mesh, node_name=name, geom_name=name)
    content = scene.export(file_type="glb")
    assert isinstance(content, bytes)
    return content


def exported(kind: str, **options: object) -> bytes:
    """The part as a mesh file by trimesh."""
    content = bump().export(file_type=kind, **options)
    return content if isinstance(content, bytes) else content.encode()


FILES: dict[str, tuple[str, bytes]] = {
    "step": ("part.step", step(colours=((1, 0, 0), (0, 1, 0)))),
    "iges": ("part.igs", iges()),
    "stl": ("part.stl", exported("stl")),
    "stl-text": ("part.stl", text_stl(bump())),
    "obj": ("part.obj", exported("obj")),
    "ply": ("part.ply", exported("ply", encoding="ascii")),
    "ply-binary": ("part.ply", exported("ply")),
    "off": ("part.off", exported("off")),
    "glb": ("part.glb", glb((("bump", 1.0), ("bump small", 0.5)))),
    "3mf": ("part.3mf", threemf()),
}
