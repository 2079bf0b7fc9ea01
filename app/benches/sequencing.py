"""`apprentice bench sequencing`: seconds and memory of the exact search, equality of its paths, and ratios to other methods."""

import itertools
import os
import shlex
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory

import networkx as nx
import numpy as np

from app.benches.figures import Figure, Options
from app.geometry.tool import Array, RegionGraph
from app.learning.evaluation import read_tables
from app.sequencing import kernels
from app.sequencing.classes import best_classes, equivalent_sequences, omega_size
from app.sequencing.constraints import resolve
from app.sequencing.exact import bytes_needed, costs_to_go, form_for, model_for, parallel_is_safe, uses_threads
from app.sequencing.last import regripping, travel
from app.sequencing.problem import TENSOR_LIMIT, SequencingProblem, problem_for
from app.sequencing.shortest import shortest_sequence

SHAPES = {7: (1, 7), 8: (2, 4), 9: (3, 3), 10: (2, 5), 12: (3, 4), 16: (4, 4), 18: (3, 6), 20: (4, 5), 24: (4, 6), 26: (2, 13), 28: (4, 7)}
BARS_MS = {12: 0.1, 20: 8.0, 24: 300.0, 26: 1500.0}
SCALED_FROM = 20  # regions: below, a second thread is not even tried
MOST_BYTES = 2.5e9  # at N = 28
ADAPTER = "apprentice_adapter.py"
PUBLISHED_S = {9: 0.72, 10: 3.7}  # the authors' Dijkstra, best of contended runs on another day: the study of sequencing, 2.1


def measure(options: Options) -> Iterator[Figure]:
    """Everything about the exact search; what lies beyond 2^N comes from its own module."""
    yield from _memory(options.quick)  # first: a process begins with the most memory its parent ever had
    sizes = (12, 16) if options.quick else (12, 16, 20, 24, 26)
    for interactions, words in (((), "separable"), (None, "with two interactions")):
        for n in sizes:
            yield from _solves(n, interactions, words)
    yield from _by_last((10,) if options.quick else (12, 18, 20))
    yield from _omega((12,) if options.quick else (12, 16, 20))
    yield from _agreement(options.quick)
    yield from _first_call(options.quick)
    yield from _ratios(options)
    yield from _solver()
    if find_spec("app.benches.large"):
        from app.benches.large import beyond

        yield from beyond(options)


def made_up(n: int, interactions: tuple[()] | None = None) -> tuple[SequencingProblem, Array]:
    """A grid of squares of unlike curvature, height and tilt, and weights; the same every time."""
    rows, columns = SHAPES[n]
    rng = np.random.default_rng(n)
    row, column = np.divmod(np.arange(n), columns)
    down, across = abs(row[:, None] - row), abs(column[:, None] - column)
    edge, corner = down + across == 1, (down == 1) & (across == 1)
    tilt, low = rng.uniform(-0.6, 0.6, n), np.stack([column, row], axis=1).astype(float)
    outer = (row % (rows - 1 or 1) == 0) | (column % (columns - 1 or 1) == 0)
    area = rng.uniform(0.5, 1, n)
    graph = RegionGraph(
        "mesh", edge / 4, edge * outer[:, None] / 4, (tilt[None, :] - tilt[:, None]) * edge, edge, corner, edge.argmax(axis=1),
        rng.uniform(-1, 1, n), rng.uniform(0.05, 1, n), area / area.sum(), low, low + 1,
    )  # fmt: skip
    problem = problem_for(graph) if interactions is None else problem_for(graph, interactions)
    return problem, rng.uniform(0.1, 1, len(problem.columns))


def _best(call: Callable[[], object], seconds: float) -> tuple[float, float]:
    """Least wall and least processor milliseconds of as many repeats as fit, at least three: a moment of a busy machine is outlasted."""
    wall, cpu, started = [], [], time.perf_counter()
    while len(wall) < 3 or time.perf_counter() - started < seconds:
        w, c = time.perf_counter(), time.process_time()
        call()
        wall.append(time.perf_counter() - w)
        cpu.append(time.process_time() - c)
    return 1e3 * min(wall), 1e3 * min(cpu)


def _solves(n: int, interactions: tuple[()] | None, words: str) -> Iterator[Figure]:
    """One solve under new weights, tables ready, by the wall clock on the threads the product uses: the part that is the dynamic
    program, and the whole answer."""
    problem, w = made_up(n, interactions)
    started = time.process_time()
    model = model_for(problem, resolve(None, n))
    if n <= TENSOR_LIMIT:
        problem.tensor()  # the learner has it at these sizes: the cost in double precision is read from it
    prepared = 1e3 * (time.process_time() - started)
    shortest_sequence(problem, w)  # threads started, buffers touched
    group, bar = f"exact, {words}", BARS_MS.get(n) if interactions == () else None
    one_wall, one = _best(lambda: costs_to_go(model, form_for(model, w), threads=False), 0.5)
    two = uses_threads(n)
    both = _best(lambda: costs_to_go(model, form_for(model, w), threads=True), 0.5)[0] if n >= SCALED_FROM and parallel_is_safe() else None
    wall = both if two and both else one_wall
    threads = "two threads" if two else "one thread, as the product does at this size"
    whole, cpu = _best(lambda: shortest_sequence(problem, w), 1.0)
    note = f"wall, {threads}; tables ready; {cpu:.3g} ms cpu of all threads"
    yield Figure(group, f"N = {n}, one solve: sequence, ties, float64 cost", whole, "ms", bar, note=note)
    note = f"wall, {threads}; one thread: {one:.3g} ms cpu, {one_wall:.3g} ms wall"
    yield Figure(group, f"N = {n}, of which costs-to-go (also on their own)", wall, "ms", note=note)
    if both:
        note = "wall against wall; a busy machine lowers it" + ("" if two else "; the product takes one thread at this size")
        yield Figure(group, f"N = {n}, speed-up of 2 threads", one_wall / both, "x", note=note)
    yield Figure(group, f"N = {n}, tables of the tool, once (cpu)", prepared, "ms")
    if n == 20 and interactions is None:
        _, classes = _best(lambda: best_classes(problem, w, 10), 0.5)
        yield Figure(group, "N = 20, ten best cost classes, counted (cpu)", classes, "ms")


def _by_last(sizes: tuple[int, ...]) -> Iterator[Figure]:
    """Travel and grip changes: a state is a set and its last region."""
    for n in sizes:
        problem, w = made_up(n, ())
        rng = np.random.default_rng(n)
        extra = (travel(rng.random((problem.n, 3))), regripping(rng.integers(0, 3, problem.n)))
        problem, weights = replace(problem, last=extra), np.concatenate([w, [1.0, 0.5]])
        started, wall = time.process_time(), time.perf_counter()
        found = shortest_sequence(problem, weights)
        cpu, wall = time.process_time() - started, time.perf_counter() - wall
        note = f"one thread, {wall:.3g} s wall; one run, tables of the tool included; {'proved' if found.proved else 'NOT proved'}"
        yield Figure("costs of the region before", f"N = {problem.n}, one solve over (set, last region), cpu", cpu, "s", note=note)


def _omega(sizes: tuple[int, ...]) -> Iterator[Figure]:
    """Equal feature sums on a tool that mirrors itself, counted and sampled."""
    for n in sizes:
        problem = even(n)
        order = shortest_sequence(problem, np.ones(len(problem.columns))).sequence
        omega_size(problem, order)
        _, cpu = _best(lambda p=problem, o=order: equivalent_sequences(p, o), 0.0)
        found = equivalent_sequences(problem, order)
        how = "exact" if found.counted else "at least"
        note = f"{how} {found.count:,} sequences; {len(found.sequences)} listed" + ("" if found.complete else ", as diverse as possible")
        yield Figure("omega", f"N = {n}, equal feature sums counted and listed, cpu", cpu, "ms", note=note)


def even(n: int) -> SequencingProblem:
    """A grid of equal squares: it mirrors itself."""
    columns = SHAPES[n][1]
    row, column = np.divmod(np.arange(n), columns)
    down, across = abs(row[:, None] - row), abs(column[:, None] - column)
    edge, corner, low = down + across == 1, (down == 1) & (across == 1), np.stack([column, row], axis=1).astype(float)
    none, level = np.zeros((n, n)), np.ones(n)
    graph = RegionGraph("mesh", edge / 4, none, none, edge, corner, edge.argmax(axis=1), 0 * level, level, level / n, low, low + 1)
    return problem_for(graph, ())


LARGEST = """
import resource, sys
from app.benches.sequencing import made_up
from app.sequencing.exact import Limits
from app.sequencing.shortest import shortest_sequence
problem, w = made_up(int(sys.argv[1]))
begun = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
assert shortest_sequence(problem, w, limits=Limits(regions=28)).proved
print(begun, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
"""


def _memory(quick: bool) -> Iterator[Figure]:
    """A process of its own that solves one tool, as the system counts it."""
    problem, _ = made_up(28)
    bar, computed = MOST_BYTES / 1e9, bytes_needed(problem, 28) / 1e9
    if quick:
        note = "computed from the arrays allocated; measured by the full bench"
        yield Figure("memory", "N = 28, all tables", computed, "GB", bar, note=note)
        return
    for n, limit in ((26, None), (28, bar)):
        started = time.perf_counter()
        out = subprocess.run([sys.executable, "-c", LARGEST, str(n)], capture_output=True, text=True, check=True).stdout.split()
        before, most = (1024 * float(x) / 1e9 for x in out)
        note = f"most resident memory of a process, {before:.2g} GB of it before the solve; {time.perf_counter() - started:.3g} s in all"
        yield Figure("memory", f"N = {n}, one solve, measured", most, "GB", limit, note=note)


def _agreement(quick: bool) -> Iterator[Figure]:
    """The largest relative difference between the table, the block kernel and every order."""
    apart_table, apart_orders = 0.0, 0.0
    for n in (7,) if quick else (7, 8):
        for words in ((), None):
            problem, w = made_up(n, words)
            w = w * np.random.default_rng(n).choice([-1, 1], len(w))
            cost = np.array([problem.cost(w, order) for order in itertools.islice(itertools.permutations(range(n)), 5040)])
            table = kernels.lowest_to_go(problem.cost_table(w), n)
            found = shortest_sequence(problem, w).cost
            apart_table = max(apart_table, abs(found - table[0]) / abs(table[0]))
            if n == 7:
                apart_orders = max(apart_orders, abs(found - cost.min()) / abs(cost.min()))
    yield Figure("agreement", "block kernel against table, N = 7, 8", apart_table, "", 1e-9, note="relative; hypothesis tests go further")
    yield Figure("agreement", "block kernel against all 5,040 orders, N = 7", apart_orders, "", 1e-9)


FIRST = """
import sys, time
started = time.perf_counter()
import numpy as np
from app.benches.sequencing import made_up
from app.sequencing.shortest import shortest_sequence
from app.sequencing.warming import warm_up
loaded = time.perf_counter()
if "warm" in sys.argv:
    warm_up()
warm = time.perf_counter()
problem, w = made_up(12)
begin = time.perf_counter()
shortest_sequence(problem, w)
print(loaded - started, warm - loaded, time.perf_counter() - begin)
"""


def _first_call(quick: bool) -> Iterator[Figure]:
    """Fresh processes: as a worker after the first start, without a warm-up, and with nothing compiled on disk either."""
    group = "first call"
    imports, warm, first = _fresh("warm")
    yield Figure(group, "fresh process: warm-up, before anybody waits", warm, "s", note=f"kernels on disk; imports {imports:.2g} s more")
    yield Figure(group, "first solve after the warm-up, N = 12", 1e3 * first, "ms", note="tables of the tool included")
    yield Figure(group, "first solve without a warm-up, kernels on disk", 1e3 * _fresh()[2], "ms", note="what the warm-up saves the user")
    if not quick:
        with TemporaryDirectory() as empty:
            seconds = _fresh(cache=empty)[2]
        yield Figure(group, "first solve, nothing compiled on disk", seconds, "s", note="once per installation, in the worker's warm-up")


def _fresh(*words: str, cache: str | None = None) -> tuple[float, ...]:
    env = os.environ if cache is None else os.environ | {"NUMBA_CACHE_DIR": cache}
    out = subprocess.run([sys.executable, "-c", FIRST, *words], capture_output=True, text=True, check=True, env=env).stdout
    return tuple(float(x) for x in out.split())


def dijkstra(problem: SequencingProblem, w: Array) -> tuple[float, float]:
    """The textbook way: an explicit graph of all sets, then Dijkstra. Returns the cost and the seconds of the search alone."""
    n, table = problem.n, problem.cost_table(w)
    graph = nx.DiGraph()
    lift = max(0.0, -float(np.nanmin(table)))  # every sequence has n steps, so lifting each edge changes no order
    for s in range((1 << n) - 1):
        graph.add_weighted_edges_from((s, s | 1 << a, table[s, a] + lift) for a in range(n) if not s >> a & 1)
    started = time.process_time()
    length, _ = nx.single_source_dijkstra(graph, 0, (1 << n) - 1)
    return float(length) - n * lift, time.process_time() - started  # pyright: ignore[reportArgumentType]


def _ratios(options: Options) -> Iterator[Figure]:
    n = 9 if options.quick else 12
    problem, w = made_up(n)
    cost, seconds = dijkstra(problem, w)
    shortest_sequence(problem, w)
    model = model_for(problem, resolve(None, n))
    _, ours = _best(lambda: costs_to_go(model, form_for(model, w), threads=False), 0.3)
    agree = abs(cost - shortest_sequence(problem, w).cost)
    note = f"{seconds:.3g} s; our own networkx Dijkstra, graph built beforehand; costs differ by {agree:.1g}"
    yield Figure("ratio", f"our networkx Dijkstra / costs-to-go, N = {n}", 1e3 * seconds / ours, "x", note=note)
    if options.checkout is None and options.reference_command is None:
        problem, w = made_up(9)
        model = model_for(problem, resolve(None, 9))
        _, ours = _best(lambda: costs_to_go(model, form_for(model, w), threads=False), 0.3)
        note = "their 0.72 s was measured elsewhere, on a busy machine, not in this run: no verdict. --authors measures here"
        yield Figure("ratio", "authors' Dijkstra as once measured / costs-to-go, N = 9", 1e3 * PUBLISHED_S[9] / ours, "x", note=note)
        return
    yield _reference(options)


def _reference(options: Options) -> Figure:
    """Somebody else's search, run in their checkout by a command that whoever compares writes (docs/sequencing.md).

    The command solves one tool. If the last line it prints ends with the number of regions and the seconds of the search alone,
    these count; if not, its wall time does, and the tool must be named (`--reference-tool`).
    """
    command = shlex.split(options.reference_command or f"{shlex.quote(sys.executable)} {ADAPTER}")
    name, place = "authors' Dijkstra / costs-to-go", options.checkout or Path.cwd()
    if options.reference_command is None and not (place / ADAPTER).exists():
        return Figure("ratio", name, 0.0, "x", 1e4, "at least", f"no {ADAPTER} in the checkout and no --reference-command: see docs")
    started = time.perf_counter()
    out = subprocess.run(command, cwd=place, capture_output=True, text=True, check=True).stdout.split()
    seconds, how = time.perf_counter() - started, "wall time of the whole command"
    problem = _named_tool(options)
    if len(out) > 1 and out[-2].isdigit():
        n, seconds, how = int(out[-2]), float(out[-1]), "seconds it printed"
        problem = problem if problem and problem.n == n else made_up(n, ())[0] if n in SHAPES else None
    if problem is None:
        return Figure("ratio", name, 0.0, "x", 1e4, "at least", "name the tool it solves: --data DIR --reference-tool real/8")
    w, model = np.ones(len(problem.columns)), model_for(problem, resolve(None, problem.n))
    shortest_sequence(problem, w)
    ours, _ = _best(lambda: costs_to_go(model, form_for(model, w), threads=False), 0.3)
    what = f"tool {options.reference_tool}" if options.reference_tool else "a made-up tool of as many regions"
    note = f"theirs {seconds:.3g} s ({how}), ours {ours:.3g} ms wall on {what}"
    return Figure("ratio", f"{name}, N = {problem.n}", 1e3 * seconds / ours, "x", 1e4, "at least", note)


def _named_tool(options: Options) -> SequencingProblem | None:
    """The tool called "real/8" or "synthetic/9" among the authors' tables."""
    if options.reference_tool is None or options.data is None:
        return None
    kind, number = options.reference_tool.split("/")
    return problem_for(read_tables("real" if kind == "real" else "synthetic", options.data)[int(number)].tool.graph, ())


def _solver() -> Iterator[Figure]:
    """A general solver proves the same optimum on its own model of the same cost."""
    if not find_spec("didppy"):
        return
    from app.benches.didp_model import solve as didp

    problem, w = made_up(12)
    started = time.process_time()
    order, proved, _ = didp(problem, w, 60.0)
    seconds = time.process_time() - started
    found = shortest_sequence(problem, w).cost
    if not proved:
        yield Figure("agreement", "didppy found no proof at N = 12 in 60 s", seconds, "s")
        return
    apart = abs(problem.cost(w, order) - found) / abs(found)
    yield Figure("agreement", "didppy's proved optimum, N = 12: difference", apart, "", 1e-9, note=f"it took {seconds:.2g} s cpu")
