"""Region tables: what is read, which faults are named, what is refused. The table here is made up, 2 x 2 regions."""

# ruff: noqa: E501 (the tables have long header lines)

import csv
import io

import numpy as np
import pytest
import trimesh

from app.errors import MalformedTable
from app.geometry.region_table import RegionTable, read_region_table
from app.geometry.schematic import RELIEF, SIZE, patches, rows_of_patches
from app.geometry.table_text import decode_table

SYNTHETIC = """region_id,region_dims,edgewise_region_neighbors,neighbor_edge_dim,region_angles,corner_coords,corner_regions,max_curvature,z_max,mold_dimensions,user_preferred_sequence
a,"4,2","O,x,b,x,c,x,O","4,2,4,2",0,"0,0,x,4,0,x,4,2,x,0,2","O,O,d,O",0,0,"6,5","b,a,d,c"
b,"2,2","O,x,O,x,d,x,a","2,2,2,2",60,"4,0,x,6,0,x,6,2,x,4,2","O,O,O,c",0.5,1,,
c,"4,3","a,x,d,x,O,x,O","4,3,4,3",0,"0,2,x,4,2,x,4,5,x,0,5","O,b,O,O",-0.5,-1,,
d,"2,3","b,x,O,x,O,x,c","2,3,2,3",60,"4,2,x,6,2,x,6,5,x,4,5","a,O,O,O",0,2,,
"""
REAL = """Region,Curvature avg,neighbors,neighbor angles,neighbor edges,Shape complexity,Area/total area,Z avg,Z max,Corner Neighbors,region index,solution
a,-1,"O,x,b,x,c,x,O","x,10,-20,x","0.5,0.5,0.5,0.5",.8,.2,.9,1,"O,O,d,O","0,0","b,a,d,c"
b,2,"O,x,O,x,d,x,a","x,x,-20,-10","0.5,0.5,0.5,0.5",.8,.2,.9,.9,"O,O,O,c","0,1",
c,6,"a,x,d,x,O,x,O","20,10,x,x","0.5,0.5,0.5,0.5",.8,.3,.9,.5,"O,b,O,O","1,0",
d,5,"b,x,O,x,O,x,c","20,x,x,-10","0.5,0.5,0.5,0.5",.8,.3,.9,.5,"a,O,O,O","1,1",
"""


def synthetic(old: str = "", new: str = "") -> RegionTable:
    assert old in SYNTHETIC
    return read_region_table(SYNTHETIC.replace(old, new, 1) if old else SYNTHETIC)


def real(old: str = "", new: str = "") -> RegionTable:
    assert old in REAL
    return read_region_table(REAL.replace(old, new, 1) if old else REAL)


def test_synthetic_values():
    table = synthetic()
    graph = table.tool.graph
    assert (table.layout, graph.source, table.faults) == ("synthetic", "synthetic", ())
    assert table.expert == (1, 0, 3, 2)
    assert graph.shared[0].tolist() == [0, 2 / 12, 4 / 12, 0]
    assert graph.opposite[0].tolist() == [0, 2 / 6, 4 / 6, 0]  # opposite the outer edges, over half the perimeter
    assert graph.angle[0].tolist() == pytest.approx([0, 1 / np.radians(60), 0, 0])
    assert graph.first.tolist() == [1, 3, 0, 1]
    assert graph.corner[0].tolist() == [False, False, False, True]
    assert graph.area.tolist() == [8, 4, 12, 6]
    assert (graph.low[3].tolist(), graph.high[3].tolist()) == ([4, 2], [6, 5])
    assert graph.curvature.tolist() == [0, 0.5, -0.5, 0]
    assert graph.height.tolist() == [0, 1, -1, 2]


def test_real_values():
    table = real()
    graph = table.tool.graph
    assert (table.layout, graph.source, table.faults) == ("real", "real", ())
    assert graph.shared[0].tolist() == [0, 0.25, 0.25, 0]
    assert graph.opposite[0].tolist() == [0, 0.25, 0.25, 0]
    assert np.degrees(graph.angle[0]).tolist() == pytest.approx([0, 10, -20, 0])
    assert graph.low.tolist() == [[0, 0], [0, 1], [1, 0], [1, 1]]
    assert graph.area.tolist() == [0.2, 0.2, 0.3, 0.3]
    assert graph.height.tolist() == [1, 0.9, 0.5, 0.5]


def test_text_may_come_from_any_program():
    odd = "\ufeff" + SYNTHETIC.replace("\n", "\r\n\r\n").replace('"O,x,b,x,c,x,O"', '" O, x ,b,X,c ,x,O"').replace(
        "region_dims", " Region Dims "
    )
    table, plain = read_region_table(odd), synthetic()
    assert table.faults == ()
    assert table.expert == plain.expert
    assert np.array_equal(table.tool.graph.shared, plain.tool.graph.shared)


def test_columns_are_found_by_name():
    lines = [line.rsplit(",", 1) for line in REAL.replace('"b,a,d,c"', "").strip().splitlines()]
    table = read_region_table("\n".join(f"{last},{rest}" for rest, last in lines))
    assert table.expert is None
    assert table.tool.graph.area.tolist() == [0.2, 0.2, 0.3, 0.3]


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        ('"a,O,O,O"', '"O,O,O,O"', "Row a: lists d as a corner neighbour, but row d doesn't list a."),
        ('"O,b,O,O"', '"O,b,d,O"', "Row c: lists d as a corner neighbour and as an edge neighbour."),
        ('"2,3,2,3",60', '"2,3,2,2.5",60', "Rows c and d: their common border is 3 in row c and 2.5 in row d."),
        ('"O,x,O,x,d,x,a"', '"O,x,O,x,d,x,O"', "Row a: lists b as a neighbour, but row b doesn't list a."),
        ('"O,x,O,x,d,x,a"', '"O,x,b,x,d,x,a"', "Row b: lists itself (b) as a neighbour."),
        ('"2,3","b', '"2,4","b', "Row d: the size '2,4' has area 8, its corner points enclose 6."),
        ('"2,3","b', '"2,4","b', "All rows: the areas add up to 32, the tool's rectangle has 30."),
        ("6,5,x,4,5", "6,5,x,5,5", "Row d: the corner points '4,2,x,6,2,x,6,5,x,5,5' are not those of a rectangle; their box is used."),
        ("0,0,x,4,0,x,4,2,x,0,2", "0,0,x,5,0,x,5,2,x,0,2", "Rows a and b: their rectangles overlap by 2."),
        (
            '"O,x,b,x,c,x,O"',
            '"O,x,b,,x,c,x,O"',
            "Row a: 'O,x,b,,x,c,x,O' in 'edgewise_region_neighbors' has a stray comma; it is left out.",
        ),
        ("0.5,1,,", "0.5,1,,,spare", "Row b: the line has 12 cells for 11 columns; the last ones are left out."),
        ("0.5,1,,", '0.5,1,,"a,b,c,d"', "Row b: a second sequence 'a,b,c,d' is left out."),
        ('"O,x,O,x,d,x,a","2,2,2,2"', '"O,x,O,x,d,x,a,a","2,2,2,1,1"', "Row b: lists a 2 times; the last length (1) counts each time."),
    ],
)
def test_faults_of_synthetic_tables_are_named(old: str, new: str, fault: str):
    assert fault in synthetic(old, new).faults


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        (
            "x,x,-20,-10",
            "x,x,-20,10",
            "Rows a and b: the angle between them is 10 degrees in row a and 10 in row b; expected opposite signs.",
        ),
        (".8,.2,.9,1", ".8,.1,.9,1", "All rows: the shares of the area add up to 0.9 instead of 1."),
        ('"1,1"', '"1,0"', "Row d: the position '1,0' is also that of row c."),
        ('"x,10,-20,x"', '"x,10,-20,x,x"', "holds 5 angles for 4 neighbours; the last ones are left out."),
    ],
)
def test_faults_of_real_tables_are_named(old: str, new: str, fault: str):
    assert any(fault in sentence for sentence in real(old, new).faults)


def test_surplus_length_is_read_as_the_authors_do_and_named():
    """A comma for a point: 0,5 shifts the lengths, and the perimeter takes all five."""
    table = real('"0.5,0.5,0.5,0.5",.8,.2,.9,1', '"0.5,0,5,0.5,0.5",.8,.2,.9,1')
    assert "Row a: '0.5,0,5,0.5,0.5' in 'neighbor edges' holds 5 lengths for 4 neighbours" in table.faults[0]
    assert table.tool.graph.shared[0].tolist() == pytest.approx([0, 0, 5 / 6.5, 0])


def test_a_neighbour_listed_twice_counts_its_last_length_twice():
    """As in the authors' code: 0.5 and 1 count as 1 and 1."""
    graph = synthetic('"O,x,O,x,d,x,a","2,2,2,2"', '"O,x,O,x,d,x,a,a","2,2,2,0.5,1"').tool.graph
    assert graph.shared[1].tolist() == pytest.approx([2 / 8, 0, 0, 2 / 8])


@pytest.mark.parametrize(
    ("old", "new", "row", "column", "value"),
    [
        ('"O,x,b,x,c,x,O"', '"O,x,b,x,c"', "Row a (line 2)", "edgewise_region_neighbors", "'O,x,b,x,c'"),
        ('"O,x,b,x,c,x,O"', '"O,x,b,x,,x,O"', "Row a", "edgewise_region_neighbors", "3 sides"),
        ('"O,x,b,x,c,x,O"', '"O,x,q,x,c,x,O"', "Row a", "edgewise_region_neighbors", "'q'"),
        ('"4,2,4,2"', '"4,2,4"', "Row a", "neighbor_edge_dim", "'4,2,4'"),
        ('"2,2,2,2",60', '"2,two,2,2",60', "Row b", "neighbor_edge_dim", "'two'"),
        ('"2,2,2,2",60', '"2,2,2,2",nan', "Row b", "region_angles", "'nan'"),
        ('"4,3","a', '"4","a', "Row c", "region_dims", "'4'"),
        ('"4,3","a', '"4,-3","a', "Row c", "region_dims", "'4,-3'"),
        ("0,0,x,4,0,x,4,2,x,0,2", "0,0,x,4,0,x,4,x,0,2", "Row a", "corner_coords", "0,0,x,4,0,x,4,x,0,2"),
        ("0,0,x,4,0,x,4,2,x,0,2", "0,0,x,4,0,x,4,0,x,0,0", "Row a", "corner_coords", "no area"),
        ("-0.5,-1,,", ",-1,,", "Row c", "max_curvature", "the empty cell"),
        ("\nd,", "\nc,", "Row c (line 5)", "region_id", "twice"),
        ("\nd,", "\nx,", "Row x", "region_id", "can't name"),
    ],
)
def test_unreadable_cells_are_refused_by_row_column_and_value(old: str, new: str, row: str, column: str, value: str):
    with pytest.raises(MalformedTable) as caught:
        synthetic(old, new)
    message = str(caught.value)
    assert row in message
    assert f"'{column}'" in message
    assert value in message


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('"x,10,-20,x"', '"x,10,x"', "3 angles for 4 neighbours"),
        ('"x,10,-20,x"', '"x,10,x,x"', "not a number at 'x'"),
        (".8,.2,.9,1", ".8,0,.9,1", "above 0"),
        (".8,.2,.9,1", ".8,.2,.9,0", "divides by it"),
        ('"0,0"', '"0"', "two numbers"),
    ],
)
def test_unreadable_cells_of_real_tables_are_refused(old: str, new: str, words: str):
    with pytest.raises(MalformedTable, match=words):
        real(old, new)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "is empty"),
        ("name,price\nglove,3\n", "not that of a region table"),
        (SYNTHETIC.splitlines()[0], "lists 0 regions"),
        (SYNTHETIC.replace("max_curvature,", "bend,"), "no column 'max_curvature'"),
        ("\0\0\1", "not text"),
    ],
)
def test_what_is_no_region_table_is_refused(text: str, words: str):
    with pytest.raises(MalformedTable, match=words):
        read_region_table(text, file_name="part.csv")


def test_a_table_of_the_other_layout_is_refused_by_its_header():
    with pytest.raises(MalformedTable, match=r"not that of a synthetic table, which needs: region_id"):
        read_region_table(REAL, "synthetic")


@pytest.mark.parametrize("read", [synthetic, real])
def test_drawn_tool_is_closed_and_shows_every_region(read):
    table = read()
    tool, part = table.tool, trimesh.Trimesh(table.tool.mesh.vertices, table.tool.mesh.faces, process=False)
    assert part.is_watertight
    assert part.volume > 0
    assert np.ptp(tool.mesh.vertices[:, :2], axis=0).max() == pytest.approx(SIZE)
    assert [r.name for r in tool.regions] == ["A", "B", "C", "D"]
    plan = np.array([part.area_faces[tool.labels == a] @ np.abs(part.face_normals[tool.labels == a, 2]) for a in range(4)])
    assert plan / plan.sum() == pytest.approx(tool.graph.area / tool.graph.area.sum(), abs=1e-9)
    assert [r.area for r in tool.regions] == pytest.approx([part.area_faces[tool.labels == a].sum() for a in range(4)])
    assert all(r.normal[2] > 0.5 and np.linalg.norm(r.normal) == pytest.approx(1) for r in tool.regions)


def test_first_row_lies_at_the_back_left_and_high_regions_are_lifted():
    regions = synthetic().tool.regions
    assert regions[0].centroid[0] < regions[1].centroid[0]
    assert regions[0].centroid[1] > regions[2].centroid[1]
    assert regions[3].centroid[2] > regions[2].centroid[2] + RELIEF / 2
    words = [r.description for r in regions]
    assert words == ["Back, flat", "Back right, curved outwards", "Front, curved inwards", "Front right, flat"]


def test_patches_leave_gaps_unlabelled_and_show_the_smaller_of_two():
    low, high = np.array([[0, 0], [1, 0], [3, 0.0]]), np.array([[2, 1], [1.5, 1], [4, 1.0]])
    mesh, labels = patches(low, high, np.zeros(3))
    corners = mesh.vertices[mesh.faces]
    size = np.array([np.linalg.norm(np.cross(*(c[1:] - c[0])), axis=-1) / 2 for c in corners])
    share = [size[labels == a].sum() / (SIZE / 4) ** 2 for a in range(3)]
    assert share == pytest.approx([1.5, 0.5, 1.0], abs=1e-6)
    assert (labels == -1).sum() > 0


def test_rows_of_patches_have_the_listed_areas():
    area = np.array([0.1, 0.3, 0.2, 0.2])
    low, high = rows_of_patches(np.array([[0, 2], [1, 0], [0, 1], [1, 1]]), area)
    assert np.prod(high - low, axis=1) == pytest.approx(area / area.sum())
    assert low[2].tolist() == [0, 0]
    assert high[1, 0] == pytest.approx(0.6)


def same(table: RegionTable, plain: RegionTable) -> bool:
    """Whether two tables mean the same tool."""
    names = ("shared", "opposite", "angle", "neighbour", "corner", "curvature", "height", "area", "low", "high")
    return table.expert == plain.expert and all(np.array_equal(getattr(table.tool.graph, k), getattr(plain.tool.graph, k)) for k in names)


@pytest.mark.parametrize(
    ("layout", "old", "new", "told"),
    [
        ("synthetic", '"O,x,b,x,c,x,O"', '"O,x,b,c,x,O"', "Row a: 'O,x,b,c,x,O' in 'edgewise_region_neighbors' lists 3 sides instead of 4"),
        ("synthetic", '"b,x,O,x,O,x,c"', '"b,x,O,O,x,c"', "read as 'b,x,O,x,O,x,c', which agrees with the neighbours' rows."),
        ("synthetic", '"O,x,O,x,d,x,a"', '"O,O,d,a"', "read as 'O,x,O,x,d,x,a'"),
        ("synthetic", '"O,x,O,x,d,x,a"', "\"['O', 'x', 'O', 'x', 'd', 'x', 'a']\"", None),
        ("synthetic", '"O,x,O,x,d,x,a"', '"O x O x d x a"', None),
        ("synthetic", '"O,x,O,x,d,x,a"', '"O;x;O;x;d;x;a"', None),
        ("synthetic", '"O,x,O,x,d,x,a"', '"o,x,0,x,d,x,a"', "Row b: 'o,x,0,x,d,x,a' in 'edgewise_region_neighbors' has '0'; read as O"),
        ("synthetic", '"O,x,O,x,d,x,a"', '"O,x,O,3.5,x,d,x,a"', "has the stray number '3.5'; it is left out."),
        ("synthetic", "neighbor_edge_dim", "neighbour_edge_dim", "'neighbour_edge_dim' is read as the column 'neighbor_edge_dim'"),
        ("synthetic", "\nc,", "\n,,,,see notes\nc,", "Line 4 names no region; it is left out: 'see notes'."),
        ("synthetic", "region_id", "Tool 7\nregion_id", "Line 1: 'Tool 7' stands above the header; it is left out."),
        ("synthetic", '"b,a,d,c"', '"b->a->d->c"', None),
        ("real", '"x,10,-20,x"', '"10,-20"', "Row a: '10,-20' in 'neighbor angles' holds 2 angles for 4 entries; read as those"),
        ("real", ",.2,.9,1,", ',"0,2",.9,1,', "Row a: '0,2' in 'Area/total area' has a decimal comma; read as 0.2."),
    ],
)
def test_odd_forms_are_read_and_told(layout: str, old: str, new: str, told: str | None) -> None:
    """Each means the same tool as the table without the slip; what was assumed is said, once."""
    read, source = {"synthetic": (synthetic, SYNTHETIC), "real": (real, REAL)}[layout]
    assert old in source
    table = read(old, new)
    assert same(table, read())
    assert len(table.faults) == (told is not None) or "'0'" in str(told)
    assert told is None or any(told in sentence for level, sentence in table.lines if level == "repaired")


def test_spreadsheets_of_other_countries() -> None:
    """Semicolons between columns, decimal commas in single cells, a line about the separator, an old code page."""
    rows = list(csv.reader(REAL.splitlines()))
    decimal = [[c.replace(".", ",") if c.count(".") == 1 and "," not in c else c for c in row] for row in rows]
    out = io.StringIO()
    csv.writer(out, delimiter=";").writerows(decimal)
    table = read_region_table("sep=;\r\n" + out.getvalue())
    assert same(table, real())
    assert ("info", "The columns are separated by semicolons.") in table.lines
    assert decode_table("Größe".encode("cp1252"), "t.csv") == "Größe"
    assert same(read_region_table(decode_table(REAL.encode("utf-16"), "t.csv")), real())


@pytest.mark.parametrize("sequence", ["b,a,b,c", "b,a,d", "b,a,d,z"])
def test_an_unusable_sequence_is_left_out_and_said(sequence: str) -> None:
    table = synthetic('"b,a,d,c"', f'"{sequence}"')
    assert table.expert is None
    assert any(f"Row a: '{sequence}' in 'user_preferred_sequence' does not hold every region once" in s for s in table.faults)


def test_columns_that_can_be_worked_out() -> None:
    """Without the position of the regions it follows from who lies on which side; sizes follow from corner points."""
    rows = list(csv.reader(REAL.splitlines()))
    without = ["" if c == "region index" else c for c in rows[0]]
    out = io.StringIO()
    csv.writer(out).writerows([without, *rows[1:]])
    table = read_region_table(out.getvalue())
    assert same(table, real())
    assert table.faults == ("The header has no column 'region index': rows and columns are worked out from the neighbours.",)
    sizes = synthetic("region_dims", "spare")
    assert np.array_equal(sizes.tool.graph.area, synthetic().tool.graph.area)
    corners = synthetic("corner_regions", "spare")
    assert not corners.tool.graph.corner.any()
    assert "no region has corner neighbours" in corners.faults[0]


def test_lists_that_lost_their_quotes_are_refused_with_advice() -> None:
    with pytest.raises(MalformedTable, match=r"Row a \(line 2\) has .* cells for 11 columns. Put every list in double quotes"):
        read_region_table(SYNTHETIC.replace('"', ""))


def test_a_repeated_line_counts_once_and_a_changed_one_is_refused() -> None:
    line = SYNTHETIC.splitlines()[-1]
    table = read_region_table(SYNTHETIC + line + "\n")
    assert same(table, synthetic())
    assert table.faults == ("Row d: line 6 repeats line 5; it is left out.",)
    with pytest.raises(MalformedTable, match="twice"):
        read_region_table(SYNTHETIC + line.replace("60", "61") + "\n")


def test_separators_that_nobody_can_place_are_refused() -> None:
    """Three outer edges and one neighbour without any separator fit four ways round unless the neighbour says which side."""
    with pytest.raises(MalformedTable, match="lists 2 sides instead of 4, and the neighbours' rows don't tell which"):
        synthetic('"O,x,b,x,c,x,O"', '"O,x,b"')


def test_more_than_26_regions() -> None:
    """A row of thirty regions aa, ab, ...: names stay as listed."""
    names = [f"a{chr(97 + k)}" for k in range(23)] + [f"b{chr(97 + k)}" for k in range(7)]
    header = REAL.splitlines()[0]
    lines = []
    for k, name in enumerate(names):
        left, right = (names[k - 1] if k else "O"), (names[k + 1] if k < 29 else "O")
        lines.append(f'{name},1,"O,x,{right},x,O,x,{left}","0,0,0,0","1,1,1,1",1,{1 / 30},1,1,"O,O,O,O","0,{k}",')
    table = read_region_table("\n".join([header, *lines]))
    assert table.tool.n == 30
    assert table.tool.regions[29].name == "BG"
