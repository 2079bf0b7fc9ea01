"""The soft posterior against sums over many directions, and what repeats say about an expert."""

import numpy as np
import pytest

from app.learning.noisy_answers import Comparison, log_likelihood, reliability, soft_samples

SIGNED = np.array([0.0, 1.0, 1.0])
ANSWERS = [
    Comparison(np.array([1.0, 0.5, 0.0]), "left"),
    Comparison(np.array([0.0, 1.0, -1.0]), "right"),
    Comparison(np.array([1.0, -1.0, 0.2]), "equal"),
    Comparison(np.array([9.0, 9.0, 9.0]), "cant_tell"),
]
GROUPS = [np.array([[0.6, 0.8, 0.0], [0.0, -0.6, 0.8]])]


def directions(count: int) -> np.ndarray:
    x = np.random.default_rng(0).normal(size=(count, 3))
    x = np.where(SIGNED > 0, np.abs(x), x)
    return x / np.linalg.norm(x, axis=1, keepdims=True)


def test_samples_have_the_posterior_mean_of_weighted_directions():
    """Importance weights on 200,000 even directions give the exact mean and spread."""
    even = directions(200_000)
    weight = np.exp(log_likelihood(even, ANSWERS, GROUPS, 6.0))
    weight /= weight.sum()
    mean = weight @ even
    spread = np.sqrt(weight @ (even - mean) ** 2)
    drawn = soft_samples(SIGNED, ANSWERS, GROUPS, 6.0, 3000, np.random.default_rng(1))
    assert np.abs(drawn.mean(axis=0) - mean).max() < 0.04
    assert np.abs(drawn.std(axis=0) - spread).max() < 0.04
    assert (drawn[:, 1:] >= 0).all()


def test_one_answer_by_hand():
    """P(left) is the logistic of sharpness times the cosine; "right" is its complement; two answers count twice."""
    u = np.array([[0.6, 0.8, 0.0]])
    d = np.array([2.0, 0.0, 0.0])
    left = float(log_likelihood(u, [Comparison(d, "left")], [], 5.0)[0])
    right = float(log_likelihood(u, [Comparison(d, "right")], [], 5.0)[0])
    assert left == pytest.approx(-np.log1p(np.exp(-3.0)))
    assert np.exp(left) + np.exp(right) == pytest.approx(1.0)
    assert float(log_likelihood(u, [Comparison(d, "left", 2)], [], 5.0)[0]) == pytest.approx(2 * left)


def test_contradicting_answers_are_weighed():
    """Three against one: the majority's side is likelier, the other stays possible."""
    d = np.array([1.0, 0.0, 0.0])
    drawn = soft_samples(SIGNED, [Comparison(d, "left", 3), Comparison(d, "right", 1)], [], 3.0, 2000, np.random.default_rng(2))
    share = float((drawn[:, 0] > 0).mean())
    assert 0.75 < share < 0.99


def test_sharper_answers_bind_more():
    d = np.array([1.0, 0.0, 0.0])
    means = [soft_samples(SIGNED, [Comparison(d, "left")], [], s, 1500, np.random.default_rng(3))[:, 0].mean() for s in (0.5, 4.0, 30.0)]
    assert means == sorted(means)


def test_reliability_from_repeats():
    assert reliability([]) is None
    assert reliability([("left", "cant_tell")]) is None
    always, mixed = reliability([("left", "left")] * 18), reliability([("left", "left"), ("left", "right")] * 9)
    assert always == pytest.approx(0.5 * (1 + np.sqrt(2 * 0.95 - 1)))
    assert mixed == 0.5
