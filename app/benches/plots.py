"""Line plots with bands and grouped bars as SVG text: nothing a browser, a paper or a diff could not read."""

from dataclasses import dataclass
from html import escape

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

COLOURS = ("#1f5fa8", "#c2571a", "#2e7d4f", "#8a4fb0", "#6b6b6b")  # told apart in print and by most eyes
WIDTH, HEIGHT = 640, 400
LEFT, RIGHT, TOP, BOTTOM = 64, 150, 40, 52
TICKS = 5  # about

QUANTITIES = {  # of the ablation: title and label of its plots
    "spread": ("Spread of the samples' costs", "Deviation of cost / |w|"),
    "shift": ("Shift of the cheapest samples at each update", "Distance of feature sums"),
    "violations": ("Recorded orders that are not the cheapest", "Demonstrations"),
}


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
    parts = _opening(plot.title) + _grid(frame, y_ticks, plot.y_label) + _foot(plot.x_label, frame, x_ticks)
    for k, curve in enumerate(plot.curves):
        parts += _curve(curve, frame, COLOURS[k % len(COLOURS)], TOP + 12 + 20 * k)
    return "\n".join([*parts, "</svg>"]) + "\n"


def bars_as_svg(title: str, y_label: str, labels: tuple[str, ...], groups: dict[str, Array]) -> str:
    """One group of bars per label, one bar per key of `groups`, as a stand-alone SVG document."""
    y_ticks = ticks(0.0, float(max(v.max() for v in groups.values())))
    frame, bottom = _Frame(0.0, float(len(labels)), y_ticks[0], y_ticks[-1]), HEIGHT - BOTTOM
    parts = _opening(title) + _grid(frame, y_ticks, y_label)
    thick = 0.8 / len(groups)
    for k, (name, values) in enumerate(groups.items()):
        colour = COLOURS[k % len(COLOURS)]
        for j, value in enumerate(values):
            x0, x1, top = frame.x(j + 0.1 + k * thick), frame.x(j + 0.1 + (k + 1) * thick), frame.y(float(value))
            size = f'width="{x1 - x0:.1f}" height="{max(bottom - top, 0.5):.1f}"'
            parts.append(f'<rect x="{x0:.1f}" y="{min(top, bottom - 0.5):.1f}" {size} fill="{colour}"/>')
        parts += _legend(name, colour, TOP + 12 + 20 * k)
    for j, label in enumerate(labels):
        x, y = round(frame.x(j + 0.5)), bottom + 16
        turned = f'transform="rotate(-25 {x} {y})"'
        parts.append(f'<text x="{x}" y="{y}" text-anchor="end" font-size="11" {turned}>{escape(label)}</text>')
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


def _opening(title: str) -> list[str]:
    return [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" font-family="sans-serif" font-size="13" role="img">',
        f"<title>{escape(title)}</title>",
        f'<rect width="{WIDTH}" height="{HEIGHT}" fill="#ffffff"/>',
        f'<text x="{LEFT}" y="22" font-size="15" font-weight="600">{escape(title)}</text>',
    ]


def _grid(frame: _Frame, y_ticks: list[float], y_label: str) -> list[str]:
    bottom, right, parts = HEIGHT - BOTTOM, WIDTH - RIGHT, []
    for value in y_ticks:
        at = frame.y(value)
        parts.append(f'<line x1="{LEFT}" x2="{right}" y1="{at:.1f}" y2="{at:.1f}" stroke="#dddddd"/>')
        parts.append(f'<text x="{LEFT - 8}" y="{at + 4:.1f}" text-anchor="end">{value:g}</text>')
    middle = (TOP + bottom) / 2
    turned = f'transform="rotate(-90 16 {middle:.0f})"'
    parts.append(f'<line x1="{LEFT}" x2="{right}" y1="{bottom}" y2="{bottom}" stroke="#333333"/>')
    parts.append(f'<text x="16" y="{middle:.0f}" text-anchor="middle" {turned}>{escape(y_label)}</text>')
    return parts


def _foot(x_label: str, frame: _Frame, x_ticks: list[float]) -> list[str]:
    bottom, middle = HEIGHT - BOTTOM, (LEFT + WIDTH - RIGHT) / 2
    shown = [value for value in x_ticks if frame.x0 <= value <= frame.x1]
    parts = [f'<text x="{frame.x(value):.1f}" y="{bottom + 18}" text-anchor="middle">{value:g}</text>' for value in shown]
    return [*parts, f'<text x="{middle:.0f}" y="{HEIGHT - 12}" text-anchor="middle">{escape(x_label)}</text>']


def _legend(name: str, colour: str, y: float) -> list[str]:
    at = WIDTH - RIGHT + 14
    return [
        f'<line x1="{at}" x2="{at + 18}" y1="{y}" y2="{y}" stroke="{colour}" stroke-width="2"/>',
        f'<text x="{at + 24}" y="{y + 4}">{escape(name)}</text>',
    ]


def _curve(curve: Curve, frame: _Frame, colour: str, legend_y: float) -> list[str]:
    parts = []
    if curve.low is not None and curve.high is not None:
        around = frame.path(np.r_[curve.x, curve.x[::-1]], np.r_[curve.low, curve.high[::-1]])
        parts.append(f'<polygon points="{around}" fill="{colour}" fill-opacity="0.15"/>')
    parts.append(f'<polyline points="{frame.path(curve.x, curve.y)}" fill="none" stroke="{colour}" stroke-width="2"/>')
    return parts + _legend(curve.name, colour, legend_y)
