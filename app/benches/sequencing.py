"""`apprentice bench sequencing`: seconds and memory of the exact search, equality of its paths, and ratios to other methods."""

import itertools
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from importlib.util import find_spec

import networkx as nx
import numpy as np

from app.benches.figures import Figure, Options
from app.geometry.tool import Array, RegionGraph
from app.sequencing import kernels
from app.sequencing.classes import best_classes
from app.sequencing.constraints import resolve
from app.sequencing.exact import THREADS_FROM, bytes_needed, costs_to_go, form_for, model_for, parallel_is_safe
from app.sequencing.problem import SequencingProblem, problem_for
from app.sequencing.shortest import shortest_sequence

SHAPES = {7: (1, 7), 8: (2, 4), 9: (3, 3), 12: (3, 4), 16: (4, 4), 20: (4, 5), 24: (4, 6), 26: (2, 13), 28: (4, 7)}
BARS_MS = {12: 0.1, 20: 8.0, 24: 300.0, 26: 1500.0}
MOST_BYTES = 2.5e9  # at N = 28
PUBLISHED_S = {9: 0.72, 10: 3.7}  # the authors' Dijkstra, best of contended runs on another day: the study of sequencing, 2.1


def measure(options: Options) -> Iterator[Figure]:
    """Everything about the exact search; what lies beyond 2^N comes from its own module."""
    sizes = (12, 16) if options.quick else (12, 16, 20, 24, 26)
    for n in sizes:
        yield from _solves(n, (), "separable", bars=True)
        yield from _solves(n, None, "with two interactions", bars=False)
    yield from _memory(options.quick)
    yield from _agreement(options.quick)
    yield from _first_call()
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
    """Least wall and least processor milliseconds of as many repeats as fit, at least three."""
    wall, cpu, started = [], [], time.perf_counter()
    while len(wall) < 3 or (time.perf_counter() - started < seconds and len(wall) < 300):
        w, c = time.perf_counter(), time.process_time()
        call()
        wall.append(time.perf_counter() - w)
        cpu.append(time.process_time() - c)
    return 1e3 * min(wall), 1e3 * min(cpu)


def _solves(n: int, interactions: tuple[()] | None, words: str, bars: bool) -> Iterator[Figure]:
    """One solve: costs-to-go under new weights, and the whole answer; both by the wall clock on the threads the product uses."""
    problem, w = made_up(n, interactions)
    started = time.process_time()
    model = model_for(problem, resolve(None, n))
    prepared = 1e3 * (time.process_time() - started)
    costs_to_go(model, form_for(model, w))  # threads started, buffers touched
    group, bar = f"exact, {words}", BARS_MS.get(n) if bars else None
    one_wall, one = _best(lambda: costs_to_go(model, form_for(model, w), threads=False), 0.5)
    two = n >= THREADS_FROM and parallel_is_safe()
    wall = _best(lambda: costs_to_go(model, form_for(model, w)), 0.5)[0] if two else one_wall
    threads = "two threads" if two else "one thread, as the product does at this size"
    note = f"wall, {threads}; one thread: {one:.3g} ms cpu, {one_wall:.3g} ms wall"
    yield Figure(group, f"N = {n}, costs-to-go, new weights", wall, "ms", bar, note=note)
    whole, cpu = _best(lambda: shortest_sequence(problem, w), 0.5)
    note = f"wall, {threads}; {cpu:.3g} ms cpu of all threads"
    yield Figure(group, f"N = {n}, with sequence, ties and float64 cost", whole, "ms", bar, note=note)
    if two:
        yield Figure(group, f"N = {n}, speed-up of 2 threads", one_wall / wall, "x", note="wall against wall; a busy machine lowers it")
    yield Figure(group, f"N = {n}, tables of the tool, once (cpu)", prepared, "ms")
    if n == 20 and not bars:
        _, classes = _best(lambda: best_classes(problem, w, 10), 0.5)
        yield Figure(group, "N = 20, ten best cost classes, counted (cpu)", classes, "ms")


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
    """Tables as computed at N = 28; a process of its own that solves N = 26, as the system counts it."""
    problem, _ = made_up(28)
    note = "computed from the arrays allocated; not run here"
    yield Figure("memory", "N = 28, all tables", bytes_needed(problem, 28) / 1e9, "GB", MOST_BYTES / 1e9, note=note)
    if quick:
        return
    out = subprocess.run([sys.executable, "-c", LARGEST, "26"], capture_output=True, text=True, check=True).stdout.split()
    before, most = (1024 * float(x) / 1e9 for x in out)
    computed = bytes_needed(made_up(26)[0], 26) / 1e9
    note = f"most resident memory of a process; {before:.2g} GB of it before the solve; tables computed as {computed:.2g} GB"
    yield Figure("memory", "N = 26, one solve, measured", most, "GB", note=note)


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
import time
started = time.perf_counter()
from app.sequencing.warming import warm_up
loaded = time.perf_counter()
warm_up()
warm = time.perf_counter()
import numpy as np
from app.benches.sequencing import made_up
from app.sequencing.shortest import shortest_sequence
problem, w = made_up(12)
begin = time.perf_counter()
shortest_sequence(problem, w)
print(loaded - started, warm - loaded, time.perf_counter() - begin)
"""


def _first_call() -> Iterator[Figure]:
    """A fresh process with the compiled kernels on disk, as a worker after the first start ever."""
    out = subprocess.run([sys.executable, "-c", FIRST], capture_output=True, text=True, check=True).stdout.split()
    yield Figure(
        "first call",
        "fresh process: warm-up of the worker, before anybody waits",
        float(out[1]),
        "s",
        note=f"imports {float(out[0]):.2g} s",
    )
    yield Figure("first call", "fresh process: first solve after it, N = 12", 1e3 * float(out[2]), "ms", note="tables of the tool included")


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
    if options.checkout is None:
        problem, w = made_up(9)
        model = model_for(problem, resolve(None, 9))
        _, ours = _best(lambda: costs_to_go(model, form_for(model, w), threads=False), 0.3)
        note = "their 0.72 s was measured elsewhere, on a busy machine, not in this run: no verdict. --checkout measures here"
        yield Figure("ratio", "authors' Dijkstra as once measured / costs-to-go, N = 9", 1e3 * PUBLISHED_S[9] / ours, "x", note=note)
        return
    yield _checkout(options)


def _checkout(options: Options) -> Figure:
    """Their code through `apprentice_adapter.py`, a file that whoever compares puts into the checkout (docs/sequencing.md).

    It is run there and prints two numbers: regions of the tool it solved, and seconds of their Dijkstra.
    """
    assert options.checkout is not None
    adapter = options.checkout / "apprentice_adapter.py"
    if not adapter.exists():
        return Figure("ratio", "authors' Dijkstra / costs-to-go", 0.0, "x", 1e4, "at least", f"no {adapter.name} in the checkout: see docs")
    out = subprocess.run([sys.executable, adapter.name], cwd=options.checkout, capture_output=True, text=True, check=True).stdout.split()
    n, seconds = int(out[-2]), float(out[-1])
    problem, w = made_up(n)
    model = model_for(problem, resolve(None, n))
    _, ours = _best(lambda: costs_to_go(model, form_for(model, w), threads=False), 0.3)
    return Figure(
        "ratio", f"authors' Dijkstra / costs-to-go, N = {n}", 1e3 * seconds / ours, "x", 1e4, "at least", f"theirs {seconds:.3g} s"
    )


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
