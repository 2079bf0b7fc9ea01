"""Line plots with bands as SVG text: nothing a browser, a paper or a diff could not read."""

from dataclasses import dataclass
from html import escape

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

COLOURS = ("#1f5fa8", "#c2571a", "#2e7d4f", "#8a4fb0", "#6b6b6b")  # told apart in print and by most eyes
WIDTH, HEIGHT = 640, 400
LEFT, RIGHT, TOP, BOTTOM = 64, 150, 40, 52
TICKS = 5  # about


@dataclass(frozen=True)
class Curve:
    """One line, and a band around it."""

    name: str
    x: Array  # (k,)
    y: Array  # (k,)
    low: Array | None = None  # (k,)
    high: Array | None = None  # (k,)


@dataclass(frozen=True)
class Plot:
    """Curves on common axes."""

    title: str
    x_label: str
    y_label: str
    curves: tuple[Curve, ...]


def as_svg(plot: Plot) -> str:
    """The plot as a stand-alone SVG document."""
    xs = np.concatenate([c.x for c in plot.curves])
    ys = np.concatenate([v for c in plot.curves for v in (c.y, c.low, c.high) if v is not None])
    x_ticks, y_ticks = ticks(float(xs.min()), float(xs.max())), ticks(min(0.0, float(ys.min())), float(ys.max()))
    frame = _Frame(x_ticks[0], max(x_ticks[-1], float(xs.max())), y_ticks[0], y_ticks[-1])
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" font-family="sans-serif" font-size="13" role="img">',
        f"<title>{escape(plot.title)}</title>",
        f'<rect width="{WIDTH}" height="{HEIGHT}" fill="#ffffff"/>',
        f'<text x="{LEFT}" y="22" font-size="15" font-weight="600">{escape(plot.title)}</text>',
        *_axes(plot, frame, x_ticks, y_ticks),
    ]
    for k, curve in enumerate(plot.curves):
        parts += _curve(curve, frame, COLOURS[k % len(COLOURS)], TOP + 12 + 20 * k)
    return "\n".join([*parts, "</svg>"]) + "\n"


def ticks(low: float, high: float) -> list[float]:
    """Round numbers that span [low, high], about five steps of 1, 2 or 5 times a power of ten."""
    span = max(high - low, 1e-12 * max(abs(high), 1.0))
    power = 10.0 ** np.floor(np.log10(span / TICKS))
    step = next(m * power for m in (1, 2, 5, 10) if span / (m * power) <= TICKS + 1)
    first, last = int(np.floor(low / step + 1e-9)), int(np.ceil(high / step - 1e-9))
    return [float(f"{k * step:.12g}") for k in range(first, max(last, first + 1) + 1)]


@dataclass(frozen=True)
class _Frame:
    """Data coordinates to picture coordinates."""

    x0: float
    x1: float
    y0: float
    y1: float

    def x(self, value: float) -> float:
        return LEFT + (value - self.x0) / (self.x1 - self.x0) * (WIDTH - LEFT - RIGHT)

    def y(self, value: float) -> float:
        return HEIGHT - BOTTOM - (value - self.y0) / (self.y1 - self.y0) * (HEIGHT - TOP - BOTTOM)

    def path(self, x: Array, y: Array) -> str:
        return " ".join(f"{self.x(float(a)):.1f},{self.y(float(b)):.1f}" for a, b in zip(x, y, strict=True))


def _axes(plot: Plot, frame: _Frame, x_ticks: list[float], y_ticks: list[float]) -> list[str]:
    bottom, right = HEIGHT - BOTTOM, WIDTH - RIGHT
    parts = []
    for value in y_ticks:
        at = frame.y(value)
        parts.append(f'<line x1="{LEFT}" x2="{right}" y1="{at:.1f}" y2="{at:.1f}" stroke="#dddddd"/>')
        parts.append(f'<text x="{LEFT - 8}" y="{at + 4:.1f}" text-anchor="end">{value:g}</text>')
    for value in x_ticks:
        if frame.x0 <= value <= frame.x1:
            parts.append(f'<text x="{frame.x(value):.1f}" y="{bottom + 18}" text-anchor="middle">{value:g}</text>')
    middle_x, middle_y = (LEFT + right) / 2, (TOP + bottom) / 2
    parts.append(f'<line x1="{LEFT}" x2="{right}" y1="{bottom}" y2="{bottom}" stroke="#333333"/>')
    parts.append(f'<text x="{middle_x:.0f}" y="{HEIGHT - 12}" text-anchor="middle">{escape(plot.x_label)}</text>')
    turned = f'transform="rotate(-90 16 {middle_y:.0f})"'
    parts.append(f'<text x="16" y="{middle_y:.0f}" text-anchor="middle" {turned}>{escape(plot.y_label)}</text>')
    return parts


def _curve(curve: Curve, frame: _Frame, colour: str, legend_y: float) -> list[str]:
    parts = []
    if curve.low is not None and curve.high is not None:
        around = frame.path(np.r_[curve.x, curve.x[::-1]], np.r_[curve.low, curve.high[::-1]])
        parts.append(f'<polygon points="{around}" fill="{colour}" fill-opacity="0.15"/>')
    parts.append(f'<polyline points="{frame.path(curve.x, curve.y)}" fill="none" stroke="{colour}" stroke-width="2"/>')
    at = WIDTH - RIGHT + 14
    parts.append(f'<line x1="{at}" x2="{at + 18}" y1="{legend_y}" y2="{legend_y}" stroke="{colour}" stroke-width="2"/>')
    parts.append(f'<text x="{at + 24}" y="{legend_y + 4}">{escape(curve.name)}</text>')
    return parts
