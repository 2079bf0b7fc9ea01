"""The `clean` features on measured meshes: in [0, 1] on every state, the same whatever regions are called and wherever a tool stands."""

from functools import lru_cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.geometry.moulds import sample_moulds
from app.geometry.regions import measure_labelled
from app.geometry.tool import Mesh, Tool
from app.sequencing.features import FEATURE_SETS, feature_values
from app.sequencing.problem import all_sets

CLEAN = FEATURE_SETS["clean"]
GAPS = [i for i, c in enumerate(CLEAN.columns) if c.key.startswith("gaps")]
moulds = st.integers(0, len(sample_moulds()) - 1)


@lru_cache
def measured(k: int) -> Tool:
    mould = sample_moulds()[k]
    return measure_labelled(mould.mesh, mould.labels)


def some_sets(n: int, seed: int, count: int = 200) -> np.ndarray:
    return np.random.default_rng(seed).random((count, n)) < np.linspace(0, 1, count)[:, None]


@given(moulds, st.integers(0, 10_000))
@settings(max_examples=8, deadline=None)
def test_numbers_of_regions_do_not_matter(k: int, seed: int) -> None:
    """Attributes and features move along when regions get other numbers; first[] is not read by `clean`."""
    tool = measured(k)
    order = np.random.default_rng(seed).permutation(tool.n)  # new number of each region
    labels = np.where(tool.labels >= 0, order[tool.labels], -1).astype(np.int32)
    other = measure_labelled(tool.mesh, labels)
    assert [other.regions[order[a]].kind for a in range(tool.n)] == [r.kind for r in tool.regions]
    assert [other.regions[order[a]].curvature for a in range(tool.n)] == pytest.approx([r.curvature for r in tool.regions], rel=1e-9)
    sets = some_sets(tool.n, seed)
    moved = np.zeros_like(sets)
    moved[:, order] = sets
    assert feature_values(other.graph, CLEAN, moved)[:, order] == pytest.approx(feature_values(tool.graph, CLEAN, sets), abs=1e-9)


@given(moulds, st.floats(0, 6.28), st.tuples(*[st.floats(-5, 5)] * 3), st.floats(0.2, 5))
@settings(max_examples=8, deadline=None)
def test_place_heading_and_size_do_not_matter(k: int, angle: float, shift: tuple[float, float, float], scale: float) -> None:
    """All features but the gaps, whose boxes lie along x and y: these keep under quarter turns."""
    tool = measured(k)
    c, s = np.cos(angle), np.sin(angle)
    turned = tool.mesh.vertices @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) * scale + np.array(shift)
    other = measure_labelled(Mesh(turned, tool.mesh.faces), tool.labels)
    sets = some_sets(tool.n, 1)
    rest = [i for i in range(len(CLEAN.columns)) if i not in GAPS]
    assert feature_values(other.graph, CLEAN, sets)[..., rest] == pytest.approx(
        feature_values(tool.graph, CLEAN, sets)[..., rest], abs=1e-6
    )


@pytest.mark.parametrize("quarters", [1, 2, 3])
def test_quarter_turns_leave_every_feature_alone(quarters: int) -> None:
    for k in range(0, len(sample_moulds()), 3):
        tool = measured(k)
        x, y, z = tool.mesh.vertices.T
        turned = [(-y, x, z), (-x, -y, z), (y, -x, z)][quarters - 1]
        other = measure_labelled(Mesh(np.stack(turned, axis=1) + 0.3, tool.mesh.faces), tool.labels)
        sets = some_sets(tool.n, k)
        assert feature_values(other.graph, CLEAN, sets) == pytest.approx(feature_values(tool.graph, CLEAN, sets), abs=1e-9)


@pytest.mark.parametrize("k", range(len(sample_moulds())))
def test_every_transition_of_every_sample_lies_between_0_and_1(k: int) -> None:
    tool = measured(k)
    sets = all_sets(tool.n)
    values = feature_values(tool.graph, CLEAN, sets)[~sets]
    assert values.min() >= -1e-12
    assert values.max() <= 1 + 1e-12
