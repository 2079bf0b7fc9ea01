"""Plots are valid SVG with the curve where the numbers say."""

import xml.etree.ElementTree as ET

import numpy as np
import pytest

from app.benches.plots import HEIGHT, LEFT, SOFT_INK, THICK, Bars, Curve, Plot, as_svg, bars_as_svg, ticks

SVG = "{http://www.w3.org/2000/svg}"


@pytest.mark.parametrize(
    ("low", "high", "wanted"),
    [(0, 60, [0, 10, 20, 30, 40, 50, 60]), (0, 0.83, [0, 0.2, 0.4, 0.6, 0.8, 1.0]), (-3, 4, [-4, -2, 0, 2, 4]), (0, 0, None)],
)
def test_ticks_are_round_and_span_the_values(low: float, high: float, wanted: list[float] | None):
    found = ticks(low, high)
    assert found[0] <= low
    assert found[-1] >= high
    assert wanted is None or found == pytest.approx(wanted)


def test_curve_band_and_words():
    x = np.arange(3.0)
    curve = Curve("all <terms>", x, x * 2, x * 2 - 1, x * 2 + 1)
    root = ET.fromstring(as_svg(Plot("Spread & shift", "Update", "Cost", (curve,))))
    line, area = root.find(f"{SVG}polyline"), root.find(f"{SVG}polygon")
    assert line is not None
    assert area is not None
    points = [tuple(map(float, p.split(","))) for p in line.attrib["points"].split()]
    assert points[0][0] == LEFT
    assert [p[1] for p in points] == sorted((p[1] for p in points), reverse=True)
    assert points[1][1] == pytest.approx((points[0][1] + points[2][1]) / 2, abs=0.11)
    assert len(area.attrib["points"].split()) == 6
    assert all(0 <= y <= HEIGHT for _, y in points)
    words = [t.text for t in root.iter(f"{SVG}text")]
    assert {"Spread & shift", "Update", "Cost", "all <terms>"} <= set(words)


def test_bars_are_as_long_as_their_values():
    groups = {"before": np.array([50.0, 0.0]), "after": np.array([100.0, 100.0])}
    words = {"before": ("1 of 2", "0 of 2"), "after": ("2 of 2", "2 of 2")}
    root = ET.fromstring(bars_as_svg(Bars("Sides", "%", ("left", "few <changes>"), groups, words, most=100)))
    bars = [r for r in root.findall(f"{SVG}rect") if r.attrib["height"] == str(THICK - 2)]
    before, nothing, after, all_ = (float(b.attrib["width"]) for b in bars)
    assert before == pytest.approx(after / 2, abs=0.2)
    assert nothing == 1
    assert all_ == after
    assert {"left", "few <changes>", "before", "after", "1 of 2", "0 of 2", "2 of 2", "100"} <= {t.text for t in root.iter(f"{SVG}text")}
    height = float(root.attrib["height"])
    assert all(0 < float(t.attrib["y"]) < height for t in root.iter(f"{SVG}text"))


def test_a_high_curve_is_not_squeezed_under_an_axis_from_0():
    x = np.arange(3.0)
    near, far = (as_svg(Plot("", "", "", (Curve("a", x, y),))) for y in (np.array([0.9, 1.0, 1.1]), np.array([0.1, 1.0, 1.1])))
    assert ">0</text>" not in near.replace(f'text-anchor="middle" fill="{SOFT_INK}">0</text>', "")
    assert f'text-anchor="end" fill="{SOFT_INK}">0</text>' in far
