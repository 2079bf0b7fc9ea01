"""The product's own region tables: the templates, what follows from rectangles, and every complaint."""

import json
from typing import Any

import numpy as np
import pytest

from app.errors import MalformedTable
from app.geometry.own_table import TEMPLATE_CSV, template_json
from app.geometry.region_table import RegionTable, read_region_table

COLUMNS = "region,x_mm,y_mm,width_mm,depth_mm,height_mm,curvature_per_m,tilt_right_deg,neighbours,corners,sequence"
# two above two, like the template; neighbours and corners are left to the rectangles
PLAIN = f"""{COLUMNS}
a,0,200,400,300,60,-2,0,,,"b,a,d,c"
b,400,200,200,300,70,0,0,,,
c,0,0,400,200,20,0,0,,,
d,400,0,200,200,30,4,10,,,
"""


def plain(old: str = "", new: str = "") -> RegionTable:
    assert old in PLAIN
    return read_region_table(PLAIN.replace(old, new, 1) if old else PLAIN)


def changed(**entries: Any) -> str:
    """The JSON template with some entries of its first region replaced."""
    table = json.loads(template_json())
    table["regions"][0] |= entries
    return json.dumps(table)


def test_both_templates_are_the_same_sound_tool() -> None:
    tables = [read_region_table(TEMPLATE_CSV), read_region_table(template_json())]
    for table in tables:
        assert (table.layout, table.lines, table.expert) == ("apprentice", (), (1, 0, 3, 2))
        assert table.tool.graph.source == "mesh"
        assert [r.name for r in table.tool.regions] == ["Back left", "Back right", "Front left", "Front right"]
    first, second = (table.tool.graph for table in tables)
    assert all(np.array_equal(getattr(first, name), getattr(second, name)) for name in vars(first))


def test_values_follow_from_the_rectangles() -> None:
    """a is 400 x 300 mm with b over 300 mm and c over 400 mm of its 1400 mm perimeter; the tool is 600 x 500 mm."""
    graph = plain().tool.graph
    assert plain().faults == ()
    assert graph.shared[0].tolist() == pytest.approx([0, 300 / 1400, 400 / 1400, 0])
    assert graph.opposite[0].tolist() == pytest.approx([0, 300 / 1400, 400 / 1400, 0])  # its left and back lie at the edge
    assert graph.corner.tolist() == [[False] * 3 + [True], [False, False, True, False], [False, True, False, False], [True] + [False] * 3]
    assert graph.first.tolist() == [1, 3, 0, 1]
    assert graph.area.tolist() == pytest.approx([0.4, 0.2, 4 / 15, 2 / 15])
    assert graph.height.tolist() == pytest.approx([0.8, 1, 0, 0.2])
    assert graph.curvature.tolist() == pytest.approx([-1, 0, 0, 1])  # 2/m over a tool of sqrt(0.3) m is beyond the scale
    assert np.degrees(graph.angle[1]).tolist() == pytest.approx([0, 0, 0, 10])  # d is 10 degrees steeper
    assert np.array_equal(graph.angle, -graph.angle.T)


def test_a_listed_angle_counts_for_both_rows() -> None:
    graph = plain("60,-2,0,,", '60,-2,0,"right:b:300:-12 front:c:400",').tool.graph
    assert np.degrees(graph.angle[0, 1]) == pytest.approx(-12)
    assert np.degrees(graph.angle[1, 0]) == pytest.approx(12)


@pytest.mark.parametrize("text", [PLAIN.replace(",", ";").replace('"b;a;d;c"', '"b,a,d,c"'), "\ufeff" + PLAIN.replace("\n", "\r\n")])
def test_text_may_come_from_any_program(text: str) -> None:
    table = read_region_table(text)
    assert table.faults == ()
    assert np.array_equal(table.tool.graph.shared, plain().tool.graph.shared)


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        ("60,-2,0,,", "60,-2,0,right:b:300,", "Row a: touches c but doesn't list it as a neighbour."),
        ("60,-2,0,,", "60,-2,0,right:b:300,", "Row c: lists a as a neighbour, but row a doesn't list c."),
        ("60,-2,0,,", '60,-2,0,"right:b:250 front:c:400",', "Rows a and b: their common border is 250 mm in row a and 300 mm in row b."),
        (
            "60,-2,0,,",
            '60,-2,0,"right:b:350 front:c:400",',
            "Row a: the neighbours at the right take 350 mm of a side that is 300 mm long.",
        ),
        ("60,-2,0,,", '60,-2,0,"right:b:300 front:c:400 left:a:5",', "Row a: lists itself as a neighbour; left out."),
        ("a,0,200,400", "a,0,200,450", "Rows a and b: their rectangles overlap by 15000 mm²."),
        ('"b,a,d,c"', '"b,a,d"', "The sequence 'b,a,d' does not hold every region once (see c)"),
        ("tilt_right_deg", "tilting", "The header: the columns 'tilting' are not known and left out."),
        ("\nc,", "\n,,,,,x\nc,", "names no region; it is left out"),
    ],
)
def test_faults_are_named(old: str, new: str, fault: str) -> None:
    assert any(fault in sentence for sentence in plain(old, new).faults)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (PLAIN.replace("400,300,60", "400,wide,60"), ["Row a (line 2)", "'depth_mm'", "'wide'", "12.5"]),
        (PLAIN.replace("400,300,60", "400,-300,60"), ["Row a (line 2)", "'depth_mm'", "'-300'", "above 0"]),
        (PLAIN.replace("400,300,60", "400,,60"), ["Row a", "'depth_mm'", "the empty entry"]),
        (PLAIN.replace("4,10", "4,95"), ["Row d", "'tilt_right_deg'", "'95'", "-89 to 89"]),
        (PLAIN.replace("60,-2,0,,", "60,-2,0,up:b:300,"), ["Row a", "'neighbours'", "'up:b:300'", "sides are back, right, front, left"]),
        (PLAIN.replace("60,-2,0,,", "60,-2,0,right:b,"), ["Row a", "'right:b'"]),
        (PLAIN.replace("60,-2,0,,", "60,-2,0,right:z:300,"), ["Row a", "'z'", "Choose from: a, b, c, d"]),
        (PLAIN.replace("\nd,", "\nc,"), ["Row c (line 5)", "twice"]),
        (PLAIN.replace("height_mm,", "top,"), ["no column 'height_mm'"]),
        (PLAIN.splitlines()[0], ["lists 0 regions"]),
        (changed(width_mm="wide"), ["Region a (number 1)", "'width_mm'", "'wide'"]),
        (changed(width_mm=True), ["'width_mm'", "True"]),
        (changed(neighbours=[{"side": "right"}]), ["'neighbours'", "side:region:length_mm"]),
        (changed(corners=["q"]), ["'corners'", "'q'"]),
        (changed(region=None), ["'region'", "can't name"]),
        ("{", ["not valid JSON at line 1"]),
        ('{"regions": 3}', ["no list 'regions'"]),
        ("[1, 2]", ["no list 'regions'"]),
    ],
)
def test_refusals_name_row_column_and_value(text: str, words: list[str]) -> None:
    with pytest.raises(MalformedTable) as caught:
        read_region_table(text)
    for word in words:
        assert word in str(caught.value)


def test_another_schema_is_said() -> None:
    table = read_region_table(template_json().replace("table/1", "table/7"))
    assert table.faults == ("The schema is 'apprentice-region-table/7'; read as 'apprentice-region-table/1'.",)
