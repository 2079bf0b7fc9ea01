"""The contract of features: every built-in set keeps to it, and each way of breaking it is named."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from app.errors import InvalidFeature
from app.geometry.moulds import sample_moulds
from app.geometry.regions import measure
from app.geometry.tool import Array, GraphSource, RegionGraph
from app.sequencing.contract import contract_faults, renumbered
from app.sequencing.features import FEATURE_SETS, FeatureSet, feature_values
from app.sequencing.plugins import read_own_feature
from app.sequencing.structure import Sets
from tests.sequencing.graphs import grid_graph

NEAR = '''"""Nearness to what was finished, by area."""
import numpy as np

KEY, LABEL = "small_first", "Small regions first"


def values(graph, done):
    share = graph.area / graph.area.max()
    return np.broadcast_to(1 - share, done.shape)
'''


def column(features: FeatureSet, k: int) -> Callable[[RegionGraph, Sets], Array]:
    return lambda graph, done: feature_values(graph, features, done)[..., k]


@pytest.mark.parametrize(
    ("name", "source"), [("clean", "mesh"), ("authors-real", "real"), ("authors-synthetic", "synthetic"), ("layout", "mesh")]
)
def test_built_in_features_keep_to_the_contract(name: str, source: GraphSource) -> None:
    graphs = [grid_graph(2, 3, 0, source), grid_graph(3, 4, 1, source)]
    if source == "mesh":
        graphs += [measure(m.mesh, m.labels).graph for m in sample_moulds()[:2]]
    features = FEATURE_SETS[name]
    bounds = (0.0, 1.0) if name == "clean" else None
    faults = {c.key: contract_faults(column(features, k), graphs, bounds) for k, c in enumerate(features.columns)}
    assert not any(faults.values()), faults


def wrong(change: Callable[[RegionGraph, Sets], Array]) -> str:
    return " ".join(contract_faults(change, [grid_graph(2, 3, 0)]))


def test_each_broken_rule_is_named() -> None:
    drawn = np.random.default_rng(1)
    assert "between 0 and 1, and region 0 has 1.5" in wrong(lambda g, d: np.full(d.shape, 1.5))
    assert "finite" in wrong(lambda g, d: np.full(d.shape, np.nan))
    assert "second time" in wrong(lambda g, d: drawn.random(d.shape))
    assert "numbered differently" in wrong(lambda g, d: np.broadcast_to(np.arange(g.n) / g.n, d.shape))
    assert "own set only" in wrong(lambda g, d: np.broadcast_to(d.mean(), d.shape))
    assert "shape (71, 6)" in wrong(lambda g, d: np.zeros(3))
    assert "ValueError" in wrong(lambda g, d: g.area.__setitem__(0, 1.0))  # type: ignore[func-returns-value]


def test_renumbering_there_and_back_is_the_same_tool() -> None:
    graph = grid_graph(2, 3, 0, "real")
    order = np.array([3, 1, 5, 0, 2, 4])
    back = renumbered(renumbered(graph, order), np.argsort(order))
    assert all(np.array_equal(getattr(back, name), getattr(graph, name)) for name in ("shared", "first", "height", "low", "corner"))
    assert not np.array_equal(renumbered(graph, order).shared, graph.shared)


def test_an_own_feature_is_its_text(tmp_path: Path) -> None:
    path = tmp_path / "small_first.py"
    path.write_text(NEAR, encoding="utf-8")
    own = read_own_feature(path)
    assert (own.key, own.label) == ("small_first", "Small regions first")
    assert contract_faults(own, [grid_graph(2, 3, 0)]) == ()
    path.write_text(NEAR.replace("1 - share", "share"), encoding="utf-8")
    assert read_own_feature(path).version != own.version
    assert own(grid_graph(2, 3, 0), np.zeros((1, 6), np.bool_)).min() == 0


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("KEY = 3\n", "needs KEY"),
        ("KEY = 'a_b'\n", "needs LABEL"),
        ("KEY, LABEL = 'a_b', 'A'\n", "values(graph, done)"),
        ("def values(:\n", "SyntaxError"),
        ("import no_such_module_here\n", "ModuleNotFoundError"),
    ],
)
def test_a_malformed_file_is_refused_with_a_sentence(tmp_path: Path, text: str, sentence: str) -> None:
    path = tmp_path / "own.py"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InvalidFeature, match=r"own\.py") as caught:
        read_own_feature(path)
    assert sentence in str(caught.value)
