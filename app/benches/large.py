"""Beyond 2^N: how good the best found orders of large tools are, how close the bounds come, and what a general solver makes of both."""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib.util import find_spec

import numpy as np

from app.benches.figures import Figure, Options
from app.geometry.moulds import Piece, arc, solid, trace, translational
from app.geometry.regions import measure as measured
from app.geometry.tool import Array, RegionGraph
from app.sequencing.bounds import STEPS, lower_bound
from app.sequencing.large import best_found
from app.sequencing.problem import SequencingProblem, problem_for
from app.sequencing.shortest import gap_between, shortest_sequence

SHAPES = {12: (3, 4), 30: (5, 6), 50: (5, 10), 75: (5, 15), 100: (10, 10)}
SOLVER_SECONDS = 30.0
TARGET_GAP = 0.1
QUICK_STEPS = 60
BOUND_SECONDS = 6.0  # for a bound above 50 regions, which has no bar: with all steps it takes up to 70 s


@dataclass(frozen=True)
class Case:
    """One tool under one set of weights."""

    name: str
    problem: SequencingProblem
    w: Array


def saddle(n: int) -> RegionGraph:
    """Double curvature of opposite signs, cut into a grid."""
    across, along = SHAPES[n]
    mesh, labels = solid(*translational(arc(0.38, across, np.radians(60)), arc(0.46, along, np.radians(-70))))
    return measured(mesh, labels).graph


def waves(n: int) -> RegionGraph:
    """Bands that are plane, hollow and crowned in turn, leaning to one side, cut into a grid."""
    across, along = SHAPES[n]
    turns = np.radians([30.0, -50.0, 0.0, 40.0])
    profile = trace(tuple(Piece(i, 0.4 / along, turns[4 * i // along] * 4 / along) for i in range(along)))
    mesh, labels = solid(*translational(profile, arc(0.42, across, np.radians(-45))), tilt=np.radians(5))
    return measured(mesh, labels).graph


def listed(n: int) -> RegionGraph:
    """A region table like the authors' scanned tools: a grid with drawn angles, curvatures, heights and areas."""
    rows, columns = SHAPES[n]
    rng = np.random.default_rng(n)
    row, column = np.divmod(np.arange(n), columns)
    down, across = abs(row[:, None] - row), abs(column[:, None] - column)
    edge, corner = down + across == 1, (down == 1) & (across == 1)
    outer = np.where(down > 0, np.isin(row, (0, rows - 1))[:, None], np.isin(column, (0, columns - 1))[:, None])
    angle = np.radians(rng.integers(-30, 31, (n, n))) * edge
    area = rng.uniform(0.7, 1.3, n)
    place = np.stack([row, column], axis=1).astype(np.float64)
    first = edge.argmax(axis=1)
    height, curvature = 0.4 + 0.6 * rng.uniform(size=n), rng.integers(-5, 6, n).astype(np.float64)
    return RegionGraph("real", edge / 4, edge * outer / 4, angle, edge, corner, first, curvature, height, area / area.sum(), place, place)


FAMILIES: dict[str, Callable[[int], RegionGraph]] = {"saddle": saddle, "waves": waves, "region table": listed}


def weights(problem: SequencingProblem, seed: int | None) -> Array:
    """All features of one size on average over random orders; with a seed each times 0.1 to 1, as the learner's are."""
    rng = np.random.default_rng(0)
    sums = np.mean([np.abs(problem.feature_sum(rng.permutation(problem.n).tolist())) for _ in range(30)], axis=0)
    drawn = np.ones(len(sums)) if seed is None else np.random.default_rng(seed).uniform(0.1, 1, len(sums))
    return drawn * np.where(sums > 1e-9, problem.n / np.maximum(sums, 1e-9), 1.0)


def cases(n: int, quick: bool) -> Iterator[Case]:
    """The bench family: three kinds of tools, three sets of weights each; one set where that would take too long."""
    for name, build in FAMILIES.items():
        problem = problem_for(build(n))
        for seed in (None,) if quick else (None, 1, 2) if n <= 50 else (1,):
            yield Case(f"{name}, {'even weights' if seed is None else f'learned-like weights {seed}'}", problem, weights(problem, seed))


def beyond(options: Options) -> Iterator[Figure]:
    """Figures of the search and the bounds from 12 to 100 regions; what has no bar and takes longest comes last."""
    small = next(cases(12, True))
    best_found(small.problem, small.w)  # nobody waits for a compiler
    lower_bound(small.problem, small.w, 1.0, steps=2)
    yield from _against_exact(options.quick)
    if find_spec("didppy") and not options.quick:
        yield from _against_solver()
    for n in (30,) if options.quick else (30, 50, 75, 100):
        for case in cases(n, options.quick):
            yield from _ours(case, n, QUICK_STEPS if options.quick else STEPS)


def _ours(case: Case, n: int, steps: int) -> Iterator[Figure]:
    """Both by processor time, each printed as soon as it is known."""
    group, bar, limited = f"beyond, N = {n}", n == 50, n > 50
    begun = time.process_time()
    cost = case.problem.cost(case.w, best_found(case.problem, case.w))
    yield Figure(group, f"{case.name}: best found", time.process_time() - begun, "s", None if limited else 1.0, note="cpu")
    begun = time.process_time()
    over = (lambda: time.process_time() - begun > BOUND_SECONDS) if limited else (lambda: False)
    gap = gap_between(cost, lower_bound(case.problem, case.w, cost, steps=steps, should_stop=over))
    note = f"bound took {time.process_time() - begun:.1f} s"
    if limited and over():
        note += f"; the steps were stopped after {BOUND_SECONDS:.0f} s"
    if bar and gap > TARGET_GAP:
        note += f"; the target is missed by {100 * (gap - TARGET_GAP):.1f} points"
    yield Figure(group, f"{case.name}: gap", 100 * gap, "%", 100 * TARGET_GAP if bar else None, note=note)


def _against_exact(quick: bool) -> Iterator[Figure]:
    worst, loosest = 0.0, 0.0
    for case in cases(12, False):
        exact = shortest_sequence(case.problem, case.w).cost
        found = case.problem.cost(case.w, best_found(case.problem, case.w))
        bound = lower_bound(case.problem, case.w, found, steps=QUICK_STEPS if quick else STEPS)
        worst, loosest = max(worst, gap_between(found, exact)), max(loosest, gap_between(exact, bound))
        assert bound <= exact + 1e-9 * abs(exact)
    yield Figure("beyond, N = 12", "best found above the optimum, worst", 100 * worst, "%", 0.0001)
    yield Figure("beyond, N = 12", "bound below the optimum, worst", 100 * loosest, "%")


def _against_solver() -> Iterator[Figure]:
    from app.benches.didp_model import solve

    for name in ("saddle", "region table"):
        for n in (12, 30, 50):
            problem = problem_for(FAMILIES[name](n))
            w = weights(problem, 1)
            begun = time.process_time()
            cost = problem.cost(w, best_found(problem, w))
            ours = time.process_time() - begun
            order, proved, trace = solve(problem, w, SOLVER_SECONDS)
            theirs = problem.cost(w, order)
            assert abs(theirs - trace[-1][1]) <= 1e-5 * abs(theirs), "the solver's model has another cost"
            reached = next((seconds for seconds, value in trace if value <= cost * (1 + 1e-9)), SOLVER_SECONDS)
            note = f"{'proved' if proved else f'not proved in {SOLVER_SECONDS:.0f} s'}; ours took {ours:.2f} s, it {reached:.1f} s" + (
                "" if theirs <= cost * (1 + 1e-9) else " without reaching it"
            )
            yield Figure(f"beyond, didppy CABS, N = {n}", f"{name}: our cost / its cost", cost / theirs, "", 1.000001, note=note)
