"""The picture of docs/sequencing.md: the state graph of four regions, its cheapest sequences, and a tie.

Run it as `python scripts/sequencing_picture.py`; it writes docs/sequencing.svg from a solved problem.
"""

from itertools import combinations
from pathlib import Path

import numpy as np

from app.geometry.tool import RegionGraph
from app.sequencing.problem import SequencingProblem, problem_for
from app.sequencing.shortest import TOLERANCE, cost_to_go

OUT = Path(__file__).resolve().parents[1] / "docs" / "sequencing.svg"
LETTERS = "ABCD"
WIDTH, HEIGHT, LEFT, TOP, GAP, ROW = 900, 470, 70, 75, 190, 62


def four_in_a_row() -> SequencingProblem:
    """Four squares in a row, mirror-symmetric: so orders tie with their mirror images."""
    n, line = 4, np.arange(4.0)
    touching = np.abs(line[:, None] - line) == 1
    bowl = np.minimum(line, 3 - line) * 0.5
    box = np.stack([line, np.zeros(n)], axis=1)
    graph = RegionGraph(
        "mesh", touching / 4, np.zeros((n, n)), np.zeros((n, n)), touching, np.zeros((n, n), np.bool_), np.array([1, 0, 1, 2]),
        bowl, bowl, np.full(n, 0.25), box, box + 1,
    )  # fmt: skip
    return problem_for(graph, ())


def place(state: int) -> tuple[float, float]:
    """Column by how many regions are finished, row by which."""
    size = state.bit_count()
    layer = [sum(1 << a for a in members) for members in combinations(range(4), size)]
    return LEFT + GAP * size, TOP + ROW * (layer.index(state) + (6 - len(layer)) / 2)


def picture() -> str:
    """The SVG."""
    problem = four_in_a_row()
    w = np.ones(len(problem.columns))
    table, v = problem.cost_table(w), cost_to_go(problem, w)
    reached, parts = {0}, []
    for state in range(15):
        for a in range(4):
            if state >> a & 1:
                continue
            after = state | 1 << a
            cheapest = state in reached and table[state, a] + v[after] <= v[state] + TOLERANCE * abs(v[0])
            if cheapest:
                reached.add(after)
            (x0, y0), (x1, y1) = place(state), place(after)
            style = 'stroke="#0b6e4f" stroke-width="3"' if cheapest else 'stroke="#b8bec6" stroke-width="1"'
            parts.append((cheapest, f'<line x1="{x0 + 34}" y1="{y0}" x2="{x1 - 34}" y2="{y1}" {style}/>'))
    lines = [line for _, line in sorted(parts)]
    for state in range(16):
        x, y = place(state)
        name = "".join(LETTERS[a] for a in range(4) if state >> a & 1) or "start"
        fill, edge = ("#d9f2e6", "#0b6e4f") if state in reached else ("#ffffff", "#8a929b")
        lines.append(f'<rect x="{x - 34}" y="{y - 20}" width="68" height="40" rx="8" fill="{fill}" stroke="{edge}"/>')
        lines.append(
            f'<text x="{x}" y="{y - 3}" font-weight="600">{name}</text><text x="{x}" y="{y + 13}" class="small">{v[state]:.2f}</text>'
        )
    heads = [f'<text x="{LEFT + GAP * k}" y="26">{k} finished</text>' for k in range(5)]
    return "\n".join(
        [
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}"',
            'font-family="sans-serif" font-size="14" text-anchor="middle">',
            "<title>State graph of a tool of four regions; the thick ways are its cheapest sequences</title>",
            "<style>.small { font-size: 12px; fill: #4a525b }</style>",
            f'<rect width="{WIDTH}" height="{HEIGHT}" fill="#ffffff"/>',
            *heads,
            *lines,
            "</svg>\n",
        ]
    )


if __name__ == "__main__":
    OUT.write_text(picture())
