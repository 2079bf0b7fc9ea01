"""On rectangular grids `clean` says what the authors' sets say, up to the normalisation that docs/features.md states."""

from dataclasses import replace

import numpy as np
import pytest

from app.sequencing.features import FEATURE_SETS, feature_values
from app.sequencing.problem import all_sets
from tests.sequencing.graphs import grid_graph


@pytest.mark.parametrize(("rows", "columns", "seed"), [(2, 3, 0), (1, 5, 1), (3, 3, 2)])
def test_clean_equals_the_authors_up_to_normalisation(rows: int, columns: int, seed: int) -> None:
    """Borders and gaps are equal; jump / 15 with corners at 1/3, the angle about 1/2 by share of border, steps without weights."""
    mesh = grid_graph(rows, columns, seed)
    real = replace(mesh, source="real", low=mesh.low, high=mesh.low)  # (row, column), as they index regions
    synthetic = replace(mesh, source="synthetic", curvature=np.abs(mesh.curvature))
    sets = all_sets(mesh.n)
    some = sets.any(axis=1)
    left = ~sets
    clean, theirs = (feature_values(g, FEATURE_SETS[n], sets) for g, n in ((mesh, "clean"), (real, "authors-real")))
    for column in (0, 1, 2, 3, 5, 6):
        assert clean[left][:, column] == pytest.approx(theirs[left][:, column], abs=1e-12), column
    jumps = feature_values(synthetic, FEATURE_SETS["authors-synthetic"], sets)[..., 4]
    assert clean[left][:, 4] == pytest.approx(np.select([jumps[left] == 5, jumps[left] == 15], [1 / 3, 1.0], 0.0), abs=1e-12)
    use = left & some[:, None]
    assert clean[use][:, 7] == pytest.approx(theirs[use][:, 7] / 2, abs=1e-12)
    step = (theirs[..., 9] - 5 / mesh.height)[use]  # 99 up, 21 down
    assert 99 * clean[use][:, 9] + 21 * clean[use][:, 10] == pytest.approx(step, abs=1e-9)
    even = mesh.neighbour.sum(axis=1)
    angle = 0.5 + (theirs[..., 8] - np.pi) / (2 * np.pi * even)  # equal borders: each share is 1 / number of neighbours
    assert clean[left][:, 8] == pytest.approx(angle[left], abs=1e-12)
