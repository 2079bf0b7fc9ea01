"""Algorithm 2: learn the effort penalty from preferences between equivalent sequences (Eq. 8), in resumable steps.

All sequences in Omega have the demonstration's feature sum, so performance can't tell them apart; where they start and end
can. Each answer is one row of a small quadratic program. A question is asked only while the answers so far leave both
replies possible, so few are needed.

Paper:
    Preferences are compared within a tool (Eq. 4). Printed, Algorithm 2 pools preferred and unpreferred sequences of all tools in one
        threshold, which is stricter than any expert means.
    Without an unpreferred sequence eta is 0.
    Contradicting answers get slack (soft margin), and a smallest set of answers that exclude each other is named.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.optimize import linprog

from app.errors import EmptySample
from app.learning.effort_choice import candidates
from app.learning.effort_features import ALL_COLUMNS, EFFORT_COLUMNS, all_effort_features, effort_features, effort_penalty
from app.learning.performance_state import LearningDemonstration
from app.learning.qp import Array, QuadraticProgram, solve
from app.learning.questions import PreferenceQuestion, Sequence, differing_regions, fingerprint
from app.sequencing.classes import equivalent_sequences
from app.sequencing.problem import SequencingProblem

__all__ = ["EFFORT_WORDS", "EffortParameters", "EffortState", "EffortStepResult", "effort_penalty", "effort_step", "start_effort"]

SAME = 1e-9  # places this close are the same
MOST_CHOICES = 24  # sequences per tool that are compared
NOISE = 1e-4  # weights this small against the largest are what the solver leaves of zero

Demonstrations = list[LearningDemonstration]
Answers = Mapping[str, str]  # fingerprint -> "left" | "right" | "equal" | "cant_tell"


@dataclass(frozen=True)
class EffortParameters:
    """Hyperparameters of Eq. 8."""

    margin: float = 0.1  # epsilon: how much less effort the preferred sequence has
    regularisation: float = 0.05  # lambda
    batch: int = 1  # questions asked at a time
    most: int = 12  # questions asked at all
    cap: int = 256  # equivalent sequences looked at per tool
    pooled: bool = False  # as printed: one threshold for all tools, instead of comparing within a tool
    travel: bool = False  # z holds the mean way between regions too
    side_changes: bool = False  # and how often the side changes

    @property
    def width(self) -> int:
        """Columns of z."""
        return len(ALL_COLUMNS) if self.travel or self.side_changes else len(EFFORT_COLUMNS)

    def features(self, problem: SequencingProblem, sequence: Sequence) -> Array:
        """z of a sequence, (width,); what is switched off is 0."""
        if self.width == len(EFFORT_COLUMNS):
            return effort_features(problem, sequence)
        counts = np.r_[np.ones(len(EFFORT_COLUMNS)), float(self.travel), float(self.side_changes)]
        return all_effort_features(problem, sequence) * counts


EFFORT_WORDS: dict[str, tuple[str, str]] = {
    "margin": ("ε", "Margin between preferred and not"),
    "regularisation": ("λ", "Keep weights small"),
    "batch": ("B", "Questions asked at a time"),
    "most": ("Q", "Questions asked at most"),
    "cap": ("|Ω|", "Equivalent orders looked at per tool"),
    "travel": ("z_9", "Long ways between regions are an effort too"),
    "side_changes": ("z_10", "Changes between left and right are an effort too"),
}


@dataclass(frozen=True)
class EffortState:
    """An effort run between two steps."""

    seed: int
    weights: tuple[float, ...]  # performance weights the run builds on, (n + m,)
    choices: tuple[tuple[Sequence, ...], ...]  # per demonstration: equivalent sequences, one per distinct z, the demonstrated one first
    complete: bool  # whatever equivalent sequences of every tool can be to the effort was looked at
    asked: tuple[PreferenceQuestion, ...] = ()

    def to_json(self) -> dict[str, Any]:
        """Plain JSON values; floats survive bit for bit."""
        return {
            "seed": self.seed,
            "weights": list(self.weights),
            "choices": [[list(s) for s in own] for own in self.choices],
            "complete": self.complete,
            "asked": [{k: list(v) if isinstance(v, tuple) else v for k, v in vars(q).items()} for q in self.asked],
        }

    @staticmethod
    def from_json(value: dict[str, Any]) -> "EffortState":
        asked = tuple(_question_from(q) for q in value["asked"])
        choices = tuple(tuple(tuple(s) for s in own) for own in value["choices"])
        return EffortState(value["seed"], tuple(value["weights"]), choices, value["complete"], asked)


def _question_from(value: dict[str, Any]) -> PreferenceQuestion:
    fields: dict[str, Any] = {k: tuple(v) if isinstance(v, list) else v for k, v in value.items()}
    return PreferenceQuestion(**fields)


@dataclass(frozen=True)
class EffortStepResult:
    """What an effort step hands back."""

    state: EffortState
    outcome: str  # "questions" | "converged" | "infeasible"
    questions: tuple[PreferenceQuestion, ...]  # those without an answer
    effort_weights: Array  # (8,) or (10,) >= 0; of contradicting answers the soft-margin compromise
    message: str
    conflicts: tuple[str, ...] = ()  # fingerprints of a smallest set of answers that exclude each other


def start_effort(demonstrations: Demonstrations, weights: Array, parameters: EffortParameters, seed: int) -> EffortState:
    """Find the equivalent sequences of each demonstration (Omega, Eq. 3) that start or end elsewhere."""
    if not demonstrations:
        raise EmptySample("There is nothing to learn from: record at least one demonstration.")
    choices, complete = [], True
    for d in demonstrations:
        omega = equivalent_sequences(d.problem, d.sequence, parameters.cap)
        complete = complete and (omega.complete or (omega.every_end and parameters.width == len(EFFORT_COLUMNS)))
        own: list[Sequence] = [tuple(d.sequence)]
        places = [parameters.features(d.problem, d.sequence)]
        for candidate in omega.sequences:
            z = parameters.features(d.problem, candidate)
            if (np.abs(np.array(places) - z).max(axis=1) > SAME).all():
                own.append(candidate)
                places.append(z)
        choices.append(tuple(own[k] for k in _spread(np.array(places))))
    return EffortState(seed, tuple(float(x) for x in weights), tuple(choices), complete)


def _spread(places: Array) -> list[int]:
    """The first of the rows, then those farthest from all before, at most `MOST_CHOICES`."""
    if len(places) <= MOST_CHOICES:
        return list(range(len(places)))
    kept, away = [0], np.linalg.norm(places - places[0], axis=1)
    while len(kept) < MOST_CHOICES:
        kept.append(int(away.argmax()))
        away = np.minimum(away, np.linalg.norm(places - places[kept[-1]], axis=1))
    return sorted(kept)


def effort_step(demonstrations: Demonstrations, parameters: EffortParameters, state: EffortState, answers: Answers) -> EffortStepResult:
    """Fit the answers so far and ask what they leave open; pure and deterministic.

    Args:
        demonstrations: The ones the run was started with, in the same order.
        parameters: Hyperparameters.
        state: As the last step returned it.
        answers: All answers of the run so far by fingerprint.

    Returns:
        New state, questions or effort weights, and the answers that contradict each other.
    """
    known = [_Answered.of(demonstrations, parameters, q, answers[q.fingerprint]) for q in state.asked if q.fingerprint in answers]
    weights = _fit_answers(known, parameters)
    unanswered = tuple(q for q in state.asked if q.fingerprint not in answers)
    if unanswered:
        return EffortStepResult(state, "questions", unanswered, weights, f"Waiting for {_count(len(unanswered), 'answer')}.")
    conflicts = _smallest_conflict(known)
    if conflicts:
        text = f"{_count(len(conflicts), 'answer')} exclude each other; the weights are a compromise. Change one of them to go on."
        return EffortStepResult(state, "infeasible", (), weights, text, conflicts)
    fresh = _next_questions(demonstrations, parameters, state, known)
    if fresh:
        state = replace(state, asked=state.asked + fresh)
        return EffortStepResult(state, "questions", fresh, weights, f"{_count(len(fresh), 'question')} about equally good orders.")
    return EffortStepResult(state, "converged", (), weights, _closing(state, known))


@dataclass(frozen=True)
class _Answered:
    """One answer as a row: z of the right sequence minus z of the left one."""

    fingerprint: str
    difference: Array  # (width,)
    value: str
    left: Array  # (width,) z of the left sequence

    @staticmethod
    def of(demonstrations: Demonstrations, parameters: EffortParameters, question: PreferenceQuestion, value: str) -> "_Answered":
        problem = demonstrations[question.demonstration].problem
        left, right = parameters.features(problem, question.left), parameters.features(problem, question.right)
        return _Answered(question.fingerprint, right - left, value, left)

    @property
    def towards(self) -> Array | None:
        """Direction d with w_z . d >= margin, if the answer prefers a side."""
        return {"left": self.difference, "right": -self.difference}.get(self.value)


def _fit(known: list[_Answered], parameters: EffortParameters) -> Array:
    """Soft-margin weights (Eq. 8): min lambda/2 |w|^2 + sum slack, w >= 0."""
    wide = parameters.width
    strict = [a.towards for a in known if a.towards is not None]
    if not strict:
        return np.zeros(wide)
    level = [sign * a.difference for a in known if a.value == "equal" for sign in (1.0, -1.0)]
    m = len(strict) + len(level)
    rows = np.zeros((2 * m + wide, wide + m))
    rows[:m, :wide] = np.array([-d for d in strict] + level)
    rows[:m, wide:] = -np.eye(m)
    rows[m : 2 * m, wide:] = -np.eye(m)
    rows[2 * m :, :wide] = -np.eye(wide)
    limits = np.r_[np.full(len(strict), -parameters.margin), np.full(len(level), parameters.margin / 2), np.zeros(m + wide)]
    curvature = np.r_[np.full(wide, parameters.regularisation), np.zeros(m)]
    program = QuadraticProgram(curvature, np.r_[np.zeros(wide), np.ones(m)], rows, limits)
    return _clean(solve(program)[:wide])


def _clean(weights: Array) -> Array:
    weights = np.maximum(weights, 0.0)
    return np.where(weights < NOISE * weights.max(initial=0.0), 0.0, weights)


def fit_pooled(preferred: Array, others: Array, parameters: EffortParameters) -> Array:
    """Eq. 8 as printed: every preferred sequence (p, width) of any tool at most t, every other one (q, width) at least t + margin.

    min lambda/2 |w|^2 + sum slack over the others, w >= 0, t free.

    Paper: this compares sequences of different tools, which no expert was asked to do; `EffortParameters.pooled` turns it on.
    """
    if not len(others):
        return np.zeros(others.shape[1])
    wide, p, q = others.shape[1], len(preferred), len(others)
    rows = np.zeros((p + 2 * q + wide, wide + 1 + q))
    rows[:p, :wide], rows[:p, wide] = preferred, -1.0
    rows[p : p + q, :wide], rows[p : p + q, wide], rows[p : p + q, wide + 1 :] = -others, 1.0, -np.eye(q)
    rows[p + q : p + 2 * q, wide + 1 :] = -np.eye(q)
    rows[p + 2 * q :, :wide] = -np.eye(wide)
    limits = np.r_[np.zeros(p), np.full(q, -parameters.margin), np.zeros(q + wide)]
    curvature = np.r_[np.full(wide, parameters.regularisation), np.zeros(1 + q)]
    return _clean(solve(QuadraticProgram(curvature, np.r_[np.zeros(wide + 1), np.ones(q)], rows, limits))[:wide])


def _fit_answers(known: list[_Answered], parameters: EffortParameters) -> Array:
    """Weights from the answers, compared within a tool or pooled."""
    if not parameters.pooled:
        return _fit(known, parameters)
    sides = [
        (a.left, a.left + a.difference) if a.value == "left" else (a.left + a.difference, a.left) for a in known if a.towards is not None
    ]
    wide = parameters.width
    better, worse = (np.array([pair[k] for pair in sides]).reshape(-1, wide) for k in (0, 1))
    return fit_pooled(better, worse, parameters)


def _possible(known: list[_Answered]) -> bool:
    """Whether some w_z >= 0 agrees with all answers: preferred strictly less effort, 'equal' exactly equal."""
    strict = [a.towards for a in known if a.towards is not None]
    if not strict:
        return True
    level = [a.difference for a in known if a.value == "equal"]
    wide = len(strict[0])
    result = linprog(
        np.zeros(wide),
        A_ub=-np.array(strict),
        b_ub=-np.ones(len(strict)),
        A_eq=np.array(level) if level else None,
        b_eq=np.zeros(len(level)) if level else None,
        bounds=(0, None),
        method="highs",
    )
    return bool(result.status == 0)


def _smallest_conflict(known: list[_Answered]) -> tuple[str, ...]:
    """A set of answers that can't all hold, none of which can be left out (deletion filter); empty if all agree."""
    if _possible(known):
        return ()
    kept = list(known)
    for answer in known:
        rest = [a for a in kept if a is not answer]
        if not _possible(rest):
            kept = rest
    return tuple(a.fingerprint for a in kept)


def _next_questions(
    demonstrations: Demonstrations, parameters: EffortParameters, state: EffortState, known: list[_Answered]
) -> tuple[PreferenceQuestion, ...]:
    """The pairs of equivalent sequences the answers so far leave most open, at most one per direction."""
    room = min(parameters.batch, parameters.most - len(state.asked))
    places = [np.array([parameters.features(d.problem, s) for s in own]) for d, own in zip(demonstrations, state.choices, strict=True)]
    strict = [a.towards for a in known if a.towards is not None]
    level = [a.difference for a in known if a.value == "equal"]
    found = candidates(places, strict, level, [a.difference for a in known], state.seed + len(state.asked))
    return tuple(_question(c.tool, state.choices[c.tool][c.left], state.choices[c.tool][c.right]) for c in found[: max(room, 0)])


def _question(i: int, left: Sequence, right: Sequence) -> PreferenceQuestion:
    where = [text for text, a, b in (("starts", left[0], right[0]), ("ends", left[-1], right[-1])) if a != b]
    other = f"{' and '.join(where)} elsewhere" if where else "goes another way between the same start and end"
    why = f"Both orders are equally good; the other one {other}."
    return PreferenceQuestion(i, left, right, why, differing_regions(left, right), fingerprint("preference", i, left, right))


def _closing(state: EffortState, known: list[_Answered]) -> str:
    if all(len(own) == 1 for own in state.choices):
        return "No recorded order has an equally good one that differs in what counts as effort: there is no effort to learn."
    if not any(a.value in ("left", "right") for a in known):
        return "No order was preferred to another, so effort does not count."
    note = "" if state.complete else " Some tools have more equally good orders than were looked at."
    return f"The order of least effort follows from {_count(len(known), 'answer')}.{note}"


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"
