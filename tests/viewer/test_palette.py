"""The colours are those of the pages, and the ramp of the order only gets lighter."""

import re

import numpy as np
import pytest

from app.viewer.palette import DARK, LIGHT, Theme, faded, from_oklab, oklab, ramp, rgb, tint_choice
from tests.conftest import ROOT

TOKENS = ROOT / "static" / "css" / "tokens.css"
NAMES = {
    "seq-stops": "seq_stops", "region-tints": "region_tints", "signal": "current", "state-differs": "differs", "state-conflict": "conflict",
    "surface": "surface", "ink-2": "label_ink", "scene-top": "scene_top", "scene-bottom": "scene_bottom", "scene-grid": "grid",
    "scene-edge": "edge", "scene-body": "body", "scene-arm": "arm", "scene-arm-2": "arm_joint", "scene-ambient": "ambient",
}  # fmt: skip


def tokens(dark: bool) -> dict[str, str]:
    """Custom properties of the light root block, or of the dark one on top of it."""
    css = re.sub(r"/\*.*?\*/", "", TOKENS.read_text(), flags=re.S)
    light = re.search(r":root \{(.*?)\n\}", css, re.S)
    night = re.search(r':root\[data-theme="dark"\] \{(.*?)\n\}', css, re.S)
    assert light
    assert night
    blocks = light[1] + (night[1] if dark else "")
    return {name: value.strip() for name, value in re.findall(r"--([\w-]+):\s*([^;]+);", blocks)}


@pytest.mark.parametrize(("theme", "dark"), [(LIGHT, False), (DARK, True)])
def test_palette_equals_the_tokens_of_the_pages(theme: Theme, dark: bool) -> None:
    css = tokens(dark)
    for token, name in NAMES.items():
        value = getattr(theme, name)
        written = " ".join(value) if isinstance(value, tuple) else value
        assert (float(css[token]) if isinstance(value, float) else css[token]) == written, token


@pytest.mark.parametrize(("theme", "dark"), [(LIGHT, False), (DARK, True)])
def test_ramp_of_twelve_equals_the_listed_steps(theme: Theme, dark: bool) -> None:
    css = tokens(dark)
    assert [rgb(css[f"seq-{k}"]) for k in range(1, 13)] == list(ramp(12, dark))


@pytest.mark.parametrize("dark", [False, True])
@pytest.mark.parametrize("n", [2, 5, 12, 40, 200])
def test_ramp_only_gets_lighter_in_equal_steps(n: int, dark: bool) -> None:
    labs = np.array([oklab(colour) for colour in ramp(n, dark)])
    assert (np.diff(labs[:, 0]) > 0 if n <= 40 else np.diff(labs[:, 0]) >= -1e-3).all()
    steps = np.linalg.norm(np.diff(labs, axis=0), axis=1)
    if n == 40:  # corners at the stops and rounding to bytes shorten a few chords
        assert np.abs(steps / np.median(steps) - 1).max() < 0.25


def test_oklab_of_known_colours() -> None:
    """White has lightness 1 and no hue; red as published with the colour space."""
    assert np.allclose(oklab((255, 255, 255)), [1, 0, 0], atol=1e-3)
    assert np.allclose(oklab((255, 0, 0)), [0.62796, 0.22486, 0.12585], atol=1e-3)
    assert from_oklab(oklab((194, 65, 12))) == (194, 65, 12)


def test_fading_goes_62_percent_of_the_way_to_the_surface() -> None:
    assert np.allclose(oklab(faded((0, 0, 0), dark=False))[0], 0.62, atol=0.005)
    assert faded(rgb(LIGHT.surface), dark=False) == rgb(LIGHT.surface)


def test_neighbours_have_different_tints_and_others_those_of_their_number() -> None:
    neighbour = np.zeros((12, 12), bool)
    for a, b in ((0, 8), (1, 2), (3, 11)):  # 8 and 11 would take the tints of 0 and 3
        neighbour[a, b] = neighbour[b, a] = True
    chosen = tint_choice(neighbour)
    assert all(chosen[a] != chosen[b] for a, b in zip(*np.nonzero(neighbour), strict=True))
    assert [chosen[k] for k in (0, 1, 7, 9)] == [0, 1, 7, 1]
