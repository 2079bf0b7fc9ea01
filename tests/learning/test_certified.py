"""Certified mode: every demonstration a cheapest sequence or the reason why not, and what the demonstrations leave open."""

import numpy as np
import pytest

from app.errors import EmptySample, InvalidInput
from app.learning.certified import CertifiedPrior, certify, compromise, explore, pool_for
from app.learning.cuts import unit_rows
from app.learning.expert import ScriptedExpert
from app.learning.identifiable import Frame
from app.learning.many_optima import cheapest_orders, random_orders, sums_of
from app.learning.performance_state import LearningDemonstration
from app.sequencing.features import Interaction
from app.sequencing.problem import problem_for
from app.sequencing.shortest import shortest_sequence
from tests.learning.made_up import TRUE_WEIGHTS, demonstrations, problems
from tests.sequencing.graphs import every_order, grid_graph

EXPERT = ScriptedExpert(TRUE_WEIGHTS, None)


@pytest.fixture(scope="module")
def demos():
    return demonstrations(EXPERT, problems(5))


@pytest.mark.parametrize("seed", [0, 1])
def test_every_demonstration_of_a_known_expert_is_proved_cheapest(demos, seed):
    found = certify(demos, seed=seed)
    assert found.realisable
    assert found.margin > 0
    for d in demos:
        _, sums = every_order(d.problem)
        own = d.problem.cost(found.weights, d.sequence)
        assert own <= (sums @ found.weights).min() * (1 + 1e-9)
    assert (found.slack == 0).all()


def test_samples_of_the_version_space_satisfy_all_cuts_and_all_orders(demos):
    """Not only the rows written down: against all 720 orders of each tool."""
    found = certify(demos)
    assert len(found.samples) == 64
    for d in demos:
        _, sums = every_order(d.problem)
        costs = sums @ found.samples.T
        own = d.problem.feature_sum(d.sequence) @ found.samples.T
        assert (own <= costs.min(axis=0) + 1e-8 * np.abs(costs).max(axis=0)).all()
    assert np.ptp(found.samples, axis=0).max() > 0.01  # and they are not one point


def test_batch_of_optima_is_the_dynamic_program(demos):
    weights = np.random.default_rng(3).normal(size=(9, len(TRUE_WEIGHTS)))
    for d in demos[:2]:
        orders = cheapest_orders(d.problem, weights)
        costs = np.einsum("sk,sk->s", sums_of(d.problem, orders), weights)
        assert np.allclose(costs, [shortest_sequence(d.problem, w).cost for w in weights], rtol=1e-9, atol=1e-12)


def test_reduced_coordinates_give_the_same_cost_differences(demos):
    """On any two orders of a tool; weights that come back have the declared signs."""
    rng = np.random.default_rng(5)
    frame = Frame.of([d.problem for d in demos])
    assert frame.size == 13 - 2 - 1  # equal squares: borders are constants; opposite edges are one free coordinate
    u = np.where(frame.signed > 0, rng.random(frame.size), -0.3)
    w = frame.weights(u)
    assert (w >= 0).all()
    for d in demos:
        sums = sums_of(d.problem, random_orders(d.problem, 10, rng))
        assert np.allclose((sums - sums[0]) @ w, (frame.reduce(sums) - frame.reduce(sums[0])) @ u)
    assert np.allclose(frame.coordinates_of(w), u)


def test_reversed_demonstrations_of_two_like_tools_get_slack(demos):
    """One tool shown in its dearest order: no weights explain all; without it they do."""
    orders, sums = every_order(demos[0].problem)
    dearest = orders[int(np.argmax(sums @ TRUE_WEIGHTS))]
    spoiled = [LearningDemonstration(demos[0].problem, dearest), *demos[1:]]
    found = certify(spoiled)
    assert not found.realisable
    assert found.slack[0] > 0.01
    assert found.margin == 0
    assert len(found.samples) == 0
    assert certify(spoiled[1:]).realisable


def test_compromise_satisfies_its_optimality_conditions(demos):
    """The soft problem is convex: no feasible direction improves it, tried on random ones and against every order."""
    orders, sums = every_order(demos[0].problem)
    spoiled = [LearningDemonstration(demos[0].problem, orders[int(np.argmax(sums @ TRUE_WEIGHTS))]), *demos[1:]]
    prior = CertifiedPrior()
    pool = pool_for(spoiled, prior, ())
    signed = pool.frame.signed
    u = compromise(pool, range(5), prior)
    u = u * signed.sum() / (u @ signed)
    rows = [unit_rows([pool.frame.reduce(s) - pool.target(i) for s in every_order(d.problem)[1]], len(u)) for i, d in enumerate(spoiled)]
    lengths = [
        np.array([np.linalg.norm(pool.frame.reduce(s) - pool.target(i)) for s in every_order(d.problem)[1]]) for i, d in enumerate(spoiled)
    ]

    def objective(x):
        slack = sum(max(0.0, float((size * (prior.margin - a @ x)).max())) for a, size in zip(rows, lengths, strict=True))
        return 0.5 * prior.regularisation * float(x @ x) + slack

    best, rng = objective(u), np.random.default_rng(2)
    assert (u[signed > 0] >= prior.least - 1e-7).all()
    for _ in range(300):
        step = rng.normal(size=len(u)) * 10 ** rng.uniform(-3, 0)
        other = np.where(signed > 0, np.maximum(u + step, prior.least), u + step)
        other = np.where(
            signed > 0, prior.least + (other - prior.least) * (signed.sum() * (1 - prior.least)) / ((other - prior.least) @ signed), other
        )
        assert objective(other) >= best - 1e-6


def test_weight_nobody_can_know_is_marked():
    """Equal squares: what borders what never differs in sum."""
    found = certify(demonstrations(EXPERT, problems(3)))
    assert found.identifiable == (False, False, *[True] * 11)
    assert found.weights[0] == found.weights[1] == 0


def test_intervals_shrink_with_demonstrations():
    tools = problems(6)
    few, many = certify(demonstrations(EXPERT, tools[:1])), certify(demonstrations(EXPERT, tools))
    assert np.diff(many.intervals).sum() < 0.95 * np.diff(few.intervals).sum()
    assert (many.intervals[:, 0] <= many.intervals[:, 1]).all()


def test_declared_sign_is_kept():
    """An expert who likes to go up in height: with that weight declared at most 0 it is learned so, otherwise it contradicts."""
    likes = TRUE_WEIGHTS.copy()
    likes[9] = -6.0
    demos = demonstrations(ScriptedExpert(likes, None), problems(12))
    signs = [1] * len(likes)
    signs[9] = -1
    found = certify(demos, CertifiedPrior(signs=tuple(signs)))
    assert found.realisable
    assert found.weights[9] < 0
    assert (np.delete(found.weights, 9) >= 0).all()
    assert not certify(demos).realisable


def test_same_seed_gives_the_same_bytes(demos):
    first, second = certify(demos, seed=4), certify(demos, seed=4)
    assert first.weights.tobytes() == second.weights.tobytes()
    assert first.samples.tobytes() == second.samples.tobytes()


def test_posterior_is_calibrated():
    """Truths drawn from the prior itself: a predicted order with probability p is right in a share p of the cases."""
    rng, tools = np.random.default_rng(11), problems(6)
    frame, chance, right = Frame.of(tools), [], []
    for _ in range(25):
        u = rng.normal(size=frame.size)
        u = np.where(frame.signed > 0, np.abs(u), u)  # even over the directions of the orthant
        truth = frame.lift @ u
        seen = demonstrations(ScriptedExpert(truth, None), tools[:1])
        pool = pool_for(seen, CertifiedPrior(), tools[1:])
        left = explore(pool, range(1), CertifiedPrior(), rng)
        for tool in tools[1:]:
            orders = cheapest_orders(tool, np.vstack([left.centre, left.samples]) @ pool.frame.lift.T)
            sums = pool.frame.reduce(sums_of(tool, orders))
            chance.append(float((np.abs(sums[1:] - sums[0]).max(axis=1) < 1e-7).mean()))
            best = frame.reduce(tool.feature_sum(EXPERT.sequence(tool))) * 0 + frame.reduce(
                sums_of(tool, cheapest_orders(tool, truth[None]))[0]
            )
            right.append(float(np.abs(best - sums[0]).max() < 1e-7))
    assert abs(np.mean(chance) - np.mean(right)) < 0.12
    sure = np.array(chance) > np.median(chance)
    assert np.mean(np.array(right)[sure]) > np.mean(np.array(right)[~sure])


def test_nothing_to_learn_from_is_said():
    with pytest.raises(EmptySample, match="record at least one"):
        certify([])
    other = problem_for(grid_graph(2, 3, 1), (Interaction("height", "curvature"),))
    one = demonstrations(EXPERT, problems(1))
    with pytest.raises(InvalidInput, match="same features"):
        certify([*one, LearningDemonstration(other, tuple(range(6)))])
