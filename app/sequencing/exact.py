"""The exact search on one tool: what is prepared once for a tool, and the cheapest costs-to-go under given weights.

Prepared once and kept with the problem: the shape of the declared features, the values of sets (gaps), and a table for each
feature that declares nothing. A new w only weighs them.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numba as nb
import numpy as np
from numpy.typing import NDArray

from app.geometry.tool import Array
from app.sequencing.answer import Prepared, laid_out, weighed
from app.sequencing.block import SMALLEST, fill, fill_parallel
from app.sequencing.constraints import Resolved
from app.sequencing.features import declare
from app.sequencing.forms import BETWEEN, PLAIN, WITHIN, Declared, Form, Ints, compose
from app.sequencing.gaps import box_table, hull_gaps
from app.sequencing.problem import SequencingProblem
from app.sequencing.rows import Single
from app.sequencing.structure import Sets

THREADS_FROM = 24  # regions; below, one thread is quick enough, and two that wait for each other are slow on a busy machine
CHUNK = 1 << 14  # sets evaluated at a time
NO_TABLE = np.zeros((0, 0))


@dataclass(frozen=True)
class Limits:
    """How far the exact search goes by default."""

    regions: int = 26  # still to be ordered
    memory: float = 2.5e9  # bytes of all tables


@dataclass(frozen=True)
class Model:
    """A tool and the regions still to be ordered, ready for any weights."""

    resolved: Resolved
    prepared: Prepared
    tables: dict[int, Array]  # (N', 2^N') values of the columns without structure

    @property
    def n(self) -> int:
        return len(self.resolved.free)


def bytes_needed(problem: SequencingProblem, n: int) -> float:
    """Memory of the tables for n regions still to be ordered: costs-to-go, values of sets, undeclared columns."""
    per_set = problem.kept.get(f"bytes {n}") or _bytes_per_set(problem, n)
    problem.kept[f"bytes {n}"] = per_set
    return 2.0**n * per_set


def _bytes_per_set(problem: SequencingProblem, n: int) -> float:
    declared = compose(declare(problem.graph, problem.features), problem.n, tuple(range(problem.n)), ())
    missing = set(declared.undeclared)
    factors = [{*problem.features.factors[i.first], *problem.features.factors[i.second]} for i in problem.interactions]
    tables = len(missing) + sum(bool(missing & f) for f in factors)
    values = _tables_of(declared, whole=n == problem.n)[2]
    return 4 + 4 * values + (8 * tables + 12 * (tables > 0)) * n


def why_not_exact(problem: SequencingProblem, n: int, limits: Limits) -> str | None:
    """None when n regions can be ordered exactly, else the reason in plain words."""
    if n > limits.regions:
        return f"{n} regions are more than the {limits.regions} that are searched exactly"
    need = bytes_needed(problem, n)
    if need > limits.memory:
        return f"the exact search of {n} regions would need {need / 1e9:.1f} GB, more than the {limits.memory / 1e9:.1f} GB allowed"
    return None


def model_for(problem: SequencingProblem, resolved: Resolved) -> Model:
    """The model of what is left to be ordered; the one of the whole tool is kept."""
    whole = len(resolved.free) == problem.n and not resolved.ordered
    if whole and "model" in problem.kept:
        return problem.kept["model"]
    model = _build(problem, resolved)
    if whole:
        problem.kept["model"] = model
    return model


def _build(problem: SequencingProblem, resolved: Resolved) -> Model:
    free, n = resolved.free, len(resolved.free)
    declared = compose(declare(problem.graph, problem.features), problem.n, free, resolved.done)
    names, width = problem.features.factors, len(problem.features.columns)
    keys, pair, products, missing = [], [], [], set(declared.undeclared)
    tabled = list(declared.undeclared)
    for k, i in enumerate(problem.interactions):
        if missing & {*names[i.first], *names[i.second]}:
            tabled.append(width + k)
            continue
        keys += [key for key in dict.fromkeys((i.first, i.second)) if key not in keys]
        pair.append((keys.index(i.first) + 1, keys.index(i.second) + 1))
        products.append(width + k)
    factors = np.zeros((len(keys), width))
    for row, key in zip(factors, keys, strict=True):
        row[list(names[key])] = 1.0
    order = np.array(free, np.int64)
    bits = np.int64(1) << np.arange(n)
    before = resolved.before[np.ix_(order, order)].T.astype(np.int64) @ bits if n else np.zeros(0, np.int64)
    row, flip, count = _tables_of(declared, whole=n == problem.n)
    sets = np.empty((count, 1 << n if n >= SMALLEST else 0), np.float32)
    if n >= SMALLEST:
        _fill_sets(declared, row, flip, n, sets)
    tables = _column_tables(problem, resolved, tabled)
    empty = problem.values(np.zeros((1, problem.n), np.bool_))[0][order]
    undeclared = np.zeros(width, np.bool_)
    undeclared[list(declared.undeclared)] = True
    prepared = Prepared(
        declared.shape, undeclared, factors, np.array(pair, np.int64).reshape(-1, 2), np.array(products, np.int64), empty, before, sets,
        row, flip,
    )  # fmt: skip
    return Model(resolved, prepared, tables)


def _tables_of(declared: Declared, whole: bool) -> tuple[Ints, NDArray[np.bool_], int]:
    """Which table each value of a set is read from, whether at the unfinished set, and how many tables there are.

    A gap of the unfinished regions is the same function at the complement, so it shares a table with that of the finished
    ones as long as no region is finished or skipped before.
    """
    v, row, known = declared.shape.values, [], []
    for g in range(len(v.kind)):
        key = (
            int(v.kind[g]),
            bool(v.left[g]) and not whole,
            v.low[g].tobytes(),
            v.high[g].tobytes(),
            v.area[g].tobytes(),
            v.matrix[g].tobytes(),
        )
        if key not in known:
            known.append(key)
        row.append(known.index(key))
    return np.array(row, np.int64), v.left.copy(), len(known)


def sets_of(resolved: Resolved, n: int, total: int) -> Iterator[tuple[slice, Sets]]:
    """All sets of finished regions (M, total) in the order of their bit masks, a chunk at a time."""
    free = np.array(resolved.free, np.int64)
    for start in range(0, 1 << n, CHUNK):
        masks = np.arange(start, min(start + CHUNK, 1 << n))
        done = np.zeros((len(masks), total), np.bool_)
        done[:, list(resolved.done)] = True
        done[:, free] = (masks[:, None] >> np.arange(n)) & 1
        yield slice(start, start + len(masks)), done


def _fill_sets(declared: Declared, row: Ints, flip: NDArray[np.bool_], n: int, out: Single) -> None:
    v = declared.shape.values
    filled: set[int] = set()
    for g in range(len(row)):
        if row[g] not in filled:
            filled.add(int(row[g]))
            # of the unfinished set: bits stand for unfinished regions, skipped ones are always in, finished ones never
            base = ~v.done if flip[g] else v.done
            inside = base.copy()
            inside[v.free] = False
            _value_table(v.kind[g], v.low[g], v.high[g], v.area[g], v.matrix[g], inside, v.free, out[row[g]])


def _value_table(
    kind: int, low: Array, high: Array, area: Array, matrix: Array, always: NDArray[np.bool_], free: Ints, out: Single
) -> None:
    n = len(free)
    if kind in (WITHIN, PLAIN):
        box_table(low, high, area, kind == PLAIN, always, free, out)
        return
    for start in range(0, 1 << n, CHUNK):
        masks = np.arange(start, min(start + CHUNK, 1 << n))
        inside = np.repeat(always[None, :], len(masks), axis=0)
        inside[:, free] = (masks[:, None] >> np.arange(n)) & 1
        if kind == BETWEEN:
            member = inside.astype(np.float64)
            out[masks] = (member @ matrix * (1 - member)).sum(axis=1)
        else:
            out[masks] = hull_gaps(inside, low, high, area)


def _column_tables(problem: SequencingProblem, resolved: Resolved, columns: list[int]) -> dict[int, Array]:
    n = len(resolved.free)
    tables = {c: np.empty((n, 1 << n)) for c in columns}
    if columns:
        for where, done in sets_of(resolved, n, problem.n):
            values = problem.values(done)[:, list(resolved.free)]
            for c in columns:
                tables[c][:, where] = values[..., c].T
    return tables


def extra_costs(model: Model, w: Array) -> Array:
    """What the columns without structure add to each transition, (N', 2^N'); (0, 0) without any."""
    return np.ascontiguousarray(sum(w[c] * table for c, table in model.tables.items())) if model.tables else NO_TABLE


def form_for(model: Model, w: Array) -> Form:
    """The model's cost under weights w (n + m,)."""
    return weighed(model.prepared, w.copy(), extra_costs(model, w))


def parallel_is_safe() -> bool:
    """Whether several threads of this process may use numba's threads at once; its own fallback can't."""
    try:
        import numba.np.ufunc.omppool  # noqa: F401
    except ImportError:
        return False
    return nb.config.NUMBA_NUM_THREADS > 1  # type: ignore[attr-defined]


def uses_threads(n: int) -> bool:
    """Whether costs-to-go of n regions are worked out by several threads."""
    return n >= THREADS_FROM and parallel_is_safe()


def costs_to_go(model: Model, form: Form, threads: bool | None = None) -> Single:
    """V of every state, (2^N',) in single precision; at least SMALLEST regions. V of the empty state is left to `nearly`."""
    rows, v = laid_out(model.prepared, form), np.empty(1 << model.n, np.float32)
    if uses_threads(model.n) if threads is None else threads:
        fill_parallel(rows, model.prepared.sets, v)
    else:
        fill(rows, model.prepared.sets, v)
    return v
