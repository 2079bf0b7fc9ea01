"""Fig. 4 in small."""

import numpy as np

from app.learning.ablation import VARIANTS, ablate, band
from tests.learning.test_baselines import shown


def test_band_is_the_normal_interval_of_the_mean():
    found = band(np.array([[1.0, 2.0], [3.0, 2.0], [5.0, 2.0]]))
    assert found.mean.tolist() == [3.0, 2.0]
    assert np.allclose(found.high - found.mean, [1.96 * 2 / np.sqrt(3), 0])
    assert np.allclose(found.mean - found.low, found.high - found.mean)


def test_variants_start_alike_and_the_same_seeds_give_the_same_bytes():
    demos = [shown(s) for s in (1, 2)]
    first, second = ablate(demos, seeds=2, updates=4), ablate(demos, seeds=2, updates=4)
    assert tuple(first.bands) == VARIANTS
    for variant in VARIANTS:
        for quantity in ("spread", "shift", "violations"):
            mean = first.bands[variant][quantity].mean
            assert len(mean) == 5
            assert mean.tobytes() == second.bands[variant][quantity].mean.tobytes()
            assert mean[0] == first.bands["all terms"][quantity].mean[0]
    assert first.bands["all terms"]["spread"].mean[-1] != first.bands["no alpha"]["spread"].mean[-1]


def test_gamma_alone_removes_violations():
    """Without the term that looks at the cheapest order, more recorded orders stay dearer than it."""
    found = ablate([shown(s) for s in range(1, 4)], seeds=3, updates=25)
    assert found.bands["all terms"]["violations"].mean[-1] <= found.bands["no gamma"]["violations"].mean[-1]
