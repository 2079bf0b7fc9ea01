"""Features switched off and added: the rest keeps its values, and the name says it all."""

import pickle

import numpy as np
import pytest

from app.errors import InvalidInput, UnknownFeature
from app.sequencing.choice import chosen_features, features_named
from app.sequencing.features import FEATURE_SETS, Interaction, feature_values
from app.sequencing.plugins import OwnFeature
from app.sequencing.problem import SequencingProblem, all_sets
from app.sequencing.shortest import shortest_sequence
from tests.sequencing.graphs import every_order, grid_graph

CLEAN = FEATURE_SETS["clean"]
SMALL = OwnFeature(
    "import numpy as np\nKEY, LABEL = 'small_first', 'Small regions first'\n\n\n"
    "def values(graph, done):\n    "
    "return np.broadcast_to(1 - graph.area / graph.area.max(), done.shape) * (1 - done.mean(axis=1, keepdims=True))\n"
)


def test_what_stays_keeps_its_values() -> None:
    graph, done = grid_graph(2, 3, 0), all_sets(6)
    some = chosen_features(CLEAN, ["height", "jump"])
    kept = [i for i, c in enumerate(CLEAN.columns) if c.key not in ("height_up", "height_down", "jump")]
    assert np.array_equal(feature_values(graph, some, done), feature_values(graph, CLEAN, done)[..., kept])
    assert "height" not in some.factors
    assert [some.columns[i].key for i in some.factors["curvature"]] == ["curvature"]


def test_half_of_a_factor_can_go() -> None:
    some = chosen_features(CLEAN, ["height_up"])
    assert [some.columns[i].key for i in some.factors["height"]] == ["height_down"]


def test_own_features_are_sequenced_exactly() -> None:
    graph = grid_graph(2, 3, 0)
    problem = SequencingProblem(graph, chosen_features(CLEAN, ["jump"], [SMALL]), (Interaction("small_first", "curvature"),))
    w = np.random.default_rng(2).uniform(0.1, 1, len(problem.columns))
    orders, sums = every_order(problem)
    best = shortest_sequence(problem, w)
    assert best.cost == pytest.approx((sums @ w).min(), abs=1e-9)
    assert best.sequence in orders


def test_the_name_gives_the_set_back_also_in_another_process() -> None:
    some = chosen_features(CLEAN, ["jump", "height"], [SMALL])
    assert some.name == f"clean~height~jump+small_first@{SMALL.version}"
    assert features_named(some.name, {f"small_first@{SMALL.version}": SMALL}) == some
    assert pickle.loads(pickle.dumps(some)) == some
    assert features_named("authors-real") is not None
    assert features_named("authors-real").columns == FEATURE_SETS["authors-real"].columns


def test_wrong_choices_are_refused() -> None:
    with pytest.raises(UnknownFeature, match="switch off"):
        chosen_features(CLEAN, ["no_such"])
    with pytest.raises(InvalidInput, match="At least one"):
        chosen_features(CLEAN, [c.key for c in CLEAN.columns])
    with pytest.raises(InvalidInput, match="already"):
        chosen_features(CLEAN, [], [OwnFeature(SMALL.source.replace("small_first", "jump"))])
    with pytest.raises(UnknownFeature, match="put its file back"):
        features_named("clean+small_first@00000000")
    with pytest.raises(UnknownFeature, match="no feature set"):
        features_named("nothing")
