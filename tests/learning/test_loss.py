"""Eq. 7: value by hand, subgradient against finite differences, exact minimiser against random points."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.learning.loss import LossTerms, minimise_loss, performance_gradient, performance_loss

TERMS = LossTerms(0.3, 0.7, 5.0, 0.2)


def instance(seed: int):
    rng = np.random.default_rng(seed)
    demo = rng.uniform(0, 2, (3, 4))
    samples = [rng.uniform(0, 3, (k, 4)) for k in (2, 5, 3)]
    cuts = [[rng.uniform(0, 3, 4) for _ in range(3)] for _ in demo]
    return rng, demo, samples, cuts


def cheapest(w, demo, cuts):
    """The demonstration or the cheapest cut, per tool."""
    rows = [np.array([d, *c]) for d, c in zip(demo, cuts, strict=True)]
    return np.array([r[np.argmin(r @ w)] for r in rows])


def test_value_by_hand():
    """One tool, w = (1, 2): C(demo) = 5, samples cost 4 and 8, cheapest 3: 0.3 (5 - 6) + 0.7 (5 - 4) + 5 (5 - 3) + 0.2 * 5."""
    w = np.array([1.0, 2.0])
    value = performance_loss(w, np.array([[1.0, 2.0]]), [np.array([[4.0, 0.0], [0.0, 4.0]])], np.array([[3.0, 0.0]]), TERMS)
    assert value.alpha == pytest.approx(-0.3)
    assert value.beta == pytest.approx(0.7)
    assert value.gamma == pytest.approx(10.0)
    assert value.regularisation == pytest.approx(1.0)
    assert value.total == pytest.approx(11.4)


@given(st.integers(0, 200))
@settings(max_examples=40, deadline=None)
def test_gradient_is_the_slope_of_the_loss(seed: int):
    """Central differences agree where the loss is smooth, which is almost everywhere."""
    rng, demo, samples, cuts = instance(seed)
    w, step = rng.uniform(0.5, 1.5, 4), 1e-6
    gradient = performance_gradient(w, demo, samples, cheapest(w, demo, cuts), TERMS)
    for k in range(4):
        up, down = w + step * np.eye(4)[k], w - step * np.eye(4)[k]
        rise = (
            performance_loss(up, demo, samples, cheapest(up, demo, cuts), TERMS).total
            - performance_loss(down, demo, samples, cheapest(down, demo, cuts), TERMS).total
        )
        assert gradient[k] == pytest.approx(rise / (2 * step), abs=1e-5)


@pytest.mark.parametrize("term", ["alpha", "beta", "gamma", "regularisation"])
def test_gradient_of_each_term_alone(term: str):
    """Each factor's part of Eq. 7 by itself, so that two wrong parts can't make up for each other; and it is no zero."""
    only = replace(LossTerms(0.0, 0.0, 0.0, 0.0), **{term: 1.3})
    for seed in range(10):
        rng, demo, samples, cuts = instance(seed)
        w, step = rng.uniform(0.5, 1.5, 4), 1e-6
        gradient = performance_gradient(w, demo, samples, cheapest(w, demo, cuts), only)
        values = [
            [getattr(performance_loss(x, demo, samples, cheapest(x, demo, cuts), only), term) for x in (w + d, w - d)]
            for d in step * np.eye(4)
        ]
        assert gradient == pytest.approx([(up - down) / (2 * step) for up, down in values], abs=1e-5)
        assert term == "gamma" or np.abs(gradient).max() > 0.01  # a demonstration may already be the cheapest


@given(st.integers(0, 200))
@settings(max_examples=25, deadline=None)
def test_no_point_beats_the_exact_minimiser(seed: int):
    """The quadratic program's weights have the lowest loss among themselves and random feasible points near and far."""
    rng, demo, samples, cuts = instance(seed)
    floor = np.full(4, 0.05)
    best = minimise_loss(demo, samples, cuts, TERMS, floor)
    lowest = performance_loss(best, demo, samples, cheapest(best, demo, cuts), TERMS).total
    assert (best >= floor).all()
    for spread in (1e-3, 0.1, 2.0):
        for _ in range(20):
            other = np.maximum(best + spread * rng.normal(size=4), floor)
            assert performance_loss(other, demo, samples, cheapest(other, demo, cuts), TERMS).total >= lowest - 1e-8
