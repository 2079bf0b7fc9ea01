"""A certified run in resumable steps: learn from the demonstrations, ask about the tools that are still open, stop when none is.

Each step computes everything from the demonstrations and the answers in the order they were asked, so a run goes on
anywhere with the same bytes. What an earlier step computed may be kept (`Memory`), which changes nothing but the time.

Answers to a pair: "left" or "right" is how the expert would do the tool (a demonstration of it), "equal" means both are,
"both_wrong" means neither is (show it), "cant_tell" says nothing. An answer that no weights agree with, beside all that was
known before, is asked once more; and after every few answers the one that sits worst with the others is, so that slips come to
light. Answers that then contradict each other are weighed (`weighing`), and those that sit ill with the others are named.
"""

from collections.abc import Mapping
from collections.abc import Sequence as Ordered
from dataclasses import dataclass, replace

import numpy as np

from app.errors import InvalidInput
from app.learning.certified import (
    Certificate,
    CertifiedPrior,
    Explored,
    certificate,
    compromise,
    excess,
    explore,
    is_hit,
    pool_for,
)
from app.learning.certified_state import CertifiedParameters, CertifiedResult, CertifiedState, ConflictReport, Report, ToolChance
from app.learning.conflicts import Conflict, conflict_words, conflicts
from app.learning.cuts import CutPool, unit_rows
from app.learning.outlook import Outlook, outlook
from app.learning.pairs import REPEAT, PairQuestion, look_of, offers, question
from app.learning.performance_conflict import Contradiction, contradiction_words, find_contradiction
from app.learning.performance_state import LearningDemonstration, Metric
from app.learning.qp import Array
from app.learning.questions import fingerprint
from app.learning.weighing import ILL, TELLING, Given, Repeats, Weighed, repeats_of, weigh
from app.sequencing.features import DEFAULT_INTERACTIONS, Interaction
from app.sequencing.problem import EXACT_LIMIT, SequencingProblem

Answers = Mapping[str, str]  # fingerprint -> "left" | "right" | "equal" | "cant_tell" | "both_wrong"
Answered = tuple[tuple[str, str], ...]  # fingerprints and answers in the order asked
Demonstrations = Ordered[LearningDemonstration]
Tools = Ordered[SequencingProblem]  # tools of interest: those without a demonstration

VIOLATED = 1e-7  # relative extra cost that counts as not the cheapest


@dataclass(frozen=True)
class Known:
    """What follows from the demonstrations and the first few answers."""

    pool: CutPool
    members: tuple[int, ...]  # demonstrations of the pool that count, chosen orders after the recorded ones
    rows: Array  # (m, r) what comparisons say
    explored: Explored
    left_out: tuple[str, ...]  # answers nothing agrees with; once they are weighed, those that sit ill with the others
    closed: frozenset[int]  # tools whose order the expert has chosen, or has to show
    chosen: frozenset[int]  # the first kind
    contradiction: Contradiction | None = None
    conflicts: tuple[Conflict, ...] = ()  # the minimal sets behind it
    weighed: Weighed | None = None  # answers contradict each other


@dataclass
class Memory:
    """Results of earlier steps of one run, by the answers that led there. Forgetting it is harmless."""

    known: dict[tuple[tuple[str, str], ...], Known]

    @staticmethod
    def empty() -> "Memory":
        return Memory({})


def start_certified(demonstrations: Demonstrations, tools: Tools, parameters: CertifiedParameters, seed: int) -> CertifiedState:
    """The state before the first step.

    Raises:
        EmptySample: Nothing to learn from.
        InvalidInput: The tools differ in their features.
    """
    pool_for(demonstrations, _prior(parameters), tools)
    return CertifiedState(seed, _identity(demonstrations, tools), count=len(demonstrations))


def certified_step(
    demonstrations: Demonstrations,
    tools: Tools,
    parameters: CertifiedParameters,
    state: CertifiedState,
    answers: Answers,
    memory: Memory | None = None,
    gone: frozenset[int] = frozenset(),
) -> CertifiedResult:
    """Learn from all that is known and ask what is open; pure and deterministic.

    Args:
        demonstrations: The ones the run was started with, in the same order, then those recorded for it since.
        tools: The tools of interest it was started with, in the same order.
        parameters: How to decide.
        state: As the last step returned it.
        answers: All answers of the run so far by fingerprint; leaving one out re-opens its question.
        memory: Of earlier steps of this run; gets what this one finds.
        gone: Tools that nobody is interested in any more; they are not asked about.

    Returns:
        New state, and questions or the end of the run.
    """
    if state.demonstrations != _identity(demonstrations[: state.count or None], tools):
        raise InvalidInput("The demonstrations are not the ones this run was started with; start a new run.")
    given = tuple((q.fingerprint, answers[q.fingerprint]) for q in state.asked if q.fingerprint in answers)
    memory = memory or Memory.empty()
    known = _known(demonstrations, tools, parameters, state, given, memory)
    base = _known(demonstrations, tools, parameters, state, (), memory)
    repeats = repeats_of(state.asked, answers)
    if _usable(base) and (repeats.changed or _contradict(known, parameters, state)):
        known = _outweigh(base, known, tools, state, given, repeats)
    usable = _usable(known)
    wanted = {t: p for t, p in enumerate(tools) if usable and t not in gone}
    outlooks = {t: outlook(p, known.pool.frame, known.explored, parameters.tolerance) for t, p in wanted.items()}
    unanswered = tuple(q for q in state.asked if q.fingerprint not in answers)
    fresh = () if unanswered or not usable else _check(base, tools, parameters, state, given) or _fresh(state, parameters, known, outlooks)
    u = known.explored.centre
    if known.explored.cone.empty or (known.contradiction and not known.contradiction.clear):
        u = compromise(known.pool, known.members, _prior(parameters))
    proof = certificate(known.pool, u, known.explored, usable, count_ties=not (fresh or unanswered))
    report = _report(demonstrations, proof, outlooks, known, repeats)
    metric = _metric(state, report)
    state = replace(state, weights=tuple(float(x) for x in proof.weights), steps=state.steps + 1)

    def result(outcome: str, questions: tuple[PairQuestion, ...], message: str) -> CertifiedResult:
        asked = state.asked if questions == unanswered else state.asked + questions
        final = replace(state, phase=outcome, asked=asked, latest=len(questions) or state.latest)
        return CertifiedResult(final, (metric,), outcome, questions, proof.weights, message, report, known.contradiction)

    if known.contradiction:
        names = [f"demonstration {i + 1}" for i in range(len(demonstrations))]
        return result("infeasible", (), contradiction_words(known.contradiction, names))
    if unanswered:
        return result("questions", unanswered, f"Waiting for {_count(len(unanswered), 'answer')}.")
    if fresh:
        return result("questions", fresh, _asking(report))
    return result("converged", (), _closing(demonstrations, report, parameters, known))


def _known(
    demonstrations: Demonstrations,
    tools: Tools,
    parameters: CertifiedParameters,
    state: CertifiedState,
    given: tuple[tuple[str, str], ...],
    memory: Memory,
) -> Known:
    """What follows from the demonstrations and the given answers, one after the other."""
    if given in memory.known:
        return memory.known[given]
    if not given:
        known = _base(demonstrations, tools, parameters, state.seed)
    else:
        before = _known(demonstrations, tools, parameters, state, given[:-1], memory)
        asked = next(q for q in state.asked if q.fingerprint == given[-1][0])
        known = _after(before, tools, parameters, asked, given[-1][1], np.random.default_rng([state.seed, len(given)]))
    memory.known[given] = known
    return known


def _base(demonstrations: Demonstrations, tools: Tools, parameters: CertifiedParameters, seed: int) -> Known:
    prior = _prior(parameters)
    pool = pool_for(demonstrations, prior, tools)
    everyone = tuple(range(len(demonstrations)))
    explored = explore(pool, everyone, prior, np.random.default_rng([seed, 0]))
    rows = np.zeros((0, pool.frame.size))
    found, sets = None, ()
    if not _explains(pool, everyone, explored):
        found = find_contradiction(len(everyone), lambda members: 0.0 if fits(pool, members, prior) else left_over(pool, members, prior))
        if found and found.clear and found.rest:  # the compromise follows those that agree
            followed = tuple(i for i in everyone if i not in found.odd)
            explored = explore(pool, followed, prior, np.random.default_rng([seed, 1]))
        sets = conflicts(demonstrations, prior, tools, _suspects(demonstrations[0].problem))
    return Known(pool, everyone, rows, explored, (), frozenset(), frozenset(), found, sets)


def _suspects(problem: SequencingProblem) -> tuple[Interaction, ...]:
    """The paper's interactions, where the tools have their factors."""
    return tuple(i for i in DEFAULT_INTERACTIONS if i.first in problem.features.factors and i.second in problem.features.factors)


def fits(pool: CutPool, members: Ordered[int], prior: CertifiedPrior) -> bool:
    """Whether some weights make each of the demonstrations a cheapest sequence that few others share."""
    quick = replace(prior, samples=8)
    return _explains(pool, members, explore(pool, members, quick, np.random.default_rng(0)))


def left_over(pool: CutPool, members: Ordered[int], prior: CertifiedPrior) -> float:
    """What the best compromise leaves unexplained."""
    u = compromise(pool, members, prior)
    return max(sum(excess(pool.demonstrations[i], pool, u) for i in members), 1e-9)


def _explains(pool: CutPool, members: Ordered[int], explored: Explored) -> bool:
    if explored.cone.empty or not len(explored.samples):
        return False
    weights = pool.frame.weights(explored.centre)
    return all(is_hit(pool.demonstrations[i], weights) for i in members)


def _after(
    before: Known, tools: Tools, parameters: CertifiedParameters, asked: PairQuestion, value: str, generator: np.random.Generator
) -> Known:
    """What is known after one more answer."""
    if value == "cant_tell" or before.contradiction:
        return before
    if value == "both_wrong":
        return replace(before, closed=before.closed | {asked.tool})
    pool = before.pool.copy()
    members, rows = before.members, before.rows
    if parameters.endorse:
        for order in [asked.left] * (value != "right") + [asked.right] * (value != "left"):
            pool.demonstrations.append(LearningDemonstration(tools[asked.tool], order))
            members = (*members, len(pool.demonstrations) - 1)
    else:
        sums = [pool.frame.reduce(tools[asked.tool].feature_sum(s)) for s in (asked.right, asked.left)]
        difference = unit_rows([sums[0] - sums[1]], pool.frame.size)
        rows = np.vstack([rows, *[difference] * (value != "right"), *[-difference] * (value != "left")])
    explored = explore(pool, members, _prior(parameters), generator, rows, before.explored)
    if explored.cone.empty or not len(explored.samples):
        return replace(before, left_out=(*before.left_out, asked.fingerprint))
    settled = {asked.tool} if parameters.endorse else set[int]()
    left_out = tuple(f for f in before.left_out if REPEAT + f != asked.fingerprint)
    return Known(pool, members, rows, explored, left_out, before.closed | settled, before.chosen | settled)


def _usable(known: Known) -> bool:
    return known.contradiction is None and not known.explored.cone.empty


def _fresh(state: CertifiedState, parameters: CertifiedParameters, known: Known, outlooks: dict[int, Outlook]) -> tuple[PairQuestion, ...]:
    """The next questions: one that has to be asked again, else the most telling ones, on different tools."""
    room = min(parameters.batch, parameters.most - len(state.asked))
    if room < 1:
        return ()
    asked = {q.fingerprint: q for q in state.asked}
    for name in _in_doubt(known, state):
        return (_again(asked[name], AGAIN),)
    open_tools = {t: o for t, o in outlooks.items() if t not in known.closed and not o.agreed}
    looks: dict[int, set[tuple[int, ...]]] = {}
    for q in state.asked:
        looks.setdefault(q.tool, set()).add(look_of(q.left, q.right))
    found = [o for o in offers(outlooks, looks, parameters.endorse) if o.tool in open_tools][:room]
    flips = np.random.default_rng([state.seed, 7, len(state.asked)]).random(len(found)) < 0.5
    return tuple(question(outlooks[o.tool], o, bool(flip)) for o, flip in zip(found, flips, strict=True))


def _again(asked: PairQuestion, why: str) -> PairQuestion:
    """The same question with its sides exchanged."""
    return replace(asked, left=asked.right, right=asked.left, fingerprint=REPEAT + asked.fingerprint, repeat=True, why=why)


def _in_doubt(known: Known, state: CertifiedState) -> list[str]:
    """Answers that nothing agrees with and that weren't asked again yet."""
    asked = {q.fingerprint for q in state.asked}
    return [] if known.weighed else [n for n in known.left_out if not n.startswith(REPEAT) and REPEAT + n not in asked]


def _contradict(known: Known, parameters: CertifiedParameters, state: CertifiedState) -> bool:
    """Whether answers contradict what is known although they were asked again, or can't be any more."""
    return bool(known.left_out) and (not _in_doubt(known, state) or len(state.asked) >= parameters.most)


def _outweigh(base: Known, known: Known, tools: Tools, state: CertifiedState, given: Answered, repeats: Repeats) -> Known:
    """What the demonstrations and all answers, weighed against each other, leave."""
    asked = {q.fingerprint: q for q in state.asked}
    told = [name for name, value in given if value in TELLING]
    pool, generator = base.pool.copy(), np.random.default_rng([state.seed, 11, len(given)])
    found = weigh(pool, base.explored, _told(tools, state, given), repeats.reliability, generator)
    ill = tuple(name for name, agreement in zip(told, found.agreement, strict=True) if agreement < ILL)
    reopened = {asked[name].tool for name in (*ill, *repeats.changed)}
    return replace(base, pool=pool, explored=found.explored, left_out=ill, closed=known.closed - reopened, weighed=found)


def _told(tools: Tools, state: CertifiedState, given: Answered) -> list[Given]:
    asked = {q.fingerprint: q for q in state.asked}
    return [Given(tools[asked[name].tool], asked[name].left, asked[name].right, value) for name, value in given if value in TELLING]


def _check(base: Known, tools: Tools, parameters: CertifiedParameters, state: CertifiedState, given: Answered) -> tuple[PairQuestion, ...]:
    """After every few answers the one that sits worst with the others, to be asked again; an answer can only be checked once."""
    asked = {q.fingerprint: q for q in state.asked}
    repeats = sum(q.repeat for q in state.asked)
    told = [name for name, value in given if value in TELLING]
    if len(state.asked) >= parameters.most or (len(given) - repeats) // parameters.check <= repeats:
        return ()
    left = [k for k, name in enumerate(told) if not asked[name].repeat and REPEAT + name not in asked]
    if not left:
        return ()
    generator = np.random.default_rng([state.seed, 13, len(given)])
    found = weigh(base.pool.copy(), base.explored, _told(tools, state, given), None, generator)
    worst = min(left, key=lambda k: round(found.agreement[k], 9))
    return (_again(asked[told[worst]], CHECK),)


CHECK = "Asked a second time on purpose, with the sides exchanged: it shows how far single answers can be relied on."
AGAIN = "Your answer to this question fits to none of the weights that explain the recorded orders. Please look once more."


def _report(demonstrations: Demonstrations, proof: Certificate, outlooks: dict[int, Outlook], known: Known, repeats: Repeats) -> Report:
    count = len(demonstrations)
    chances = tuple(
        ToolChance(t, 1.0, 0.0, True, 1, 0)  # the expert's own word
        if t in known.chosen
        else ToolChance(t, round(o.probability, 6), round(o.worst, 9), o.agreed, len(o.orders), len(o.favourite))
        for t, o in sorted(outlooks.items())
    )
    shares = proof.weights * proof.frame.scale
    return Report(
        realisable=proof.realisable,
        margin=float(proof.margin),
        slack=tuple(float(x) for x in proof.slack[:count]),
        class_sizes=proof.class_sizes[:count],
        identifiable=proof.identifiable,
        intervals=tuple((float(a), float(b)) for a, b in proof.intervals),
        shares=tuple(float(x) for x in shares / max(float(np.abs(shares).sum()), 1e-300)),
        tools=chances,
        expected_wrong=float(sum(1 - c.probability for c in chances)),
        samples=len(proof.samples),
        cuts=len(proof.cuts),
        oracle_calls=proof.oracle_calls,
        proved=all(d.problem.n <= EXACT_LIMIT for d in demonstrations),
        unclear=known.left_out,
        weighed=known.weighed is not None,
        repeated=len(repeats.pairs),
        repeated_alike=repeats.alike,
        conflicts=tuple(ConflictReport(c.members, c.slack, _resolving(c, demonstrations[0].problem)) for c in known.conflicts),
    )


def _resolving(conflict: Conflict, problem: SequencingProblem) -> str:
    """The last sentence of `conflict_words`; empty when nothing tried resolves it."""
    names = [str(i) for i in range(max(conflict.members) + 1)]
    words = conflict_words(conflict, names, problem)
    return words[words.index("It would be resolved") :] if "It would be resolved" in words else ""


def _metric(state: CertifiedState, report: Report) -> Metric:
    """What is plotted per step: expected number of wrong tools among those of interest, and slack of the demonstrations."""
    slack = float(sum(report.slack))
    violations = sum(s > VIOLATED for s in report.slack)
    return Metric(state.steps + 1, report.expected_wrong + slack, {"open": report.expected_wrong, "slack": slack}, violations)


def _asking(report: Report) -> str:
    return (
        f"Every recorded order is the best one on its tool. {_count(sum(not t.agreed for t in report.tools), 'tool')} without a "
        f"recorded order can still go more than one way."
    )


def _closing(demonstrations: Demonstrations, report: Report, parameters: CertifiedParameters, known: Known) -> str:
    count = len(demonstrations)
    first = "The recorded order is the best one on its tool." if count == 1 else "Every recorded order is the best one on its tool."
    if not report.tools:
        return first
    if known.weighed:
        first = f"{first} Some answers contradict each other, so all were weighed against each other."
    unsettled = [t for t in report.tools if not t.agreed]
    if unsettled:
        return f"{first} {_count(len(unsettled), 'tool')} can still go more than one way; a recorded order there would settle it."
    worst = max(t.extra for t in report.tools)
    if worst <= VIOLATED:
        return f"{first} All weights that explain them choose the same order on every other tool."
    return (
        f"{first} On the other tools all weights that explain them agree to within {parameters.tolerance:.1%} of cost; "
        f"about {report.expected_wrong:.1f} of {len(report.tools)} may have an order that is better by less than that."
    )


def _prior(parameters: CertifiedParameters) -> CertifiedPrior:
    return CertifiedPrior(None, parameters.samples, parameters.margin, parameters.least, parameters.regularisation)


def _identity(demonstrations: Demonstrations, tools: Tools) -> str:
    sizes = (*(d.problem.n for d in demonstrations), -1, *(p.n for p in tools))
    return fingerprint("certified", len(demonstrations), sizes, tuple(a for d in demonstrations for a in d.sequence))


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"
