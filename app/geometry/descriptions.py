"""Names a process expert would use: "Floor, middle", "Left wall, front", "Crown, rear"."""

from collections import Counter

import numpy as np

from app.geometry.attributes import Attributes
from app.geometry.tool import Array

WALL, SLOPE = np.cos(np.radians(60)), np.cos(np.radians(18))  # normal's z below which it is a wall, a slope
BENT = 0.12  # curvature x size of the tool from which a region is called bent
NARROW = 0.35  # a bent region with a radius below this share of the tool's size is an edge or a fillet
THIRD = 1 / 3
MIDDLE = (0.4, 0.6)  # shares of the tool's size between which a slope stands neither left nor right
LEVEL = 0.05  # share of the tool's size by which rows (columns) of like regions lie apart
ALONG = (  # names from front to rear, the coarsest first; "" is the middle, named only when nothing else is said
    ("front", "", "rear"),
    ("front", "front middle", "rear middle", "rear"),
    ("front", "front middle", "", "rear middle", "rear"),
)
ACROSS = (
    ("left", "", "right"),
    ("left", "left of centre", "right of centre", "right"),
    ("left", "left of centre", "", "right of centre", "right"),
)


def describe(attributes: Attributes) -> tuple[str, ...]:
    """One description per region, unique within the tool."""
    low, high = attributes.low.min(axis=0), attributes.high.max(axis=0)
    nouns = [_noun(attributes, i, low, high) for i in range(len(attributes.area))]
    texts = list(nouns)
    for noun in set(nouns):
        alike = [i for i, other in enumerate(nouns) if other == noun]
        if len(alike) > 1 or noun in ("Floor", "Crown", "Hollow", "Top"):
            for i, place in zip(alike, _places(attributes.centroid[alike], low, high), strict=True):
                texts[i] = f"{noun}, {place}"
    return _numbered(texts, attributes)


def _noun(attributes: Attributes, i: int, low: Array, high: Array) -> str:
    normal, size = attributes.normal[i], float(np.linalg.norm(high[:2] - low[:2]))
    bend = attributes.curvature[i] * size
    relative = (attributes.centroid[i] - low) / np.maximum(high - low, 1e-9)
    if normal[2] < -0.05:
        return "Underside"
    if normal[2] < WALL:
        return _wall(normal, relative)
    if abs(bend) > 1 / NARROW and normal[2] < SLOPE:
        return _standing("fillet" if bend < 0 else "edge", normal, relative)
    if normal[2] < SLOPE:
        return _standing("slope", normal, relative)
    if abs(bend) > BENT:
        return "Crown" if bend > 0 else "Hollow"
    if relative[2] < THIRD:
        return "Floor"
    return "Top" if relative[2] > 2 * THIRD else "Step"


def _standing(noun: str, normal: Array, relative: Array) -> str:
    """A slope is named by where it stands along the direction it leans; one in the middle only by what it is."""
    axis = 0 if abs(normal[0]) >= abs(normal[1]) else 1
    names = (("Left", "Right"), ("Front", "Rear"))[axis]
    if MIDDLE[0] <= relative[axis] <= MIDDLE[1]:
        return noun.capitalize()
    return f"{names[int(relative[axis] > MIDDLE[1])]} {noun}"


def _wall(normal: Array, relative: Array) -> str:
    """A wall is named by where it stands; one that looks outward is an outer wall."""
    x, y = normal[:2]
    axis = 0 if abs(x) >= abs(y) else 1
    names = (("Left", "Right"), ("Front", "Rear"))[axis]
    stands = names[int(relative[axis] >= 0.5)]
    looks = names[int(normal[axis] > 0)]
    return f"{stands} outer wall" if stands == looks else f"{stands} wall"


def _places(centroids: Array, low: Array, high: Array) -> list[str]:
    """Where like regions lie in plan view, only along directions in which they differ."""
    at = (centroids - low) / np.maximum(high - low, 1e-9)
    words = zip(_words(at[:, 1], ALONG), _words(at[:, 0], ACROSS), strict=True)
    return [" ".join(w for w in both if w) or "middle" for both in words]


def _words(at: Array, names: tuple[tuple[str, ...], ...]) -> list[str]:
    """Coarsest names of positions in [0, 1] that tell all their levels apart; rows beyond five are counted."""
    ordered = np.sort(at)
    starts = np.flatnonzero(np.diff(ordered, prepend=-np.inf) > LEVEL)
    levels = np.array([part.mean() for part in np.split(ordered, starts[1:])])
    if len(levels) == 1 and len(at) > 1:
        return [""] * len(at)
    mine = np.argmin(np.abs(levels - at[:, None]), axis=1)
    for choice in names:
        chosen = np.clip(levels * len(choice), 0, len(choice) - 1).astype(int)
        if len(set(chosen.tolist())) == len(levels):
            return [choice[chosen[k]] for k in mine]
    return [f"row {len(levels) - k}" if names is ALONG else f"column {k + 1}" for k in mine]


def _numbered(texts: list[str], attributes: Attributes) -> tuple[str, ...]:
    """Tell equal descriptions apart by upper and lower where that is so, else by numbers."""
    count = Counter(texts)
    result = list(texts)
    for text in (t for t, times in count.items() if times > 1):
        same = [i for i, t in enumerate(texts) if t == text]
        height = attributes.centroid[same, 2]
        rank = np.argsort(np.argsort(-height, kind="stable"), kind="stable")
        levels = len(same) == 2 and np.ptp(height) > 0.1 * np.ptp(attributes.high[:, 2])
        for i, r in zip(same, rank if levels else range(len(same)), strict=True):
            result[i] = f"{text}, {('upper', 'lower')[r]}" if levels else f"{text} {r + 1}"
    return tuple(result)
