"""Names a process expert would use: "Floor, middle", "Left wall, front", "Crown, rear"."""

from collections import Counter

import numpy as np

from app.geometry.attributes import Attributes
from app.geometry.tool import Array

WALL, SLOPE = np.cos(np.radians(60)), np.cos(np.radians(18))  # normal's z below which it is a wall, a slope
BENT = 0.12  # curvature x size of the tool from which a region is called bent
NARROW = 0.35  # a bent region with a radius below this share of the tool's size is an edge or a fillet
THIRD = 1 / 3


def describe(attributes: Attributes) -> tuple[str, ...]:
    """One description per region, unique within the tool."""
    low, high = attributes.low.min(axis=0), attributes.high.max(axis=0)
    nouns = [_noun(attributes, i, low, high) for i in range(len(attributes.area))]
    texts = []
    for i, noun in enumerate(nouns):
        alike = [k for k, other in enumerate(nouns) if other == noun]
        place = _place(attributes.centroid[i], attributes.centroid[alike], low, high)
        texts.append(f"{noun}, {place}" if len(alike) > 1 or noun in ("Floor", "Crown", "Hollow", "Top") else noun)
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
        return f"{_toward(normal)} {'fillet' if bend < 0 else 'edge'}"
    if normal[2] < SLOPE:
        return f"{_toward(normal)} slope"
    if abs(bend) > BENT:
        return "Crown" if bend > 0 else "Hollow"
    if relative[2] < THIRD:
        return "Floor"
    return "Top" if relative[2] > 2 * THIRD else "Step"


def _toward(normal: Array) -> str:
    """Side a slope looks to."""
    x, y = normal[:2]
    if abs(x) >= abs(y):
        return "Left" if x < 0 else "Right"
    return "Front" if y < 0 else "Rear"


def _wall(normal: Array, relative: Array) -> str:
    """A wall is named by where it stands; one that looks outward is an outer wall."""
    x, y = normal[:2]
    axis = 0 if abs(x) >= abs(y) else 1
    names = (("Left", "Right"), ("Front", "Rear"))[axis]
    stands = names[int(relative[axis] >= 0.5)]
    looks = names[int(normal[axis] > 0)]
    return f"{stands} outer wall" if stands == looks else f"{stands} wall"


def _place(centroid: Array, alike: Array, low: Array, high: Array) -> str:
    """Where in plan view: front / middle / rear and left / right, only along directions in which like regions differ."""
    relative = (centroid - low) / np.maximum(high - low, 1e-9)
    spread = np.ptp((alike - low) / np.maximum(high - low, 1e-9), axis=0)
    words = []
    for axis, names in ((1, ("front", "", "rear")), (0, ("left", "", "right"))):
        if len(alike) == 1 or spread[axis] > 0.1:
            words.append(names[int(np.clip(relative[axis] / THIRD, 0, 2))])
    return " ".join(w for w in words if w) or "middle"


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
