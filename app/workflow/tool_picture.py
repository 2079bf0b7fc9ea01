"""A still picture of a tool as SVG, seen as on the pages, with the places of its regions in an order as numbers."""

from collections.abc import Sequence as Ordered
from html import escape
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from app.geometry.tool import Tool

Array = NDArray[np.float64]

WIDTH, HEIGHT, EDGE = 360, 240, 14  # of the picture, px
AZIMUTH, ELEVATION = -0.46, 0.74  # as the thumbnails of the pages
LIGHT = np.array([-0.45, -0.6, 1.15]) / np.linalg.norm([-0.45, -0.6, 1.15])
MOST_FACES = 30_000  # above it only the numbers are drawn: a printed page has to stay small
SHADES = 5
BODY = (214, 219, 224)
FIRST, LAST = np.array([233, 240, 250]), np.array([122, 160, 208])  # of the order of work; light, so that numbers print well


def picture(tool: Tool, sequence: Ordered[int], differs: Ordered[int], title: str) -> str:
    """The tool with its regions numbered in the order of work; those in `differs` have a thick ring.

    Args:
        tool: What is shown.
        sequence: Region ids in order.
        differs: Regions that stand out.
        title: For people who can't see it.
    """
    axes = _axes()
    centres = np.array([region.centroid for region in tool.regions])
    points = np.vstack([tool.mesh.vertices, centres]) @ axes[:2].T
    low, high = points.min(axis=0), points.max(axis=0)
    scale = min((WIDTH - 2 * EDGE) / max(high[0] - low[0], 1e-12), (HEIGHT - 2 * EDGE) / max(high[1] - low[1], 1e-12))
    placed = (points - (low + high) / 2) * [scale, -scale] + [WIDTH / 2, HEIGHT / 2]
    place = {region: step for step, region in enumerate(sequence)}
    surface = _surface(tool, placed, axes[2], place) if len(tool.mesh.faces) <= MOST_FACES else ""
    middles = placed[len(tool.mesh.vertices) :]
    plates = "".join(_plate(middles[a], place[a] + 1, thick=a in differs) for a in reversed(sequence))
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" font-family="system-ui, sans-serif" '
        f'viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{escape(title, quote=True)}">'
        f'<g stroke-width="0.5" stroke-linejoin="round">{surface}</g>{plates}</svg>'
    )


def _axes() -> Array:
    """(3, 3) rows: to the right, up, and towards the viewer."""
    right = np.array([np.cos(AZIMUTH), np.sin(AZIMUTH), 0.0])
    back = np.array([np.sin(AZIMUTH) * np.cos(ELEVATION), -np.cos(AZIMUTH) * np.cos(ELEVATION), np.sin(ELEVATION)])
    return np.array([right, np.cross(back, right), back])


def _surface(tool: Tool, placed: Array, back: Array, place: dict[int, int]) -> str:
    """The faces from behind to the front; neighbours in that order with one colour share a path."""
    corners = np.asarray(tool.mesh.vertices)[tool.mesh.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    lit = np.rint(np.abs(normals @ LIGHT) * SHADES).astype(int)
    shown = np.flatnonzero((tool.labels >= 0) | (normals @ back > 0))
    order = shown[np.argsort((corners @ back).sum(axis=1)[shown], kind="stable")]
    flat = np.rint(placed[tool.mesh.faces] * 10) / 10
    paths = []
    for (region, shade), faces in groupby(order, key=lambda f: (int(tool.labels[f]), int(lit[f]))):
        colour = _colour(place.get(region), len(place), shade)
        shape = "".join("M" + "L".join(f"{x:g} {y:g}" for x, y in flat[f]) + "z" for f in faces)
        paths.append(f'<path fill="{colour}" stroke="{colour}" d="{shape}"/>')
    return "".join(paths)


def _colour(step: int | None, count: int, shade: int) -> str:
    colour = np.array(BODY) if step is None else FIRST + (LAST - FIRST) * (step / max(count - 1, 1))
    r, g, b = (int(c) for c in np.rint(colour * (0.78 + 0.22 * shade / SHADES)))
    return f"#{r:02x}{g:02x}{b:02x}"


def _plate(middle: Array, number: int, *, thick: bool) -> str:
    x, y = middle
    ring = 'stroke="#b3261e" stroke-width="2.2"' if thick else 'stroke="#3a4652" stroke-width="0.8"'
    words = f'<text x="{x:.1f}" y="{y + 3.6:.1f}" text-anchor="middle" font-size="10" font-weight="{700 if thick else 400}">{number}</text>'
    return f'<circle cx="{x:.1f}" cy="{y:.1f}" r="8.5" fill="#ffffff" {ring}/>{words}'
