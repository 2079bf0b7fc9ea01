"""Line plots with bands and grouped bars as SVG text: nothing a browser, a paper or a diff could not read."""

from dataclasses import dataclass
from html import escape

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

COLOURS = ("#6d3f6b", "#c08a2e", "#56616b", "#c06a7f", "#9c7a5c", "#a3a9ab")  # the charts' in static/css/tokens.css
INK, SOFT_INK, AXIS, GRID = "#171a1c", "#4b5257", "#85898a", "#e4e4e0"
DASHES = ("", "8 4", "2 4", "10 4 2 4", "5 3", "1 3")  # so that lines on top of each other, or printed in grey, are told apart
FONT = "Inter, 'Segoe UI', system-ui, 'Helvetica Neue', 'Noto Sans', 'DejaVu Sans', sans-serif"
WIDTH, HEIGHT = 640, 400
LEFT, RIGHT, TOP, BOTTOM = 72, 148, 66, 54
NAMES, END, THICK = 190, 84, 15  # bars: left of them, right of them, each with its gap
TICKS = 5  # about
FAR_FROM_0 = 0.5  # an axis starts at 0 unless the lowest value is above this share of the highest

QUANTITIES = {  # of the ablation: title and label of its plots
    "spread": ("Spread of the samples' costs", "Standard deviation of cost / |w|"),
    "shift": ("Shift of the cheapest samples at each update", "Distance, in spreads of the features"),
    "violations": ("Recorded orders that are not the cheapest", "Training tools"),
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
    note: str = ""  # under the title: what lines and bands are


@dataclass(frozen=True)
class Bars:
    """Horizontal bars, one group per label."""

    title: str
    label: str  # of the values' axis
    labels: tuple[str, ...]
    groups: dict[str, Array]  # name -> a value >= 0 per label
    words: dict[str, tuple[str, ...]]  # name -> what stands at the end of each bar
    note: str = ""
    most: float = 0.0  # the axis reaches at least this far


def as_svg(plot: Plot) -> str:
    """The plot as a stand-alone SVG document."""
    xs = np.concatenate([c.x for c in plot.curves])
    ys = np.concatenate([v for c in plot.curves for v in (c.y, c.low, c.high) if v is not None])
    lowest = float(ys.min()) if ys.min() > FAR_FROM_0 * ys.max() else min(0.0, float(ys.min()))
    x_ticks, y_ticks = ticks(float(xs.min()), float(xs.max())), ticks(lowest, float(ys.max()))
    frame = _Frame(x_ticks[0], max(x_ticks[-1], float(xs.max())), y_ticks[0], y_ticks[-1])
    parts = _opening(plot.title, plot.note, HEIGHT) + _grid(frame, y_ticks, plot.y_label) + _foot(plot.x_label, frame, x_ticks)
    order = sorted(range(len(plot.curves)), key=lambda k: DASHES[k % len(DASHES)] != "")  # dashes on top: what is below shows through
    for k in order:
        parts += _curve(plot.curves[k], frame, k)
    return "\n".join([*parts, "</svg>"]) + "\n"


def bars_as_svg(bars: Bars) -> str:
    """The bars as a stand-alone SVG document, the first label on top."""
    count, scale_ticks = len(bars.groups), ticks(0.0, max(bars.most, *(float(v.max()) for v in bars.groups.values())))
    top, step = TOP + (22 if count > 1 else 0), THICK * count + 12
    bottom, scale = top + step * len(bars.labels), (WIDTH - NAMES - END) / scale_ticks[-1]
    parts = _opening(bars.title, bars.note, bottom + BOTTOM)
    for value in scale_ticks:
        x = NAMES + value * scale
        parts.append(f'<line x1="{x:.1f}" x2="{x:.1f}" y1="{top}" y2="{bottom}" stroke="{GRID if value else AXIS}"/>')
        parts.append(f'<text x="{x:.1f}" y="{bottom + 18}" text-anchor="middle" fill="{SOFT_INK}">{value:g}</text>')
    parts.append(f'<text x="{NAMES + (WIDTH - NAMES - END) / 2:.0f}" y="{bottom + 40}" text-anchor="middle">{escape(bars.label)}</text>')
    for k, (name, values) in enumerate(bars.groups.items()):
        colour = COLOURS[k % len(COLOURS)]
        if count > 1:
            parts.append(f'<rect x="{NAMES + 130 * k}" y="{TOP - 4}" width="12" height="12" fill="{colour}"/>')
            parts.append(f'<text x="{NAMES + 130 * k + 18}" y="{TOP + 6}" font-size="12">{escape(name)}</text>')
        for j, value in enumerate(values):
            y, long = top + 6 + j * step + k * THICK, max(float(value) * scale, 1.0)
            parts.append(f'<rect x="{NAMES}" y="{y}" width="{long:.1f}" height="{THICK - 2}" fill="{colour}"/>')
            end = f'<text x="{NAMES + long + 6:.1f}" y="{y + THICK - 5}" font-size="12" fill="{SOFT_INK}">'
            parts.append(f"{end}{escape(bars.words[name][j])}</text>")
    for j, label in enumerate(bars.labels):
        parts.append(f'<text x="{NAMES - 10}" y="{top + 8 + j * step + THICK * count / 2:.1f}" text-anchor="end">{escape(label)}</text>')
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


def _opening(title: str, note: str, height: float) -> list[str]:
    return [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height:.0f}" width="{WIDTH}" height="{height:.0f}" '
        f'font-family="{FONT}" font-size="13" fill="{INK}" role="img">',
        f"<title>{escape(title)}</title>",
        f'<rect width="{WIDTH}" height="{height:.0f}" fill="#ffffff"/>',
        f'<text x="20" y="28" font-size="16" font-weight="600">{escape(title)}</text>',
        f'<text x="20" y="48" font-size="12" fill="{SOFT_INK}">{escape(note)}</text>',
    ]


def _grid(frame: _Frame, y_ticks: list[float], y_label: str) -> list[str]:
    bottom, right, parts = HEIGHT - BOTTOM, WIDTH - RIGHT, []
    for value in y_ticks:
        at = frame.y(value)
        parts.append(f'<line x1="{LEFT}" x2="{right}" y1="{at:.1f}" y2="{at:.1f}" stroke="{GRID}"/>')
        parts.append(f'<text x="{LEFT - 8}" y="{at + 4:.1f}" text-anchor="end" fill="{SOFT_INK}">{value:g}</text>')
    middle = (TOP + bottom) / 2
    turned = f'transform="rotate(-90 22 {middle:.0f})"'
    parts.append(f'<line x1="{LEFT}" x2="{right}" y1="{bottom}" y2="{bottom}" stroke="{AXIS}"/>')
    parts.append(f'<text x="22" y="{middle:.0f}" text-anchor="middle" {turned}>{escape(y_label)}</text>')
    return parts


def _foot(x_label: str, frame: _Frame, x_ticks: list[float]) -> list[str]:
    bottom, middle = HEIGHT - BOTTOM, (LEFT + WIDTH - RIGHT) / 2
    parts = []
    for value in x_ticks:
        if frame.x0 <= value <= frame.x1:
            x = frame.x(value)
            parts.append(f'<line x1="{x:.1f}" x2="{x:.1f}" y1="{bottom}" y2="{bottom + 5}" stroke="{AXIS}"/>')
            parts.append(f'<text x="{x:.1f}" y="{bottom + 19}" text-anchor="middle" fill="{SOFT_INK}">{value:g}</text>')
    return [*parts, f'<text x="{middle:.0f}" y="{HEIGHT - 14}" text-anchor="middle">{escape(x_label)}</text>']


def _curve(curve: Curve, frame: _Frame, k: int) -> list[str]:
    colour, dash = COLOURS[k % len(COLOURS)], DASHES[k % len(DASHES)]
    style = f'stroke="{colour}" stroke-width="2"' + (f' stroke-dasharray="{dash}"' if dash else "")
    parts = []
    if curve.low is not None and curve.high is not None:
        around = frame.path(np.r_[curve.x, curve.x[::-1]], np.r_[curve.low, curve.high[::-1]])
        parts.append(f'<polygon points="{around}" fill="{colour}" fill-opacity="0.16"/>')
    parts.append(f'<polyline points="{frame.path(curve.x, curve.y)}" fill="none" {style}/>')
    at, y = WIDTH - RIGHT + 14, TOP + 12 + 22 * k
    return [
        *parts,
        f'<line x1="{at}" x2="{at + 30}" y1="{y}" y2="{y}" {style}/>',
        f'<text x="{at + 38}" y="{y + 4}">{escape(curve.name)}</text>',
    ]
