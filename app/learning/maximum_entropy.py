"""Maximum-entropy IRL on whole sequences, exact: p(xi) in proportion to exp(-w . Phi(xi)).

Nothing is sampled: the sum over all N! sequences is a dynamic program over sets of finished regions. Up to 14 regions all sets
are in one table, up to 20 they are listed (`soft_graph`), while memory lasts. On larger tools only the sets around the demonstration and
those where orders are likeliest count, so that alternatives far from both are left out of the sum: an approximation, which is said.
"""

from collections.abc import Sequence as Ordered
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from app.errors import InvalidInput
from app.learning.performance_state import LearningDemonstration
from app.learning.qp import Array
from app.learning.sampling import feature_scale, feature_sums, random_pool
from app.learning.soft_graph import MOST_REGIONS, SoftGraph, covariance_of, expected_sums_of, part_graph, to_go_of, whole_graph
from app.learning.soft_program import expected_sums, soft_to_go
from app.sequencing.problem import TENSOR_LIMIT, SequencingProblem

POOL = 100  # random sequences per tool that measure a feature's unit
SEED = 20230523  # of these sequences; fixed, so that the same demonstrations always give the same weights
STEPS = 200  # of the quasi-Newton descent, at most
NUDGE = 1e-4  # step of the differences behind the curvature
LISTED_LIMIT = 20  # regions up to which all sets are listed
LISTED_BYTES = 8e8  # of all lists together; what is beyond is computed in part
SETTLING = 2  # times the kept sets are chosen anew under weights learned with those before


@dataclass(frozen=True)
class Lesson:
    """One demonstration, features in their units."""

    values: Array  # (2^N, N, F) features of each transition; anything where already done
    total: Array  # (F,) feature sum of the demonstration

    @property
    def n(self) -> int:
        return self.values.shape[1]


@dataclass(frozen=True)
class ListedLesson:
    """The same on a tool whose transitions are listed."""

    graph: SoftGraph
    total: Array  # (F,)

    @property
    def n(self) -> int:
        return self.graph.n


AnyLesson = Lesson | ListedLesson


@dataclass(frozen=True)
class SoftFit:
    """Weights under which the demonstrations are likely."""

    weights: Array  # (F,) on scaled features
    penalty: float  # lambda of the squared norm
    surprise: float  # mean -log p of a demonstration under these weights
    curvatures: Array  # (lessons, F, F) covariance of the feature sums of each tool under these weights; none if not asked for

    @property
    def covariance(self) -> Array:
        """Of the weights given the demonstrations (Laplace), (F, F), counting the penalty once per demonstration."""
        lessons, size = self.curvatures.shape[:2]
        return np.linalg.inv(self.curvatures.sum(axis=0) + lessons * self.penalty * np.eye(size))


def lessons_of(demonstrations: list[LearningDemonstration]) -> tuple[list[AnyLesson], Array, tuple[bool, ...]]:
    """Demonstrations with features scaled to unit deviation within a tool, the units, and which features vary at all.

    Above 14 regions in part, around the demonstration alone; `settled` chooses better parts, `listed` whole ones.

    Raises:
        InvalidInput: A tool has too many regions.
    """
    check_size(max((d.problem.n for d in demonstrations), default=0))
    generators = [np.random.default_rng([SEED, d.problem.n]) for d in demonstrations]
    sums = [feature_sums(d.problem, random_pool(d.problem, POOL, g)) for d, g in zip(demonstrations, generators, strict=True)]
    scale, live = feature_scale(sums)
    unit = unit_of(scale, live)
    return [_lesson(d, unit, np.zeros(len(unit))) for d in demonstrations], scale, live


def check_size(regions: int) -> None:
    """Refuse what even a part can't be computed for.

    Raises:
        InvalidInput: Too many regions.
    """
    if regions > MOST_REGIONS:
        raise InvalidInput(f"Learning from likelihood needs tools of at most {MOST_REGIONS} regions; one has {regions}.")


def unit_of(scale: Array, live: Ordered[bool]) -> Array:
    """What features are multiplied with; a constant says nothing, its weight stays 0."""
    return np.where(live, 1 / scale, 0.0)


def _lesson(shown: LearningDemonstration, unit: Array, w: Array) -> AnyLesson:
    total = shown.problem.feature_sum(shown.sequence) * unit
    if shown.problem.n <= TENSOR_LIMIT:
        return Lesson(np.ascontiguousarray(shown.problem.tensor() * unit), total)
    return ListedLesson(part_graph(shown.problem, unit, w, (shown.sequence,)), total)


def settled(shown: list[LearningDemonstration], lessons: list[AnyLesson], unit: Array, penalty: float) -> list[AnyLesson]:
    """Lessons in part whose sets are the likeliest ones under weights learned with them; others as they are."""
    for _ in range(SETTLING if any(isinstance(t, ListedLesson) for t in lessons) else 0):
        w = fit(lessons, penalty, curved=False).weights
        lessons = [t if isinstance(t, Lesson) else _lesson(d, unit, w) for d, t in zip(shown, lessons, strict=True)]
    return lessons


def listed(shown: list[LearningDemonstration], lessons: list[AnyLesson], unit: Array) -> list[AnyLesson]:
    """Lessons with all sets listed where that fits, the smallest tools first; others as they are."""
    left, found = LISTED_BYTES, list(lessons)
    for k in sorted(range(len(found)), key=lambda k: shown[k].problem.n):
        if isinstance(found[k], ListedLesson) and (need := listed_bytes(shown[k].problem)) <= left:
            left -= need
            found[k] = ListedLesson(whole_graph(shown[k].problem, unit), found[k].total)
    return found


def listed_bytes(problem: SequencingProblem) -> float:
    """Memory of the list of all transitions of a tool; infinite where it isn't made."""
    transitions = problem.n * 2.0 ** (problem.n - 1)
    return transitions * (4 * len(problem.columns) + 5) if problem.n <= LISTED_LIMIT else np.inf


def in_part(lessons: Ordered[AnyLesson]) -> tuple[int, ...]:
    """The lessons whose likelihood is an approximation."""
    return tuple(k for k, t in enumerate(lessons) if isinstance(t, ListedLesson) and not t.graph.whole)


def log_sum(lesson: AnyLesson, w: Array) -> float:
    """-log of the sum of exp(-cost) over the tool's orders."""
    return to_go_of(lesson.graph, w)[0] if isinstance(lesson, ListedLesson) else float(soft_to_go(lesson.values, w, lesson.n)[0][0])


def surprise(lesson: AnyLesson, w: Array) -> tuple[float, Array]:
    """-log p of the demonstration and its gradient (F,): the demonstrated minus the expected feature sum."""
    if isinstance(lesson, ListedLesson):
        start, chosen = to_go_of(lesson.graph, w)
        return float(w @ lesson.total) - start, lesson.total - expected_sums_of(lesson.graph, chosen)
    to_go, chosen = soft_to_go(lesson.values, w, lesson.n)
    return float(w @ lesson.total - to_go[0]), lesson.total - expected_sums(lesson.values, chosen, lesson.n)


def fit(lessons: list[AnyLesson], penalty: float, start: Array | None = None, lower: Array | None = None, curved: bool = True) -> SoftFit:
    """Minimise the mean surprise + penalty / 2 * |w|^2.

    Args:
        lessons: At least one.
        penalty: Above 0.
        start: Where to begin, 0 if None.
        lower: Lower bounds of the weights, none if None.
        curved: Whether to measure the curvatures, which costs as much as the fit.
    """
    size = len(lessons[0].total)
    bounds = None if lower is None else [(float(x), None) for x in lower]
    begin = np.zeros(size) if start is None else start
    begin = begin if lower is None else np.maximum(begin, lower)

    def objective(w: Array) -> tuple[float, Array]:
        parts = [surprise(lesson, w) for lesson in lessons]
        value = sum(v for v, _ in parts) / len(parts) + penalty / 2 * float(w @ w)
        return value, sum((g for _, g in parts), np.zeros(size)) / len(parts) + penalty * w

    found = minimize(objective, begin, jac=True, method="L-BFGS-B", bounds=bounds, options={"maxiter": STEPS, "ftol": 1e-12, "gtol": 1e-7})
    w = np.asarray(found.x, np.float64)
    known = sum(surprise(lesson, w)[0] for lesson in lessons) / len(lessons)
    return SoftFit(w, penalty, known, curvatures_at(lessons, w) if curved else np.zeros((0, size, size)))


def curvatures_at(lessons: Ordered[AnyLesson], w: Array) -> Array:
    """Per lesson the covariance of the feature sums under w, (lessons, F, F)."""
    return np.array([_curvature(t, w) for t in lessons])


def _curvature(lesson: AnyLesson, w: Array) -> Array:
    """By one pass over listed transitions, else by central differences of the exact gradient."""
    if isinstance(lesson, ListedLesson):
        return covariance_of(lesson.graph, to_go_of(lesson.graph, w)[1])
    steps = NUDGE * np.eye(len(w))
    rows = np.array([(surprise(lesson, w + step)[1] - surprise(lesson, w - step)[1]) / (2 * NUDGE) for step in steps])
    return (rows + rows.T) / 2


def left_out_weights(lessons: Ordered[AnyLesson], found: SoftFit) -> list[Array]:
    """Per demonstration the weights that would be learned without it, each by one Newton step from the joint ones."""
    others, identity = len(lessons) - 1, found.penalty * np.eye(len(found.weights))
    joint = found.curvatures.sum(axis=0)
    return [
        found.weights
        + np.linalg.solve((joint - own) / others + identity, surprise(t, found.weights)[1] + found.penalty * found.weights) / others
        for t, own in zip(lessons, found.curvatures, strict=True)
    ]
