"""Colours of the 3D view: the same values as static/css/tokens.css (a test compares them), and the ramp of the order."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

Rgb = tuple[int, int, int]
FADE = 0.62  # share of the surface colour in regions that two orders treat alike

_TO_LMS = np.array(
    [[0.4122214708, 0.5363325363, 0.0514459929], [0.2119034982, 0.6806995451, 0.1073969566], [0.0883024619, 0.2817188376, 0.6299787005]]
)
_TO_LAB = np.array(
    [[0.2104542553, 0.7936177850, -0.0040720468], [1.9779984951, -2.4285922050, 0.4505937099], [0.0259040371, 0.7827717662, -0.8086757660]]
)


@dataclass(frozen=True)
class Theme:
    """One set of tokens, as hexadecimal sRGB."""

    seq_stops: tuple[str, ...]
    region_tints: tuple[str, ...]
    current: str  # outline of the region at hand
    differs: str  # outline of regions that two orders treat differently
    conflict: str
    surface: str
    label_ink: str  # letters printed on regions nobody has done yet
    scene_top: str
    scene_bottom: str
    grid: str
    edge: str
    body: str
    arm: str
    arm_joint: str
    ambient: float


LIGHT = Theme(
    seq_stops=("#443493", "#1d66a7", "#0698a4", "#53c48e", "#ead745"),
    region_tints=("#f6e2d1", "#d7e8fb", "#e7e9d0", "#e7e2fa", "#cfedef", "#fbdedd", "#d8eddb", "#f6deed"),
    current="#c2410c",
    differs="#c2410c",
    conflict="#a5123f",
    surface="#ffffff",
    label_ink="#4b5257",
    scene_top="#fbfbfa",
    scene_bottom="#e9e9e6",
    grid="#d4d4cf",
    edge="#ffffff",
    body="#c9cccd",
    arm="#e3e5e6",
    arm_joint="#5d676d",
    ambient=0.80,
)
DARK = Theme(
    seq_stops=("#5d52b4", "#387ec1", "#21abb8", "#61d19a", "#f2e15f"),
    region_tints=("#534538", "#3c4957", "#484938", "#484556", "#364c4e", "#564241", "#3d4c40", "#52424c"),
    current="#f4743b",
    differs="#ff8f57",
    conflict="#ff8ca6",
    surface="#1d2124",
    label_ink="#b6bdc1",
    scene_top="#23282b",
    scene_bottom="#171a1c",
    grid="#32383c",
    edge="#1d2124",
    body="#4a5156",
    arm="#aab2b6",
    arm_joint="#59636a",
    ambient=0.74,
)


def theme(dark: bool) -> Theme:
    return DARK if dark else LIGHT


def rgb(colour: str) -> Rgb:
    """(194, 65, 12) of "#c2410c"."""
    value = int(colour.lstrip("#"), 16)
    return value >> 16, value >> 8 & 255, value & 255


def linear(colour: NDArray[np.float64]) -> NDArray[np.float64]:
    """Linear light of sRGB values in [0, 1]."""
    return np.where(colour <= 0.04045, colour / 12.92, ((colour + 0.055) / 1.055) ** 2.4)


def oklab(colour: Rgb) -> NDArray[np.float64]:
    """Lightness and the two hue axes of an sRGB colour (Ottosson 2020)."""
    return _TO_LAB @ np.cbrt(_TO_LMS @ linear(np.array(colour) / 255))


def from_oklab(lab: NDArray[np.float64]) -> Rgb:
    """The nearest sRGB colour; values outside the gamut are clipped."""
    light = np.linalg.solve(_TO_LMS, np.linalg.solve(_TO_LAB, lab) ** 3).clip(0, 1)
    encoded = np.where(light <= 0.0031308, light * 12.92, 1.055 * light ** (1 / 2.4) - 0.055)
    r, g, b = np.rint(encoded * 255).astype(int).tolist()
    return r, g, b


@lru_cache(maxsize=256)
def ramp(n: int, dark: bool) -> tuple[Rgb, ...]:
    """Colours of the steps 1..n: dark to light, equal steps in OKLab along the line through the stops."""
    stops = np.array([oklab(rgb(stop)) for stop in theme(dark).seq_stops])
    passed = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(stops, axis=0), axis=1))])
    at = np.linspace(0, passed[-1], n) if n > 1 else np.zeros(n)
    return tuple(from_oklab(np.array([np.interp(t, passed, stops[:, axis]) for axis in range(3)])) for t in at)


def faded(colour: Rgb, dark: bool) -> Rgb:
    """`colour` mixed in OKLab with the surface colour, as for regions that don't matter to a question."""
    return mixed(colour, rgb(theme(dark).surface), FADE)


def mixed(colour: Rgb, other: Rgb, share: float) -> Rgb:
    """Two colours mixed in OKLab, `share` of the other."""
    return from_oklab((1 - share) * oklab(colour) + share * oklab(other))


def tint_choice(neighbour: NDArray[np.bool_], tints: int = 8) -> tuple[int, ...]:
    """A tint for every region: the one of its number, as in the lists, unless an earlier neighbour has it."""
    chosen: list[int] = []
    for region, row in enumerate(neighbour):
        taken = {chosen[other] for other in np.flatnonzero(row[:region])}
        wishes = [(region + k) % tints for k in range(tints)]
        chosen.append(next((wish for wish in wishes if wish not in taken), wishes[0]))
    return tuple(chosen)
