"""Baselines from the exact likelihood p(xi) in proportion to exp(-w . Phi(xi)): maximum entropy, and Bayesian IRL by MCMC."""

import numpy as np

from app.learning.baselines.learner import Learned, by_weights
from app.learning.maximum_entropy import AnyLesson, fit, lessons_of, log_sum
from app.learning.performance_state import LearningDemonstration
from app.learning.qp import Array

PENALTY = 0.3  # of the squared norm; the best of those tried in the study this baseline comes from
STEPS = 400  # of the Markov chain
BURN = 0.25  # share of the chain that is thrown away
JUMP = 2.38  # over the square root of the dimension: the usual size of a random walk's steps


def by_maximum_entropy(demonstrations: list[LearningDemonstration], generator: np.random.Generator) -> Learned:
    """Ziebart et al. 2008 with exact sums over all sequences, weights at least 0; the generator is not used."""
    del generator
    lessons, scale, live = lessons_of(demonstrations)
    w = fit(lessons, PENALTY, lower=np.zeros(len(live)), curved=False).weights
    return by_weights(demonstrations, w / scale * np.array(live), live)


def by_bayes(demonstrations: list[LearningDemonstration], generator: np.random.Generator) -> Learned:
    """Ramachandran and Amir 2007 on whole sequences: the posterior mean of w >= 0 under a Gaussian prior, by Metropolis."""
    lessons, scale, live = lessons_of(demonstrations)
    chain = posterior_chain(lessons, generator)
    return by_weights(demonstrations, chain.mean(axis=0) / scale * np.array(live), live)


def posterior_chain(lessons: list[AnyLesson], generator: np.random.Generator, steps: int = STEPS) -> Array:
    """Samples of w >= 0 (S, F) on scaled features, after the burn-in.

    The walk starts at the most likely weights and steps with their covariance, so that the short chain spends its time where the
    posterior is.
    """
    best = fit(lessons, PENALTY, lower=np.zeros(len(lessons[0].total)))
    root = np.linalg.cholesky(best.covariance) * JUMP / np.sqrt(len(best.weights))
    at, level = best.weights, _level(lessons, best.weights)
    kept = []
    for _ in range(steps):
        trial = at + root @ generator.normal(size=len(at))
        chance = np.log(generator.random())
        if (trial >= 0).all():
            other = _level(lessons, trial)
            if chance < other - level:
                at, level = trial, other
        kept.append(at)
    return np.array(kept[int(BURN * steps) :])


def _level(lessons: list[AnyLesson], w: Array) -> float:
    """log of prior times likelihood, up to a constant."""
    likelihood = sum(log_sum(t, w) - float(w @ t.total) for t in lessons)
    return likelihood - PENALTY * len(lessons) / 2 * float(w @ w)
