"""How much of what matters the demonstrations have shown (Eq. 5-6), and which one to record next.

For each suspected interaction of two factors every step of a demonstration falls into one of 3 x 3 cells. A cell is captured
when the demonstrations hold it and the other features are evenly spread over its steps; rho is the captured share of the
cells that occur on the project's tools at all.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from app.geometry.tool import region_letters
from app.learning.coverage_words import LEVEL_WORDS, advice, alike_words, listed, phrase, shape_needed, situation
from app.learning.levels import (
    LevelRules,
    Levels,
    Spread,
    Transitions,
    factor_groups,
    measure_levels,
    sample_transitions,
    sequence_values,
    spreads_of,
)
from app.learning.uniformity import uniform_p_value
from app.sequencing.features import Interaction
from app.sequencing.problem import SequencingProblem

CellState = Literal["captured", "uneven", "missing", "impossible"]
Grid = NDArray[np.int64]

SIGNIFICANCE = 0.05
ORDERS_TRIED = 12  # per tool, for the gain of a request
SHOWN = 3  # regions named per tool and cell
RULE = (
    "A situation counts as covered when a demonstration contains it and every other feature is evenly spread over those steps "
    "(chi-squared at 0.05, exact for small counts, corrected for the number of features)."
)


@dataclass(frozen=True)
class Cell:
    """One combination of levels."""

    state: CellState
    count: int  # demonstrated steps
    p_value: float | None  # of the least even other feature, corrected; None without steps
    tools: tuple[tuple[int, tuple[int, ...]], ...]  # tools that have it, with the regions where it is most common
    text: str  # "a large step in height with a small change of curvature"
    request: str  # what to do about it, empty when captured or impossible
    need: str  # what a new tool needs to have it, empty when captured


@dataclass(frozen=True)
class InteractionTable:
    """3 x 3 cells; rows are levels of the first factor, columns of the second, both rising."""

    interaction: Interaction
    row_title: str  # "step in height"
    column_title: str
    row_words: tuple[str, ...]
    column_words: tuple[str, ...]
    cells: tuple[tuple[Cell, ...], ...]


@dataclass(frozen=True)
class Request:
    """What a demonstration of a tool adds."""

    text: str
    tool_index: int
    regions: tuple[int, ...]
    gain: float  # in rho, of the best of a few orders of the tool; 0 when each new situation costs another its even spread
    expected: float  # change of rho, mean over these orders
    useful: bool  # it can raise rho, or has a situation nobody has shown


@dataclass(frozen=True)
class CoverageReport:
    """Coverage of a set of demonstrations."""

    rho: float
    captured: int
    possible: int
    steps: int
    tables: tuple[InteractionTable, ...]
    thresholds: Levels
    requests: tuple[Request, ...]  # one per tool: useful ones first, of these tools without a demonstration, then by expected change of rho
    left_out: tuple[int, ...]  # tools with another feature set, which can't be compared
    shown: int = 0  # cells that some demonstration holds, however unevenly
    spreads: tuple[Spread, ...] = ()  # per factor of the thresholds
    rule: str = RULE

    @property
    def occurrence(self) -> float:
        """rho by plain occurrence: what is shown at all."""
        return self.shown / self.possible if self.possible else 0.0


def coverage(
    problems: list[SequencingProblem],
    demonstrations: list[tuple[int, tuple[int, ...]]],
    interactions: tuple[Interaction, ...],
    rules: LevelRules | None = None,
) -> CoverageReport:
    """Coverage rho, the tables behind it and what to record next.

    Args:
        problems: All tools of the project.
        demonstrations: (tool index, sequence).
        interactions: The ones the expert suspects.
        rules: How each factor's levels are found; terciles if None.

    Returns:
        The report, with one request per tool, demonstrated ones too (another order may add something).

    Raises:
        UnknownFeature: An interaction names a factor the tools don't have.

    Paper:
        Levels are terciles over sampled transitions of all tools (`levels`). A cell no sampled transition falls into is impossible and
            does not count in rho; the paper divides by all 9.
        Each other feature is tested for even spread over the levels that occur within that cell on any tool; p-values are
            Bonferroni-corrected, otherwise ten features would often fail by chance. A feature with one value in more than a third of all
            transitions has no three levels and is not tested. The authors' code uses a skewness limit instead.
        Tools are ranked by the mean change of rho over a few random orders: which one the expert would choose isn't known yet. The best of
            them is told too.
    """
    first = demonstrations[0][0] if demonstrations else 0
    kind = [p.features for p in problems]
    alike = [i for i in range(len(problems)) if kind[i] == kind[first]]
    if not alike:
        return CoverageReport(0.0, 0, 0, 0, (), Levels((), (), ()), (), ())
    study = _Study.of(problems, alike, interactions, rules or LevelRules())
    shown = [study.levels.of(sequence_values(problems[i], s)) for i, s in demonstrations if i in study.sampled]
    steps = np.concatenate(shown) if shown else np.zeros((0, len(study.levels.keys)), np.int64)
    states = study.states(steps)
    captured, possible = _tally(states)
    waiting = [i for i in alike if i not in {i for i, _ in demonstrations}]
    tables = tuple(study.table(k, states[k], waiting) for k in range(len(interactions)))
    asked = study.requests(steps, tables, captured, possible)
    requests = sorted(asked, key=lambda r: (not r.useful, r.tool_index not in waiting, -r.expected, -r.gain, r.tool_index))
    left_out = tuple(i for i in range(len(problems)) if i not in alike)
    return CoverageReport(
        rho=captured / possible if possible else 0.0,
        captured=captured,
        possible=possible,
        steps=len(steps),
        tables=tables,
        thresholds=study.levels,
        requests=tuple(requests),
        left_out=left_out,
        shown=sum(j.count > 0 for table in states for j in table),
        spreads=study.spreads,
    )


@dataclass(frozen=True)
class _Judged:
    """A cell without its words."""

    state: CellState
    count: int
    p_value: float | None
    alike: tuple[int, int] | None = None  # of an uneven cell: the least even factor and its most common level


@dataclass(frozen=True)
class _Study:
    """The tools' transitions in levels."""

    interactions: tuple[Interaction, ...]
    axes: tuple[tuple[int, int], ...]  # per interaction, its two factors' positions in `levels.keys`
    phrases: tuple[tuple[str, str], ...]
    levels: Levels
    sampled: dict[int, Transitions]
    grids: dict[int, Grid]  # tool index -> levels of its transitions (T, factors)
    spread: tuple[NDArray[np.bool_], ...]  # per interaction (9, factors, 3): which levels occur in a cell on any tool
    tested: tuple[int, ...]  # factors whose terciles differ, so that an even spread means something
    regions: dict[int, int]  # tool index -> number of regions
    spreads: tuple[Spread, ...]  # per factor
    labels: tuple[str, ...]  # of the factors

    @staticmethod
    def of(problems: list[SequencingProblem], alike: list[int], interactions: tuple[Interaction, ...], rules: LevelRules) -> "_Study":
        features = problems[alike[0]].features
        phrases = tuple((phrase(i.first, features), phrase(i.second, features)) for i in interactions)
        groups = factor_groups(features)
        keys = tuple(groups)
        home = {key: next(g for g in keys if set(features.factors[key]) <= set(groups[g])) for key in features.factors}
        axes = tuple((keys.index(home[i.first]), keys.index(home[i.second])) for i in interactions)
        sampled = {i: sample_transitions(problems[i]) for i in alike}
        values = np.concatenate([t.values for t in sampled.values()])
        levels = measure_levels(keys, values, rules)
        grids = {i: levels.of(t.values) for i, t in sampled.items()}
        everything = np.concatenate(list(grids.values()))
        spread = tuple(_counts(everything, pair) > 0 for pair in axes)
        tested = tuple(f for f in range(len(keys)) if len(np.unique(everything[:, f])) == 3)
        labels = tuple(phrase(key, features) for key in keys)
        sizes = {i: problems[i].n for i in alike}
        return _Study(interactions, axes, phrases, levels, sampled, grids, spread, tested, sizes, spreads_of(values), labels)

    def states(self, steps: Grid) -> list[list[_Judged]]:
        """Per interaction, its nine cells judged from demonstrated steps (S, factors)."""
        judged = []
        for pair, occurs in zip(self.axes, self.spread, strict=True):
            counts = _counts(steps, pair)
            judged.append([self._judge(counts[cell], occurs[cell], pair) for cell in range(9)])
        return judged

    def _judge(self, counts: Grid, occurs: NDArray[np.bool_], pair: tuple[int, int]) -> _Judged:
        count = int(counts[0].sum())
        if not count:
            return _Judged("missing" if occurs[0].any() else "impossible", 0, None)
        others = [f for f in self.tested if f not in pair]
        possible = occurs | (counts > 0)  # the sample may have missed what a demonstration shows
        tests = {f: uniform_p_value(tuple(int(c) for c in counts[f][possible[f]])) for f in others if possible[f].sum() > 1}
        p = min(1.0, min(tests.values(), default=1.0) * max(len(tests), 1))
        if p >= SIGNIFICANCE:
            return _Judged("captured", count, p)
        worst = min(tests, key=lambda f: tests[f])
        return _Judged("uneven", count, p, (worst, int(counts[worst].argmax())))

    def places(self, k: int, cell: int) -> tuple[tuple[int, tuple[int, ...]], ...]:
        """Tools that have the cell, and where on them it is most common."""
        found = []
        for i, grid in self.grids.items():
            here = _cell(grid, self.axes[k]) == cell
            if here.any():
                often = np.bincount(self.sampled[i].region[here], minlength=self.regions[i])
                top = np.argsort(-often, kind="stable")[:SHOWN]
                found.append((i, tuple(int(a) for a in top if often[a])))
        return tuple(found)

    def table(self, k: int, judged: list[_Judged], waiting: list[int]) -> InteractionTable:
        cells = []
        for cell, j in enumerate(judged):
            text = situation(*self.phrases[k], cell)
            tools = self.places(k, cell)
            alike = "" if j.alike is None else alike_words(self.labels[j.alike[0]], j.alike[1])
            request = advice(j.state, text, tools, waiting, alike)
            pair = self.interactions[k]
            need = "" if j.state == "captured" else shape_needed((pair.first, pair.second), self.phrases[k], cell)
            cells.append(Cell(j.state, j.count, j.p_value, tools, text, request, need))
        rows = tuple(tuple(cells[r : r + 3]) for r in (0, 3, 6))
        return InteractionTable(self.interactions[k], *self.phrases[k], LEVEL_WORDS, LEVEL_WORDS, rows)

    def requests(self, steps: Grid, tables: tuple[InteractionTable, ...], captured: int, possible: int) -> list[Request]:
        """One per tool."""
        now, found = captured / possible if possible else 0.0, []
        for i in self.grids:
            changes = [self._rho(np.concatenate([steps, self.grids[i][order]])) - now for order in self.sampled[i].orders[:ORDERS_TRIED]]
            weak = [(c, dict(c.tools)[i]) for t in tables for row in t.cells for c in row if c.request and i in dict(c.tools)]
            gain = max(0.0, *changes)
            useful = bool(weak) and (gain > 0 or any(c.state == "missing" for c, _ in weak))
            regions: tuple[int, ...] = ()
            text = "shows nothing that is missing or uneven"
            if useful:
                weak.sort(key=lambda pair: pair[0].state != "missing")
                regions = tuple(sorted(weak[0][1]))
                letters = region_letters(self.regions[i])
                text = f"{weak[0][0].text}, most of all at {listed([letters[a] for a in regions])}"
            found.append(Request(text[0].upper() + text[1:], i, regions, float(gain), float(np.mean(changes)), useful))
        return found

    def _rho(self, steps: Grid) -> float:
        now, of = _tally(self.states(steps))
        return now / of if of else 0.0


def _cell(grid: Grid, pair: tuple[int, int]) -> Grid:
    return 3 * grid[:, pair[0]] + grid[:, pair[1]]


def _counts(grid: Grid, pair: tuple[int, int]) -> Grid:
    """(9, factors, 3) how often each level of each factor occurs in each cell."""
    factors = grid.shape[1]
    index = (_cell(grid, pair)[:, None] * factors + np.arange(factors)) * 3 + grid
    return np.bincount(index.ravel(), minlength=9 * factors * 3).reshape(9, factors, 3)


def _tally(states: list[list[_Judged]]) -> tuple[int, int]:
    flat = [j.state for table in states for j in table]
    return sum(s == "captured" for s in flat), sum(s != "impossible" for s in flat)
