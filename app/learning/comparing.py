"""Every learner on the same demonstrations: the authors' synthetic split, their real tools one left out at a time, and made-up experts.

Paper: the synthetic expert is given the weights stored with the authors' code, under which every recorded order is a cheapest one (under
equal weights, which the project page names, tool 7's is not); regret is measured against them. Of the real tools' expert no weights are
known, so no regret. Made-up experts have weights drawn from an exponential distribution, on the synthetic tools.
"""

from collections.abc import Callable, Iterator
from collections.abc import Sequence as Ordered
from dataclasses import dataclass

import numpy as np

from app.learning.baselines.copying import copy_nearest, draw_weights
from app.learning.baselines.learner import Learned, Learner, Sequence, by_weights
from app.learning.baselines.likelihood import by_bayes, by_maximum_entropy
from app.learning.baselines.margin_planning import plan_by_margin
from app.learning.certified import certify
from app.learning.expert import ScriptedExpert
from app.learning.generalising import learn_generalising, learn_unasked, on_features
from app.learning.hits import HIT_SIZE, judge
from app.learning.performance import start_performance
from app.learning.performance_state import LearningDemonstration, PerformanceParameters
from app.learning.policy import Policy
from app.learning.prediction import predict
from app.learning.qp import Array
from app.learning.scripted import SYNTHETIC_TRUTH, Clock, answer_about, answer_pairs, answer_similarity
from app.sequencing.classes import equivalent_sequences
from app.sequencing.comparison import kendall_tau
from app.sequencing.features import FEATURE_SETS
from app.sequencing.problem import SequencingProblem
from app.sequencing.shortest import shortest_sequence

SAME = 1e-9  # feature sums this close are equal
OWN = 1  # stream of the learners' generators, apart from the one the made-up experts come from


TITLES = {"synthetic": "Authors' synthetic tools, published split", "real": "Authors' real tools, one left out at a time"}


@dataclass(frozen=True)
class Case:
    """One set of demonstrations and what they are tested on."""

    kind: str  # "synthetic" | "real" | "made up"
    train: tuple[LearningDemonstration, ...]
    test: tuple[LearningDemonstration, ...]
    truth: Array | None  # the expert's weights, where known


@dataclass(frozen=True)
class Score:
    """One learner on one case."""

    learner: str
    kind: str
    train_hits: int
    train: int
    test_hits: int
    test: int
    regret: float | None  # mean over test tools: extra true cost of the predicted order, relative
    tau: float  # mean over test tools
    answers: int  # and orders recorded because both that were shown were wrong
    cpu_s: float


@dataclass(frozen=True)
class Line:
    """One learner over all cases of a kind."""

    learner: str
    kind: str
    cases: int
    train_success: float
    test_success: float
    test_hits: int
    test: int
    regret: float | None
    tau: float
    answers: float  # per case
    cpu_s: float  # per case


ASKING = "ours, asking"
LEARNERS = (
    "ours",
    ASKING,
    "ours, always likelihood",
    "ours, always certified",
    "Algorithm 1 (paper)",
    "max-margin planning",
    "maximum entropy",
    "Bayesian (MCMC)",
    "nearest tool",
    "random weights",
)


UNTAUGHT = ("nearest tool", "random weights")  # they fit nothing, which takes no time


def learners(case: Case, seed: int) -> dict[str, Learner]:
    """Name -> learner, as in `LEARNERS`; the case's expert answers where a learner asks."""
    expert = ScriptedExpert(case.truth, None)
    found: tuple[Learner, ...] = (
        lambda demos, _: _with_policy(learn_unasked(demos, seed).policy),
        lambda demos, _: _asking(demos, case, seed),
        lambda demos, _: _with_policy(learn_generalising(demos).policy),
        lambda demos, _: _certified(demos, seed),
        lambda demos, _: _paper(demos, expert, seed),
        plan_by_margin,
        by_maximum_entropy,
        by_bayes,
        copy_nearest,
        draw_weights,
    )
    return dict(zip(LEARNERS, found, strict=True))


def _with_policy(policy: Policy, answers: int = 0, settled: dict[int, tuple[Sequence, ...]] | None = None) -> Learned:
    known = settled or {}

    def order(problem: SequencingProblem) -> Sequence:
        return known[id(problem)][0] if id(problem) in known else predict(_under(problem, policy), policy).sequence

    return Learned(order, policy, answers, known)


def _certified(demonstrations: list[LearningDemonstration], seed: int) -> Learned:
    found = certify(demonstrations, seed=seed)
    return by_weights(demonstrations, found.weights, found.identifiable)


def _asking(demonstrations: list[LearningDemonstration], case: Case, seed: int) -> Learned:
    """The product with its questions: pairs on the unseen tools while weights explain everything, else up to three about each of them."""
    known = learn_unasked(demonstrations, seed)
    tools = [d.problem for d in case.test]
    if known.generalised is None and case.truth is not None:
        taught = answer_pairs(demonstrations, tools, ScriptedExpert(case.truth, None), seed)
        return by_weights(demonstrations, taught.weights, taught.identifiable, taught.answers + taught.shown)
    learned, settled, answers = known.generalised or learn_generalising(demonstrations), dict[int, tuple[Sequence, ...]](), 0
    for d in case.test:
        problem = _under(d.problem, learned.policy)
        order, given = answer_about(learned, problem, equivalent_sequences(problem, d.sequence, HIT_SIZE).sequences, seed)
        answers += given
        if order:
            settled[id(d.problem)] = (order, *equivalent_sequences(problem, order, HIT_SIZE).sequences)
    return _with_policy(learned.policy, answers, settled)


def _paper(demonstrations: list[LearningDemonstration], expert: ScriptedExpert, seed: int) -> Learned:
    parameters = PerformanceParameters()
    result, answers = answer_similarity(demonstrations, expert, parameters, start_performance(demonstrations, parameters, seed))
    return by_weights(demonstrations, result.weights, result.state.identifiable, len(answers))


def synthetic_case(shown: dict[int, LearningDemonstration], trained: tuple[int, ...]) -> Case:
    """The published split."""
    truth = np.array(SYNTHETIC_TRUTH)
    return Case("synthetic", tuple(shown[i] for i in trained), tuple(d for i, d in shown.items() if i not in trained), truth)


def leave_one_out(shown: dict[int, LearningDemonstration]) -> list[Case]:
    """Each tool predicted from all others."""
    return [Case("real", tuple(d for j, d in shown.items() if j != i), (shown[i],), None) for i in shown]


def made_up_cases(problems: dict[int, SequencingProblem], trained: tuple[int, ...], count: int, seed: int) -> Iterator[Case]:
    """Experts of random weights on the same tools and split."""
    return (made_up_case(problems, trained, k, seed) for k in range(count))


def made_up_case(problems: dict[int, SequencingProblem], trained: tuple[int, ...], number: int, seed: int = 0) -> Case:
    """One of them, always the same."""
    truth = np.random.default_rng([seed, 0, number]).exponential(size=len(next(iter(problems.values())).columns))
    shown = {i: LearningDemonstration(p, shortest_sequence(p, truth).sequence) for i, p in problems.items()}
    return Case("made up", tuple(shown[i] for i in trained), tuple(d for i, d in shown.items() if i not in trained), truth)


def score(name: str, learner: Learner, case: Case, seed: int, clock: Clock) -> Score:
    """Learn, predict, compare."""
    started = clock()
    learned = learner(list(case.train), np.random.default_rng([seed, OWN, len(case.train)]))
    spent = clock() - started
    orders = [learned.order(d.problem) for d in case.test]
    return Score(
        learner=name,
        kind=case.kind,
        train_hits=sum(_hit(learned, d, learned.order(d.problem)) for d in case.train),
        train=len(case.train),
        test_hits=sum(_hit(learned, d, order) for d, order in zip(case.test, orders, strict=True)),
        test=len(case.test),
        regret=None if case.truth is None else float(np.mean([_regret(d, o, case.truth) for d, o in zip(case.test, orders, strict=True)])),
        tau=float(np.mean([kendall_tau(o, d.sequence) for d, o in zip(case.test, orders, strict=True)])),
        answers=learned.answers,
        cpu_s=spent,
    )


def _hit(learned: Learned, shown: LearningDemonstration, order: Sequence) -> bool:
    """As in `hits`; without weights the order itself must have the recorded one's features, as must one settled by questions."""
    if id(shown.problem) in learned.settled:
        return shown.sequence in learned.settled[id(shown.problem)]
    if learned.policy is None:
        return bool(np.allclose(shown.problem.feature_sum(order), shown.problem.feature_sum(shown.sequence), rtol=SAME, atol=SAME))
    problem = _under(shown.problem, learned.policy)
    return judge(problem, learned.policy.weights, shown.sequence, order).hit


def _under(problem: SequencingProblem, policy: Policy) -> SequencingProblem:
    return problem if problem.features.name == policy.features else on_features(problem, FEATURE_SETS[policy.features])


def _regret(shown: LearningDemonstration, order: Sequence, truth: Array) -> float:
    best = shortest_sequence(shown.problem, truth).cost
    return (shown.problem.cost(truth, order) - best) / max(abs(best), 1e-12)


def summed(scores: list[Score]) -> list[Line]:
    """One line per learner and kind, in the order met."""
    groups: dict[tuple[str, str], list[Score]] = {}
    for s in scores:
        groups.setdefault((s.kind, s.learner), []).append(s)
    return [_line(learner, kind, found) for (kind, learner), found in groups.items()]


def _line(learner: str, kind: str, found: list[Score]) -> Line:
    regrets = [s.regret for s in found if s.regret is not None]
    hits, tests = sum(s.test_hits for s in found), sum(s.test for s in found)
    return Line(
        learner=learner,
        kind=kind,
        cases=len(found),
        train_success=sum(s.train_hits for s in found) / sum(s.train for s in found),
        test_success=hits / tests,
        test_hits=hits,
        test=tests,
        regret=float(np.mean(regrets)) if regrets else None,
        tau=float(np.mean([s.tau for s in found])),
        answers=float(np.mean([s.answers for s in found])),
        cpu_s=float(np.mean([s.cpu_s for s in found])),
    )


def by_kind(lines: Ordered[Line]) -> list[list[Line]]:
    """The lines of each kind, in the order met."""
    return [[line for line in lines if line.kind == kind] for kind in dict.fromkeys(line.kind for line in lines)]


def title_of(line: Line) -> str:
    """Of the table a line stands in."""
    return TITLES.get(line.kind, f"{line.cases} made-up experts of random weights, synthetic tools and split")


def format_comparison(lines: Ordered[Line]) -> str:
    """A table per kind."""
    text: list[str] = []
    for rows in by_kind(lines):
        text += ["", title_of(rows[0]), "learner                  train   test    hits     regret    tau   answers    cpu s"]
        text += [_row(line) for line in rows]
        text += not_best(rows)
    return "\n".join([*text[1:], MEANS])


MEANS = (
    'Answers and seconds are means per case. "Asking" is asked about the unseen tools themselves, Algorithm 1 about the training tools; '
    "an order recorded because both that were shown are wrong counts as one more answer."
)


@dataclass(frozen=True)
class _Measure:
    """A column in which one learner can be better than another, and why ours may not be the best."""

    name: str
    of: Callable[[Line], float | None]
    words: str  # format of a value
    up: bool  # larger is better
    why: str


MEASURES = (
    _Measure(
        "training tools hit",
        lambda x: x.train_success,
        "{:.0%}",
        True,
        "a recorded order that contradicts the others is allowed to be an exception; copying an order says nothing about other tools",
    ),
    _Measure("unseen tools hit", lambda x: x.test_success, "{:.0%}", True, "without answers the demonstrations leave this open"),
    _Measure("regret", lambda x: x.regret, "{:.2%}", False, "without answers the demonstrations leave this open"),
    _Measure(
        "tau",
        lambda x: x.tau,
        "{:.3f}",
        True,
        "tau counts from the one order that was recorded, but which of the equally cheap ones is chosen is settled by region names",
    ),
    _Measure(
        "cpu",
        lambda x: x.cpu_s,
        "{:.2f} s",
        False,
        "ours proves its weights on every tool, or leaves each recorded order out in turn before it trusts a way of learning",
    ),
)


def not_best(lines: Ordered[Line]) -> list[str]:
    """Where another learner is ahead of ours without answers, and why; lines of one kind."""
    ours = next((line for line in lines if line.learner == LEARNERS[0]), None)
    if ours is None:
        return []
    found = []
    for m in MEASURES:
        rivals = [x for x in lines if not x.learner.startswith("ours") and (m.name != "cpu" or x.learner not in UNTAUGHT)]
        others = [(value, x.learner) for x in rivals if (value := m.of(x)) is not None]
        mine = m.of(ours)
        if mine is None or not others:
            continue
        best, who = max(others) if m.up else min(others)
        if m.words.format(best) != m.words.format(mine) and (best > mine) is m.up:
            found.append(f"Not best in {m.name}: {who} {m.words.format(best)}, ours {m.words.format(mine)}; {m.why}.")
    return found


def _row(line: Line) -> str:
    regret = "       -" if line.regret is None else f"{line.regret:8.2%}"
    hits = f"{line.test_hits}/{line.test}"
    return (
        f"{line.learner:23s}  {line.train_success:5.0%}  {line.test_success:5.0%}  {hits:>7s}   {regret}  {line.tau:5.2f}"
        f"  {line.answers:8.1f}  {line.cpu_s:7.2f}"
    )
