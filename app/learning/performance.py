"""Algorithm 1 as printed: learn performance weights from demonstrations and similarity answers, in resumable steps.

A round is T subgradient steps on Eq. 7. If then every demonstration costs no more than the cheapest sequence of its tool
(within the tolerance) the run has converged; otherwise the K lowest cost classes of each violated tool become similarity
questions. "Not similar" puts the candidate into the tool's sample X, and the next round begins.

Paper:
    Candidates are one sequence per distinct cost class; printed, the K shortest *sequences* are mostly the same class over and over.
        A candidate with the demonstration's feature sum is never asked (no weights could tell them apart), nor is any twice.
    Weights are projected onto w >= floor after each step, as in the authors' code (w >= 0.1); without a floor "everything ties" is optimal.
    The rate falls as eta / (1 + 2 lambda eta t), the usual schedule for a loss with curvature 2 lambda.
    On the synthetic training tools two weights must be equal to the last bit. Subgradient steps come within 1e-3 of that and no closer,
        so after the stop test passes (or the rounds run out) the same loss, with gamma a hundred times larger, is minimised exactly
        over the cheapest sequences met (`finish`). Its weights are the last metric of the run.
    Whether any weights explain all demonstrations depends on no answer, so it is found out by the same exact minimisation after the
        first round; printed, the loop would ask on for ever. If none do, the compromise explains as many demonstrations as can be,
        and one last round asks whether what it prefers to the odd one is just as good: if so the run stalls, else it is infeasible.
    A round asks at most `most` questions, those of the largest gain first and the tools in turn, and none that reads like an earlier
        one of its tool (`appearance`); printed, it is K for each violated tool.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from app.errors import EmptySample, InvalidInput
from app.learning.loss import minimise_loss, performance_gradient, performance_loss
from app.learning.performance_conflict import Contradiction, Members, contradiction_words, find_contradiction
from app.learning.performance_state import (
    PARAMETER_WORDS,
    LearningDemonstration,
    Metric,
    PerformanceParameters,
    PerformanceState,
    StepResult,
)
from app.learning.qp import Array
from app.learning.questions import SimilarityQuestion, appearance, differing_regions, fingerprint
from app.learning.sampling import POOL, diverse_sample, feature_scale, feature_sums, random_pool
from app.sequencing.classes import best_classes
from app.sequencing.problem import check_sequence
from app.sequencing.shortest import shortest_sequence

__all__ = [
    "PARAMETER_WORDS",
    "LearningDemonstration",
    "Metric",
    "PerformanceParameters",
    "PerformanceState",
    "SimilarityQuestion",
    "StepResult",
    "performance_step",
    "start_performance",
]

SAME = 1e-9  # feature sums this close in scaled units are the same
EXACT = 1e-10  # relative cost difference below which the demonstration itself counts as cheapest
HARDER = 100.0  # factor on gamma in the exact minimisation, where no step can overshoot
TIED = 1e-7  # relative cost difference that counts as none when reporting
CUT_ROUNDS = 60  # exact minimisation: rows are added at most this often

Demonstrations = list[LearningDemonstration]
Answers = Mapping[str, str]  # fingerprint -> "similar" | "not_similar" | "cant_tell"


def start_performance(demonstrations: Demonstrations, parameters: PerformanceParameters, seed: int) -> PerformanceState:
    """Sample X for each demonstration, measure the scale and draw the first weights.

    Raises:
        EmptySample: No demonstration, or the tools' feature sets differ.
        IncompleteSequence: A demonstration misses or repeats regions.
    """
    if not demonstrations:
        raise EmptySample("There is nothing to learn from: record at least one demonstration.")
    if len({d.problem.columns for d in demonstrations}) > 1:
        raise InvalidInput("The tools of one run need the same features and interactions; keep tools of another kind in their own project.")
    for d in demonstrations:
        check_sequence(d.sequence, d.problem.n)
    generator = np.random.default_rng(seed)
    pools = [random_pool(d.problem, POOL, generator) for d in demonstrations]
    sums = [feature_sums(d.problem, pool) for d, pool in zip(demonstrations, pools, strict=True)]
    scale, live = feature_scale(sums)
    samples = []
    for d, pool, block in zip(demonstrations, pools, sums, strict=True):
        phi = d.problem.feature_sum(d.sequence) / scale
        unlike = np.abs(block / scale - phi).max(axis=1) > SAME
        keep = np.flatnonzero(unlike)
        chosen = diverse_sample(phi, block[keep] / scale, parameters.samples, parameters.zeta) if len(keep) else []
        samples.append(tuple(pool[keep[k]] for k in chosen))
    if not any(samples):
        raise EmptySample(
            "All orders of these tools have the same features, so none can be preferred. Demonstrate a tool with more regions."
        )
    first = np.where(live, generator.uniform(parameters.floor, 1.0, len(scale)), 0.0)
    return PerformanceState(
        seed=seed,
        demonstrations=_identity(demonstrations),
        scale=tuple(float(x) for x in scale),
        identifiable=live,
        weights=tuple(float(x) for x in first),
        samples=tuple(samples),
        generator=dict(generator.bit_generator.state),
    )


def performance_step(
    demonstrations: Demonstrations, parameters: PerformanceParameters, state: PerformanceState, answers: Answers, iterations: int
) -> StepResult:
    """At most `iterations` gradient steps, or less when the round ends; pure and deterministic.

    Args:
        demonstrations: The ones the run was started with, in the same order.
        parameters: Hyperparameters.
        state: As the last step returned it.
        answers: All answers of the run so far by fingerprint; leaving one out re-opens its question.
        iterations: Upper limit, at least 1. Any split into chunks gives the same weights bit for bit.

    Returns:
        New state, and what to do next: call again ("training"), ask ("questions"), or stop.
    """
    if state.demonstrations != _identity(demonstrations):
        raise InvalidInput("The demonstrations are not the ones this run was started with; start a new run.")
    unanswered = tuple(q for q in state.asked if q.fingerprint not in answers)
    if unanswered:
        waiting = replace(state, phase="questions")
        return _result(waiting, (), "questions", f"Waiting for {_count(len(unanswered), 'answer')}.", unanswered)
    if state.phase in ("converged", "infeasible"):
        return _result(state, (), state.phase, "This run is finished.")
    if state.phase == "questions":
        recent = state.asked[len(state.asked) - state.latest :]
        similar = bool(recent) and all(answers[q.fingerprint] == "similar" for q in recent)
        if state.contradiction and not similar:
            return _infeasible(state, state.contradiction, ())
        if similar:
            return _stalled(_Work.of(demonstrations, parameters, state, answers), state)
        state = replace(state, phase="training", step=0, round=state.round + 1, latest=0)
    work = _Work.of(demonstrations, parameters, state, answers)
    metrics: list[Metric] = []
    w = state.w
    while state.step < parameters.iterations and len(metrics) < iterations:
        w, metric = work.descend(w, state.iteration)
        metrics.append(metric)
        state = replace(state, iteration=state.iteration + 1, step=state.step + 1)
    state = state.with_weights(w)
    if state.step < parameters.iterations:
        return _result(state, tuple(metrics), "training", f"Round {state.round}, step {state.step} of {parameters.iterations}.")
    return _close_round(work, state, tuple(metrics))


def _close_round(work: "_Work", state: PerformanceState, metrics: tuple[Metric, ...]) -> StepResult:
    """The stop test of Algorithm 1 and, if it fails, the questions of the next round."""
    parameters = work.parameters
    if work.violated(state.w):
        found = work.contradiction(state.w) if state.round == 1 else None
        if found:
            return _contradicted(work, state, found, metrics)
        questions = work.questions(state) if state.round < parameters.rounds else ()
        if questions:
            return _ask(state, questions, metrics, f"{_count(len(questions), 'question')} after round {state.round}.")
        if state.round < parameters.rounds:
            state = replace(state, step=0, round=state.round + 1)
            return _result(state, metrics, "training", f"Round {state.round} begins; no new order to ask about.")
    state, last = _finished(work, state, work.finish(state.w))
    if not work.violated(state.w):
        return _converged(work, state, (*metrics, last))
    found = work.contradiction(state.w) or Contradiction(tuple(i for i, _ in work.violated(state.w)), clear=False, alone=False, rest=True)
    return _infeasible(state, found, (*metrics, last))


def _contradicted(work: "_Work", state: PerformanceState, found: Contradiction, metrics: tuple[Metric, ...]) -> StepResult:
    """Settle on the compromise, and ask once whether the orders it prefers are just as good."""
    everyone = range(len(work.demonstrations))
    followed = tuple(i for i in everyone if i not in found.odd) if found.clear and found.rest else tuple(everyone)
    state, last = _finished(work, state, work.only(followed).finish(state.w))
    state = replace(state, contradiction=found)
    metrics = (*metrics, last)
    questions = work.questions(state)
    if not questions:
        return _infeasible(state, found, metrics)
    return _ask(state, questions, metrics, contradiction_words(found, _names(state)))


def _ask(state: PerformanceState, questions: tuple[SimilarityQuestion, ...], metrics: tuple[Metric, ...], message: str) -> StepResult:
    state = replace(state, phase="questions", asked=state.asked + questions, latest=len(questions))
    return _result(state, metrics, "questions", message, questions)


def _finished(work: "_Work", state: PerformanceState, w: Array) -> tuple[PerformanceState, Metric]:
    """The state with its last weights, and the metric that describes them."""
    state = replace(state.with_weights(w), iteration=state.iteration + 1)
    return state, work.metric(w, work.cheapest(w), state.iteration)


def _infeasible(state: PerformanceState, found: Contradiction, metrics: tuple[Metric, ...]) -> StepResult:
    state = replace(state, phase="infeasible", contradiction=found)
    return _result(state, metrics, "infeasible", contradiction_words(found, _names(state)))


def _stalled(work: "_Work", state: PerformanceState) -> StepResult:
    """Every order shown was called similar, so no sample grows; the exact minimiser may still explain all demonstrations."""
    text = "Every order shown was just as good as the recorded one: nothing is left to learn from."
    if state.contradiction:
        return _result(state, (), "stalled", text)
    finished, last = _finished(work, state, work.finish(state.w))
    if not work.violated(finished.w):
        return _converged(work, finished, (last,))
    return _result(finished, (last,), "stalled", text)


def _converged(work: "_Work", state: PerformanceState, metrics: tuple[Metric, ...]) -> StepResult:
    exact = work.gaps(state.w, work.cheapest(state.w)).max() <= TIED
    close = "the best one" if exact else f"within {work.parameters.tolerance:.2%} of the best one"
    text = f"Every recorded order is {close} on its tool, after {_count(state.iteration, 'step')}."
    return _result(replace(state, phase="converged"), metrics, "converged", text)


@dataclass(frozen=True)
class _Work:
    """Everything a step needs in arrays, on scaled features."""

    demonstrations: Demonstrations
    parameters: PerformanceParameters
    scale: Array
    floor: Array  # (n + m,)
    identifiable: NDArray[np.bool_]  # (n + m,)
    demo: Array  # (d, n + m)
    samples: list[Array]  # per demonstration (p_i, n + m)
    taken: list[list[Array]]  # per demonstration, feature sums that were already asked about

    @staticmethod
    def of(demonstrations: Demonstrations, parameters: PerformanceParameters, state: PerformanceState, answers: Answers) -> "_Work":
        scale = np.array(state.scale)
        demo = np.array([d.problem.feature_sum(d.sequence) for d in demonstrations]) / scale
        samples: list[Array] = []
        taken: list[list[Array]] = []
        for i, d in enumerate(demonstrations):
            own = [q for q in state.asked if q.demonstration == i]
            grown = tuple(q.candidate for q in own if answers[q.fingerprint] == "not_similar")
            block = feature_sums(d.problem, state.samples[i] + grown) / scale
            samples.append(block if len(block) else demo[i : i + 1])  # a tool whose orders all tie pulls nowhere
            taken.append([d.problem.feature_sum(q.candidate) / scale for q in own])
        live = np.array(state.identifiable)
        return _Work(demonstrations, parameters, scale, np.where(live, parameters.floor, 0.0), live, demo, samples, taken)

    def cheapest(self, w: Array) -> Array:
        """Feature sums of the cheapest sequences under w, (d, n + m); the demonstration's own where it is one of them."""
        best = self.demo.copy()
        for i, d in enumerate(self.demonstrations):
            phi = d.problem.feature_sum(shortest_sequence(d.problem, w / self.scale).sequence) / self.scale
            if phi @ w < self.demo[i] @ w - EXACT * self.size(w, i):
                best[i] = phi
        return best

    def size(self, w: Array, i: int) -> float:
        """What 'relative' refers to for a cost of demonstration i."""
        return max(float(w @ np.abs(self.demo[i])), 1e-12)

    def gaps(self, w: Array, best: Array) -> Array:
        """(d,) relative excess of each demonstration's cost over the cheapest."""
        return np.array([(self.demo[i] - best[i]) @ w / self.size(w, i) for i in range(len(self.demo))])

    def violated(self, w: Array) -> list[tuple[int, float]]:
        """Demonstrations that are not the cheapest within the tolerance, with their relative excess."""
        return [(i, float(g)) for i, g in enumerate(self.gaps(w, self.cheapest(w))) if g > self.parameters.tolerance]

    def descend(self, w: Array, iteration: int) -> tuple[Array, Metric]:
        """One projected subgradient step; the metric describes w before it."""
        p = self.parameters
        best = self.cheapest(w)
        gradient = performance_gradient(w, self.demo, self.samples, best, p.terms)
        rate = p.learning_rate / (1 + 2 * p.regularisation * p.learning_rate * iteration)
        return np.maximum(w - rate * gradient, self.floor), self.metric(w, best, iteration + 1)

    def metric(self, w: Array, best: Array, iteration: int) -> Metric:
        """Loss and violations of w, as they are plotted."""
        value = performance_loss(w, self.demo, self.samples, best, self.parameters.terms)
        return Metric.of(iteration, value, int((self.gaps(w, best) > self.parameters.tolerance).sum()))

    def only(self, members: Members) -> "_Work":
        """The same with some of the demonstrations."""
        return replace(
            self,
            demonstrations=[self.demonstrations[i] for i in members],
            demo=self.demo[list(members)],
            samples=[self.samples[i] for i in members],
            taken=[self.taken[i] for i in members],
        )

    def contradiction(self, w: Array) -> Contradiction | None:
        """Whether no weights explain all demonstrations, by exact minimisation from w; and which stand against each other."""

        def fits(members: Members) -> float:
            part = self.only(members)
            return sum(gap for _, gap in part.violated(part.finish(w)))

        return find_contradiction(len(self.demonstrations), fits)

    def finish(self, w: Array) -> Array:
        """Minimise Eq. 7 exactly: solve over the rows met so far, add each tool's new cheapest sequence, repeat."""
        cuts: list[list[Array]] = [[] for _ in self.demo]
        terms = replace(self.parameters.terms, gamma=HARDER * self.parameters.gamma)
        for attempt in range(CUT_ROUNDS):
            new = False
            for i, phi in enumerate(self.cheapest(w)):
                if all(np.abs(phi - known).max() > SAME for known in [self.demo[i], *cuts[i]]):
                    cuts[i].append(phi)
                    new = True
            if attempt and not new:
                break
            w = minimise_loss(self.demo, self.samples, cuts, terms, self.floor)
            w = np.where(self.identifiable, w, 0.0)
        return w

    def questions(self, state: PerformanceState) -> tuple[SimilarityQuestion, ...]:
        """The candidates of largest gain, the violated tools in turn; never the same feature sum or the same look twice."""
        offers: list[tuple[int, float, SimilarityQuestion]] = []
        for i, _ in self.violated(state.w):
            own = sorted(self.offers(state, i), key=lambda offer: -offer[0])
            offers += [(turn, -better, question) for turn, (better, question) in enumerate(own)]
        offers.sort(key=lambda offer: (offer[0], offer[1], offer[2].fingerprint))
        return tuple(question for _, _, question in offers[: self.parameters.most])

    def offers(self, state: PerformanceState, i: int) -> list[tuple[float, SimilarityQuestion]]:
        """One candidate per cost class below demonstration i, at most K, with the relative gain."""
        d, w = self.demonstrations[i], state.w
        known = [self.demo[i], *self.taken[i]]
        looks = {appearance(d.sequence, q.candidate) for q in state.asked if q.demonstration == i}
        found: list[tuple[float, SimilarityQuestion]] = []
        for candidate in best_classes(d.problem, w / self.scale, self.parameters.classes):
            phi = d.problem.feature_sum(candidate.sequence) / self.scale
            better = float((self.demo[i] - phi) @ w / self.size(w, i))
            look = appearance(d.sequence, candidate.sequence)
            if better < -self.parameters.tolerance or look in looks or any(np.abs(phi - k).max() < SAME for k in known):
                continue
            known.append(phi)
            looks.add(look)
            found.append((better, _question(i, d, candidate.sequence, better)))
        return found


def _question(i: int, demonstration: LearningDemonstration, candidate: tuple[int, ...], better: float) -> SimilarityQuestion:
    why = f"By what is learned so far, the other order comes out {better:.1%} better than the recorded one."
    if better < 5e-4:
        why = "By what is learned so far, both orders come out the same."
    return SimilarityQuestion(
        demonstration=i,
        candidate=candidate,
        why=why,
        differs=differing_regions(demonstration.sequence, candidate),
        fingerprint=fingerprint("similarity", i, demonstration.sequence, candidate),
    )


def _result(
    state: PerformanceState, metrics: tuple[Metric, ...], outcome: str, message: str, questions: tuple[SimilarityQuestion, ...] = ()
) -> StepResult:
    return StepResult(state, metrics, outcome, questions, state.policy_weights, message)


def _names(state: PerformanceState) -> list[str]:
    return [f"demonstration {i + 1}" for i in range(len(state.samples))]


def _identity(demonstrations: Demonstrations) -> str:
    return fingerprint("run", len(demonstrations), *_flat(demonstrations))


def _flat(demonstrations: Demonstrations) -> tuple[tuple[int, ...], tuple[int, ...]]:
    return tuple(d.problem.n for d in demonstrations), tuple(a for d in demonstrations for a in d.sequence)


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"
