"""The authors' published region tables, feature values and costs. Their data lies beside the project."""

import csv

import numpy as np
import pytest

from app.geometry.region_table import RegionTable, read_region_table
from app.sequencing.classes import best_classes, equivalent_sequences
from app.sequencing.problem import problem_for
from app.sequencing.shortest import shortest_sequence
from tests.conftest import shared

TRAINING = (1, 2, 3, 6, 8, 9)


def table(kind: str, number: int) -> RegionTable:
    name = f"Mold_{number}_Data.csv"
    return read_region_table(shared("datasets", "authors", kind, name).read_text(), None, name)


@pytest.mark.parametrize("number", TRAINING)
def test_published_feature_values(number: int):
    """All ten features at every step of the expert's sequence, to 1e-9."""
    with shared("datasets", "authors", "published_feature_values_synthetic_train.csv").open() as file:
        rows = [row for row in csv.reader(file) if row[1] not in ("traj_id",) and float(row[1]) == number]
    published = np.array(rows, float)[:, 2:]
    tool = table("synthetic", number)
    assert tool.expert is not None
    ours = problem_for(tool.tool.graph, ()).step_features(tool.expert)
    assert ours.shape == published.shape
    assert np.abs(ours - published).max() < 1e-9


@pytest.mark.parametrize(("number", "cost"), [(3, 4.860571), (4, 6.785370), (9, 10.077824), (10, 8.566852), (2, 9.287196)])
def test_expert_is_cheapest_under_equal_weights(number: int, cost: float):
    """Lowest cost under weights 1 / sqrt(10), as the authors' own graph search finds it; the expert's sequence has it too."""
    tool = table("synthetic", number)
    problem, w = problem_for(tool.tool.graph, ()), np.full(10, 10**-0.5)
    assert tool.expert is not None
    assert shortest_sequence(problem, w).cost == pytest.approx(cost, abs=1e-6)
    assert problem.cost(w, tool.expert) == pytest.approx(cost, abs=1e-6)


def test_expert_of_synthetic_7_is_a_little_above_the_cheapest():
    tool = table("synthetic", 7)
    problem, w = problem_for(tool.tool.graph, ()), np.full(10, 10**-0.5)
    assert tool.expert is not None
    assert problem.cost(w, tool.expert) - shortest_sequence(problem, w).cost == pytest.approx(0.00094, abs=5e-6)


def test_real_8_under_equal_weights():
    tool = table("real", 8)
    problem, w = problem_for(tool.tool.graph, ()), np.full(10, 10**-0.5)
    assert tool.expert is not None
    assert shortest_sequence(problem, w).cost == pytest.approx(53.363835, abs=1e-6)
    assert problem.cost(w, tool.expert) == pytest.approx(55.601585, abs=1e-6)


def test_symmetric_tools_tie_and_have_equivalents():
    """Synthetic tool 6: 64 equally cheap sequences under equal weights, 48 with the expert's feature sum."""
    tool = table("synthetic", 6)
    problem, w = problem_for(tool.tool.graph, ()), np.ones(10)
    assert tool.expert is not None
    assert shortest_sequence(problem, w).ties == best_classes(problem, w, 3)[0].count == 64
    omega = equivalent_sequences(problem, tool.expert)
    assert omega.complete
    assert len(omega.sequences) == 48


@pytest.mark.parametrize("kind", ["synthetic", "real"])
@pytest.mark.parametrize("number", range(1, 11))
def test_every_published_table_is_read_and_drawn(kind: str, number: int):
    tool = table(kind, number)
    assert tool.layout == kind
    assert tool.expert is not None
    assert sorted(tool.expert) == list(range(tool.tool.n))
    assert set(tool.tool.labels.tolist()) - {-1} == set(range(tool.tool.n))
    assert tool.faults  # every file has some: see the data's own notes


@pytest.mark.parametrize(
    ("kind", "number", "fault"),
    [
        ("synthetic", 1, "Row c: lists b as a corner neighbour and as an edge neighbour."),
        ("synthetic", 5, "Row d: lists e as a neighbour, but row e doesn't list d."),
        ("synthetic", 7, "Row b: lists itself (b) as a neighbour."),
        ("real", 1, "border is"),
        ("real", 4, "Row a: '0.35,0.2,0.4,0,35,0.6' in 'neighbor edges' holds 6 lengths for 5 neighbours"),
        ("real", 8, "add up to 0.64"),
    ],
)
def test_known_faults_are_named(kind: str, number: int, fault: str):
    faults = table(kind, number).faults
    assert any(fault in sentence for sentence in faults), faults
