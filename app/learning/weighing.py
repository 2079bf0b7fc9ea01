"""Answers that contradict each other, weighed: which weights explain the demonstrations and agree best with the answers together?

The demonstrations stay exact: only weights under which each is a cheapest sequence are looked at. Among them an answer makes
those likelier that agree with it (Bradley-Terry, `noisy_answers`), by how reliable the expert's answers have been. So one slip is
outvoted by what else was said, whichever of the answers came first. Choosing an order then only says that it is better than the
other one, no longer that it is the best.
"""

from collections.abc import Mapping
from collections.abc import Sequence as Ordered
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.learning.certified import Explored
from app.learning.cuts import CutPool, unit_rows
from app.learning.noisy_answers import Comparison, log_likelihood, reliability
from app.learning.pairs import REPEAT, PairQuestion
from app.learning.qp import Array
from app.learning.questions import Sequence
from app.learning.version_space import sample
from app.sequencing.problem import SequencingProblem

USUAL = 0.9  # reliability of an answer before any question was asked twice
LEAST = 0.65  # reliability below which an expert isn't rated: few repeats would else silence all answers
DRAWN = 1500  # weights that explain the demonstrations, from which those that agree with the answers are drawn
ROUNDS = 12  # of cuts found on the way
ILL = 0.5  # an answer that the weighed weights would give with less than this probability sits ill with the others


TELLING = ("left", "right", "equal")  # answers that say something about weights


@dataclass(frozen=True)
class Repeats:
    """Questions that were answered twice."""

    pairs: tuple[tuple[str, str], ...]  # first and second answer, as if the sides had been the same
    changed: tuple[str, ...]  # fingerprints of those answered differently, as first asked

    @property
    def alike(self) -> int:
        """How many have the same answer."""
        return sum(a == b for a, b in self.pairs)

    @property
    def reliability(self) -> float | None:
        """Probability that one answer is what the expert means; None where nothing was answered twice."""
        return reliability(self.pairs)


def repeats_of(asked: Ordered[PairQuestion], answers: Mapping[str, str]) -> Repeats:
    """The questions of a run that were answered twice; "can't tell" is no answer."""
    known = {q.fingerprint: q for q in asked}
    found = []
    for q in asked:
        first = known.get(q.fingerprint.removeprefix(REPEAT))
        values = answers.get(q.fingerprint), None if first is None else answers.get(first.fingerprint)
        if first is None or not q.repeat or None in values or "cant_tell" in values:
            continue
        second, before = str(values[0]), str(values[1])
        same_sides = q.left == first.left
        found.append((first.fingerprint, before, second if same_sides else EXCHANGED.get(second, second)))
    return Repeats(tuple((a, b) for _, a, b in found), tuple(name for name, a, b in found if a != b))


EXCHANGED = {"left": "right", "right": "left"}


@dataclass(frozen=True)
class Given:
    """An answer to a pair."""

    tool: SequencingProblem
    left: Sequence
    right: Sequence
    value: str  # "left" | "right" | "equal"


@dataclass(frozen=True)
class Weighed:
    """What the demonstrations and the weighed answers leave."""

    explored: Explored
    agreement: tuple[float, ...]  # per answer: probability that the weighed weights would give it


def weigh(pool: CutPool, known: Explored, answers: Ordered[Given], rate: float | None, generator: np.random.Generator) -> Weighed:
    """Weights that explain the demonstrations, drawn by how well they agree with the answers.

    Args:
        pool: Of the demonstrations alone; gets cuts.
        known: Its version space, not empty.
        answers: All of them.
        rate: Probability that an answer is what the expert means, from repeats; None without any.
        generator: The only source of randomness.
    """
    compared = [_comparison(pool, a) for a in answers]
    sharpness = _sharpness(known.samples, compared, rate)
    cone, count, kept = known.cone, len(known.samples), known.samples
    for _ in range(ROUNDS):
        taken = len(pool.cuts)
        drawn = sample(cone, DRAWN, generator, thin=len(cone.signed))
        kept = drawn[_resampled(log_likelihood(drawn, compared, (), sharpness), count, generator)]
        fine = pool.separate(kept, list(known.members))
        if fine.all():
            break
        cone = cone.with_rows(unit_rows([c.difference for c in pool.cuts[taken:]], pool.frame.size), drawn)
    agreement = tuple(float(np.exp(log_likelihood(kept, [c], (), sharpness)).mean()) for c in compared)
    return Weighed(Explored(cone, kept, known.members, known.rounds), agreement)


def _comparison(pool: CutPool, answer: Given) -> Comparison:
    left, right = (pool.frame.reduce(answer.tool.feature_sum(s)) for s in (answer.left, answer.right))
    return Comparison(right - left, answer.value)


def _sharpness(samples: Array, compared: list[Comparison], rate: float | None) -> float:
    """How strongly a difference in cost decides an answer, so that a typical one is answered as reliably as the expert answers."""
    p = min(max(USUAL if rate is None else rate, LEAST), 0.99)
    units = unit_rows([c.difference for c in compared], samples.shape[1])
    typical = float(np.median(np.abs(samples @ units.T))) if len(units) else 1.0
    return float(np.log(p / (1 - p))) / max(typical, 1e-3)


def _resampled(logs: Array, count: int, generator: np.random.Generator) -> NDArray[np.intp]:
    """Indices drawn with probability exp(logs), evenly spread (systematic resampling)."""
    share = np.cumsum(np.exp(logs - logs.max()))
    return np.searchsorted(share / share[-1], (np.arange(count) + generator.random()) / count)
