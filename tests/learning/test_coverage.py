"""Eq. 5-6: the exact uniformity test against brute force, closed forms of rho, states and requests."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from app.errors import InvalidInput, UnknownFeature
from app.learning.coverage import ORDERS_TRIED, coverage
from app.learning.levels import SEED, LevelRules, factor_groups, measure_levels, sample_transitions, sequence_values
from app.learning.uniformity import uniform_p_value
from app.sequencing.features import DEFAULT_INTERACTIONS, FEATURE_SETS, Interaction
from app.sequencing.problem import problem_for
from tests.sequencing.graphs import grid_graph


def brute_force(counts: tuple[int, ...]) -> float:
    """Sum over every assignment of n observations to k categories that is no likelier than the observed counts."""
    n, k = sum(counts), len(counts)

    def ways(c):
        return math.factorial(n) // math.prod(math.factorial(x) for x in c)

    tally = [tuple(row.count(j) for j in range(k)) for row in itertools.product(range(k), repeat=n)]
    return sum(ways(t) <= ways(counts) for t in tally) / k**n


@pytest.mark.parametrize("counts", [(1, 0, 0), (3, 0, 0), (2, 1, 0), (4, 1, 1), (5, 1, 0), (6, 1, 1), (4, 3), (6, 1), (0, 5, 3)])
def test_exact_p_value_is_the_brute_force_one(counts):
    assert uniform_p_value(counts) == pytest.approx(brute_force(counts), abs=1e-12)


def test_p_value_closed_forms():
    """All of n in one of three: 3 / 3^n. Large counts: chi-squared with 2 degrees of freedom is exp(-x / 2)."""
    assert uniform_p_value((6, 0, 0)) == pytest.approx(3**-5)
    assert uniform_p_value((30, 20, 10)) == pytest.approx(math.exp(-(10**2 + 10**2) / 20 / 2))
    assert uniform_p_value((7, 7, 7)) == pytest.approx(1.0)
    assert uniform_p_value((0, 0, 0)) == 1.0
    assert uniform_p_value((9,)) == 1.0


def test_terciles_split_in_three():
    levels = measure_levels(("a",), np.arange(9.0)[:, None])
    assert levels.of(np.arange(9.0)[:, None])[:, 0].tolist() == [0, 0, 0, 1, 1, 1, 2, 2, 2]


def test_split_feature_is_one_factor():
    """The clean set has eleven columns but ten factors; together they use each column once."""
    groups = factor_groups(FEATURE_SETS["clean"])
    assert len(groups) == 10
    assert sorted(i for columns in groups.values() for i in columns) == list(range(11))
    assert groups["height"] == (9, 10)


def test_sampled_orders_are_real_orders():
    """The steps of each sampled order visit every region once and have the feature values of that sequence."""
    problem = problem_for(grid_graph(2, 3, 4))
    sampled = sample_transitions(problem)
    for steps in sampled.orders[:5]:
        order = tuple(int(a) for a in sampled.region[steps])
        assert sorted(order) == list(range(6))
        assert np.allclose(sampled.values[steps], sequence_values(problem, order))
        rows = problem.step_features(order)
        assert np.allclose(sampled.values[steps][:, -1], rows[:, 9] + rows[:, 10])


@pytest.fixture(scope="module")
def tools():
    return [problem_for(grid_graph(3, 3, seed)) for seed in range(1, 6)]


def recorded(tools, count):
    rng = np.random.default_rng(8)
    return [(i, tuple(int(a) for a in rng.permutation(tools[i].n))) for i in range(count)]


def test_no_demonstration_covers_nothing(tools):
    report = coverage(tools, [], DEFAULT_INTERACTIONS)
    assert report.rho == 0.0
    assert report.captured == 0
    assert report.possible == sum(c.state == "missing" for t in report.tables for row in t.cells for c in row) > 0
    assert {r.tool_index for r in report.requests} == set(range(5))


def test_every_step_lies_in_one_cell_of_each_table(tools):
    """Counts of a table add up to all demonstrated steps; rho is captured / possible of the cells shown."""
    report = coverage(tools, recorded(tools, 3), DEFAULT_INTERACTIONS)
    assert report.steps == 27
    cells = [[c for row in t.cells for c in row] for t in report.tables]
    assert [sum(c.count for c in own) for own in cells] == [27, 27]
    states = [c.state for own in cells for c in own]
    assert report.captured == states.count("captured")
    assert report.possible == 18 - states.count("impossible")
    assert report.rho == pytest.approx(report.captured / report.possible)
    for own in cells:
        for c in own:
            assert (c.state == "missing") == (c.count == 0 and bool(c.tools))
            assert c.state != "captured" or c.p_value >= 0.05
            assert c.state != "uneven" or c.p_value < 0.05


def test_cell_of_a_step_by_hand(tools):
    """A demonstrated step's cell is found again from the raw feature values and the stored thresholds."""
    demos = recorded(tools, 1)
    report = coverage(tools, demos, (Interaction("height", "curvature"),))
    rows = tools[0].step_features(demos[0][1])
    keys = report.thresholds.keys
    counts = np.zeros((3, 3), int)
    for row in rows:
        level = []
        for key, value in (("height", row[9] + row[10]), ("curvature", row[7])):
            k = keys.index(key)
            level.append(int(value > report.thresholds.low[k]) + int(value > report.thresholds.high[k]))
        counts[level[0], level[1]] += 1
    assert [[c.count for c in row] for row in report.tables[0].cells] == counts.tolist()


def test_repeating_one_step_kind_is_uneven():
    """Forty times the same order: steps of a cell are all alike, so no well-filled cell is captured."""
    tool = problem_for(grid_graph(3, 3, 2))
    order = tuple(range(9))
    once = coverage([tool], [(0, order)], DEFAULT_INTERACTIONS)
    often = coverage([tool], [(0, order)] * 40, DEFAULT_INTERACTIONS)
    assert once.captured > 0
    assert often.captured < once.captured
    assert any(c.state == "uneven" for t in often.tables for row in t.cells for c in row)


def test_request_gain_is_a_rise_in_rho(tools):
    """Tools without a demonstration come first, sorted by expected change; none promises more than all that is missing."""
    report = coverage(tools, recorded(tools, 1), DEFAULT_INTERACTIONS)
    order = [(r.tool_index == 0, -r.expected) for r in report.requests]
    assert order == sorted(order)
    assert {r.tool_index for r in report.requests} >= set(range(1, len(tools)))
    for r in report.requests:
        assert r.expected <= r.gain <= 1 - report.rho
        assert all(0 <= a < tools[r.tool_index].n for a in r.regions)


def test_expected_gain_is_the_mean_over_the_tried_orders(tools):
    """Recomputed by adding each tried order as a demonstration."""
    report = coverage(tools, recorded(tools, 1), DEFAULT_INTERACTIONS)
    request = report.requests[0]
    problem = tools[request.tool_index]
    generator = np.random.default_rng([SEED, problem.n])
    orders = [tuple(int(a) for a in generator.permutation(problem.n)) for _ in range(ORDERS_TRIED)]
    after = [coverage(tools, [*recorded(tools, 1), (request.tool_index, s)], DEFAULT_INTERACTIONS).rho for s in orders]
    assert request.expected == pytest.approx(np.mean(after) - report.rho)
    assert request.gain == pytest.approx(max(after) - report.rho)


def test_plain_occurrence_counts_uneven_situations_too(tools):
    report = coverage(tools, recorded(tools, 3), DEFAULT_INTERACTIONS)
    cells = [c for t in report.tables for row in t.cells for c in row]
    assert report.shown == sum(c.count > 0 for c in cells)
    assert report.occurrence == report.shown / report.possible
    assert report.occurrence >= report.rho


def test_thresholds_by_rule():
    """Terciles of 0..9 at 3 and 6; thirds of the range of skewed values; the expert's own numbers; each rule is stored."""
    values = np.stack([np.arange(10.0), np.arange(10.0) ** 2, np.arange(10.0)], axis=1)
    levels = measure_levels(("a", "b", "c"), values, LevelRules(chosen=(("b", "range"),), expert=(("c", 1.5, 7.5),)))
    assert levels.low == pytest.approx((3.0, 27.0, 1.5))
    assert levels.high == pytest.approx((6.0, 54.0, 7.5))
    assert levels.rules == ("quantile", "range", "expert")
    assert np.bincount(levels.of(values)[:, 2]).tolist() == [2, 6, 2]
    with pytest.raises(InvalidInput, match="above the upper one"):
        measure_levels(("a",), values[:, :1], LevelRules(expert=(("a", 2.0, 1.0),)))
    with pytest.raises(UnknownFeature, match="no feature 'colour'"):
        measure_levels(("a",), values[:, :1], LevelRules(chosen=(("colour", "range"),)))


def test_flat_tools_have_impossible_cells():
    """Without any curvature every curvature level but the lowest is impossible."""
    flat = grid_graph(2, 3, 3)
    flat = type(flat)(**{**{f: getattr(flat, f) for f in flat.__dataclass_fields__}, "curvature": np.zeros(6)})
    report = coverage([problem_for(flat)], [], (Interaction("height", "curvature"),))
    assert [[c.state for c in row] for row in report.tables[0].cells] == [["missing", "impossible", "impossible"]] * 3


def test_other_feature_sets_are_left_out(tools):
    other = problem_for(grid_graph(2, 3, 1, "real"))
    report = coverage([*tools, other], recorded(tools, 2), DEFAULT_INTERACTIONS)
    assert report.left_out == (5,)
    assert report.rho == coverage(tools, recorded(tools, 2), DEFAULT_INTERACTIONS).rho


def test_unknown_factor_is_refused(tools):
    with pytest.raises(UnknownFeature, match="colour"):
        coverage(tools, [], (Interaction("height", "colour"),))


@pytest.mark.parametrize(
    ("times", "alike"),  # probability of n steps all of one level among k, or of anything as uneven
    [(5, {2: 2 * 2**-5.0, 3: 3 * 3**-5.0}), (20, {2: math.erfc(math.sqrt(10)), 3: math.exp(-20)})],
    ids=["exact multinomial", "chi-squared"],
)
def test_p_value_of_a_cell_by_hand(times: int, alike: dict[int, float]):
    """n equal steps in one cell: below 15 each factor with k levels there gives k^(1 - n); above, chi-squared n (k - 1) with k - 1
    degrees of freedom. Corrected for the number of factors tested, judged at 0.05."""
    tool = problem_for(grid_graph(3, 3, 2))
    order = tuple(range(9))
    report = coverage([tool], [(0, order)] * times, DEFAULT_INTERACTIONS)
    sampled = sample_transitions(tool)
    levels = report.thresholds
    grid, shown = levels.of(sampled.values), levels.of(sequence_values(tool, order))
    tested = [f for f in range(len(levels.keys)) if len(set(grid[:, f].tolist())) == 3]
    axes = [levels.keys.index(k) for k in ("height", "curvature")]
    checked = 0
    for row in range(3):
        for column in range(3):
            cell = report.tables[0].cells[row][column]
            inside = shown[(shown[:, axes[0]] == row) & (shown[:, axes[1]] == column)]
            if len(inside) != 1:
                continue
            there = grid[(grid[:, axes[0]] == row) & (grid[:, axes[1]] == column)]
            kinds = [len({*there[:, f].tolist(), int(inside[0, f])}) for f in tested if f not in axes]
            tests = [alike[k] for k in kinds if k > 1]
            assert cell.count == times
            assert cell.p_value == pytest.approx(min(1.0, min(tests) * len(tests)))
            assert cell.state == ("captured" if cell.p_value >= 0.05 else "uneven")
            checked += 1
    assert checked


def test_uneven_cells_say_what_is_alike_and_what_a_new_tool_needs():
    """Forty times the same order: every uneven cell names a factor and level; no covered cell asks for anything."""
    tool = problem_for(grid_graph(3, 3, 2))
    report = coverage([tool], [(0, tuple(range(9)))] * 40, DEFAULT_INTERACTIONS)
    cells = [c for t in report.tables for row in t.cells for c in row]
    uneven = [c for c in cells if c.state == "uneven"]
    assert uneven
    assert all(" is mostly " in c.request and c.need.startswith("A new tool needs a region") for c in uneven)
    assert all(not c.need and not c.request for c in cells if c.state == "captured")


def test_every_tool_is_ranked_and_spreads_count_all_values(tools):
    report = coverage(tools, recorded(tools, 3), DEFAULT_INTERACTIONS)
    assert sorted(r.tool_index for r in report.requests) == list(range(5))
    assert [r.useful for r in report.requests] == sorted((r.useful for r in report.requests), reverse=True)
    values = np.concatenate([sample_transitions(p).values for p in tools])
    assert [sum(s.counts) for s in report.spreads] == [len(values)] * values.shape[1]
    assert [s.least for s in report.spreads] == pytest.approx(values.min(axis=0))


def test_table_computed_by_hand():
    """Three regions in a row, 0, 0.1 and 0.5 high, flat. Done from low to high the steps in height are 0, 0.1 and 0.45: with small up to
    0.05 and large from 0.35, one step of each level, all with the smallest change of curvature. Nothing else has levels to be even over."""
    graph = grid_graph(1, 3, 3)
    graph = replace(graph, height=np.array([0.0, 0.1, 0.5]), curvature=np.zeros(3))
    problem = problem_for(graph)
    others = [key for key in factor_groups(problem.features) if key != "height"]
    rules = LevelRules(expert=(("height", 0.05, 0.35), *((key, 9.0, 9.0) for key in others)))
    suspected = (Interaction("height", "curvature"),)
    report = coverage([problem], [(0, (0, 1, 2))], suspected, rules)
    assert [[c.count for c in row] for row in report.tables[0].cells] == [[1, 0, 0]] * 3
    assert [[c.state for c in row] for row in report.tables[0].cells] == [["captured", "impossible", "impossible"]] * 3
    assert (report.rho, report.captured, report.shown, report.possible) == (1.0, 3, 3, 3)
    high_first = coverage([problem], [(0, (2, 1, 0))], suspected, rules)  # steps 0, 0.4 down, 0.3 down
    assert [row[0].count for row in high_first.tables[0].cells] == [1, 1, 1]
    assert [row[0].state for row in coverage([problem], [], suspected, rules).tables[0].cells] == ["missing"] * 3
