"""What every feature must keep to, built-in or an engineer's own, and the checker that says where one doesn't.

A feature is a function of a tool's region graph and of sets of finished regions. Learning compares weights of features,
and sequencing evaluates them set by set in any order, so a feature has to be finite, within its bounds, the same every time
it is asked, the same whatever else is asked with it, and the same whatever the regions are called.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from app.geometry.tool import Array, RegionGraph
from app.sequencing.structure import Plugin, Sets

SETS_TRIED = 64  # per tool, of random sizes, besides the empty one and those with one region left
SEED = 20230529
EVEN = 1e-9  # values this close are the same


def contract_faults(values: Plugin, graphs: Sequence[RegionGraph], bounds: tuple[float, float] | None = (0.0, 1.0)) -> tuple[str, ...]:
    """Where a feature breaks the contract, in plain sentences; empty when it keeps to it.

    Args:
        values: (graph, done (M, N)) -> (M, N) value of doing region a next after each set; meaningless where a is done.
        graphs: Tools to try it on.
        bounds: Least and largest value allowed; None for a feature that is only finite (the authors' own units).

    Returns:
        One sentence per rule that is broken, naming the tool (counted from 1) and the value.
    """
    for number, graph in enumerate(graphs, 1):
        faults = _faults_on(values, graph, bounds)
        if faults:
            return tuple(f"On tool {number} of {len(graphs)}: {fault}" for fault in faults)
    return ()


def sets_to_try(n: int) -> Sets:
    """The empty set, every set with one region left, and random sets of all sizes."""
    generator = np.random.default_rng([SEED, n])
    chance = generator.random((SETS_TRIED, 1))
    some = generator.random((SETS_TRIED, n)) < chance
    some[some.all(axis=1), 0] = False
    return np.concatenate([np.zeros((1, n), np.bool_), ~np.eye(n, dtype=np.bool_), some])


def renumbered(graph: RegionGraph, order: NDArray[np.int64]) -> RegionGraph:
    """The same tool with region order[i] called i."""
    back = np.empty_like(order)
    back[order] = np.arange(len(order))
    square = {name: getattr(graph, name)[np.ix_(order, order)] for name in ("shared", "opposite", "angle", "neighbour", "corner")}
    plain = {name: getattr(graph, name)[order] for name in ("curvature", "height", "area", "low", "high")}
    first = graph.first[order]
    return replace(graph, **square, **plain, first=np.where(first >= 0, back[np.maximum(first, 0)], -1))


def _faults_on(values: Plugin, graph: RegionGraph, bounds: tuple[float, float] | None) -> list[str]:
    done = sets_to_try(graph.n)
    try:
        own = values(frozen(graph), _read_only(done))
    except Exception as error:  # noqa: BLE001 - an engineer's own code may fail in any way; the sentence says how
        return [f"it stopped with {type(error).__name__}: {error}"]
    if not isinstance(own, np.ndarray) or own.shape != done.shape or own.dtype.kind not in "fiub":
        what = f"{own.dtype} of shape {own.shape}" if isinstance(own, np.ndarray) else type(own).__name__
        return [f"it must return numbers of shape {done.shape}, one per set and region, and returned {what}."]
    own = own.astype(np.float64)
    open_ = ~done
    if not np.isfinite(own[open_]).all():
        m, a = _where(~np.isfinite(own) & open_)
        return [f"{own[m, a]} is no finite number (region {a} after {int(done[m].sum())} finished ones)."]
    faults = []
    if bounds is not None and (own[open_].min() < bounds[0] - EVEN or own[open_].max() > bounds[1] + EVEN):
        m, a = _where(open_ & ((own < bounds[0] - EVEN) | (own > bounds[1] + EVEN)))
        faults.append(
            f"values must lie between {bounds[0]:g} and {bounds[1]:g}, "
            f"and region {a} has {own[m, a]:g} after {int(done[m].sum())} finished ones."
        )
    return faults + _unsteady(values, graph, done, own)


def _unsteady(values: Plugin, graph: RegionGraph, done: Sets, own: Array) -> list[str]:
    """Faults of a feature that answers differently when asked differently."""
    open_, size = ~done, np.abs(own).max(initial=1.0)

    def differs(again: Array, expected: Array, where: NDArray[np.bool_]) -> bool:
        return again.shape != expected.shape or not np.allclose(again[where], expected[where], rtol=0, atol=EVEN * size)

    faults = []
    if differs(values(frozen(graph), _read_only(done)), own, open_):
        faults.append("it gave other values when asked a second time; a feature may not draw random numbers or remember anything.")
    one = np.concatenate([values(frozen(graph), _read_only(done[m : m + 1])) for m in range(len(done))])
    if differs(one, own, open_):
        faults.append("a set's values changed with the other sets asked in the same call; each row must depend on its own set only.")
    order = np.random.default_rng([SEED, graph.n, 1]).permutation(graph.n)
    if differs(values(frozen(renumbered(graph, order)), _read_only(done[:, order])), own[:, order], open_[:, order]):
        faults.append("values changed when the regions were numbered differently; a feature may use what a region is, not its number.")
    return faults


def frozen(graph: RegionGraph) -> RegionGraph:
    """A copy that can't be written to, so that a feature can't change the tool."""
    return replace(graph, **{name: _read_only(value) for name, value in vars(graph).items() if isinstance(value, np.ndarray)})


def _read_only(values: NDArray) -> NDArray:
    copy = values.copy()
    copy.flags.writeable = False
    return copy


def _where(mask: NDArray[np.bool_]) -> tuple[int, int]:
    m, a = np.argwhere(mask)[0]
    return int(m), int(a)
