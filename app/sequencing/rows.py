"""The cost of a transition cut along the bits of a state, the way the block kernel (`block`) reads it.

    bits of a state:   top | middle | low          low: LOW bits, so LANES states lie side by side

A sum over the finished regions is what its top, its middle and its low regions add, so three short tables stand for one of
2^N rows. Which test of a cascade is passed first is the lesser of what the high and what the low regions pass.
"""

# pyright: reportArgumentType=false
# Compiled code: the checker takes elements of arrays for numpy's own scalars.

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.geometry.compiled import kernel
from app.geometry.tool import Array
from app.sequencing.forms import Form, Ints

Single = NDArray[np.float32]
LOW = 7  # bits of a block
LANES = 1 << LOW


class Rows(NamedTuple):
    """A form laid out: what the high bits add, and what the lanes add."""

    middle: Single  # (F, 2^m, N) change by the regions of the middle bits
    top: Single  # (F, 2^t, N) start, and change by those of the topmost bits
    lane: Single  # (F, N, K, LANES) change and touch of the lanes; K levels that the high bits reach; infinite: not allowed yet
    sum_middle: Single  # (Q, 2^m) what means are taken of
    sum_top: Single  # (Q, 2^t)
    sum_lane: Single  # (Q, LANES)
    tests: Ints  # (U, 3, N) bit masks of the regions that pass a test for a
    reached: Ints  # (U, N)
    before: Ints  # (N,)
    own: Single  # (T, N) T at least 2, padded with zeros
    of: Ints  # (T,)
    slope: Single  # (F, T)
    drift: Single  # (F, Q)
    ranked: NDArray[np.bool_]  # (F,)
    rank: Single  # (F, N + 1, N) one more row, for the full set
    state: Single  # (F, G)
    row: Ints  # (G,) row of the table of set values
    flip: NDArray[np.bool_]  # (G,) read at the unfinished set
    stated: NDArray[np.bool_]  # (F,) depends on values of the state
    pair: Ints  # (P, 2)
    weight: Single  # (P,)
    ones: Ints  # (LANES,) regions of each lane
    share: Single  # (N - LOW + 1, LANES) 1 / number finished, by the number of high regions
    extra: Single  # (N, 2^N) or (0, 0)


@kernel(nogil=True)
def lay_out(form: Form, middle_bits: int, top_bits: int, row: Ints, flip: NDArray[np.bool_]) -> Rows:
    """Tables of what the topmost, the middle and the low bits add."""
    middle, top = _high_changes(form, middle_bits, top_bits)
    sums = _sums(form.averaged, 0, LOW), _sums(form.averaged, LOW, middle_bits), _sums(form.averaged, LOW + middle_bits, top_bits)
    tests = _masks(form.tests)
    own, of, slope = _two_at_least(form)
    ones, share = _counts(form)
    f, n = form.start.shape
    rank = np.zeros((f, n + 1, n), np.float32)
    rank[:, :n] = form.rank
    ranked, stated = np.zeros(f, np.bool_), np.zeros(f, np.bool_)
    for i in range(f):
        ranked[i] = (form.rank[i] != 0).any()
        stated[i] = (form.state[i] != 0).any() or (form.drift[i] != 0).any()
    for k in range(len(form.total)):
        sums[2][k] += np.float32(form.total[k])
    return Rows(
        middle, top, _lanes(form, tests), sums[1], sums[2], sums[0], tests, form.reached, form.before, own, of, slope,
        form.drift.astype(np.float32), ranked, rank, form.state.astype(np.float32), row, flip, stated, form.pair,
        form.weight.astype(np.float32), ones, share, form.extra.astype(np.float32),
    )  # fmt: skip


@kernel(nogil=True)
def _high_changes(form: Form, middle_bits: int, top_bits: int) -> tuple[Single, Single]:
    f, n = form.start.shape
    middle, top = np.zeros((f, 1 << middle_bits, n), np.float32), np.zeros((f, 1 << top_bits, n), np.float32)
    for i in range(f):
        top[i, 0] = form.start[i]
        for out, first, bits in ((middle[i], LOW, middle_bits), (top[i], LOW + middle_bits, top_bits)):
            for k in range(bits):
                for s in range(1 << k):
                    for a in range(n):
                        out[(1 << k) | s, a] = out[s, a] + np.float32(form.change[i, a, first + k])
    return middle, top


@kernel(nogil=True)
def _sums(values: Array, first: int, bits: int) -> Single:
    """out[q, s] = the sum of values[q, first + k] over the bits k of s."""
    out = np.zeros((len(values), 1 << bits), np.float32)
    for q in range(len(values)):
        for k in range(bits):
            for s in range(1 << k):
                out[q, (1 << k) | s] = out[q, s] + np.float32(values[q, first + k])
    return out


@kernel(nogil=True)
def _masks(tests: NDArray[np.bool_]) -> Ints:
    """[u, k, a] the regions that pass test k of cascade u for region a, as bits."""
    u, k, n, _ = tests.shape
    out = np.zeros((u, k, n), np.int64)
    for i in range(u):
        for j in range(k):
            for a in range(n):
                for b in range(n):
                    out[i, j, a] |= np.int64(tests[i, j, a, b]) << b
    return out


@kernel(nogil=True)
def _lanes(form: Form, tests: Ints) -> Single:
    """What the low regions add, for every level that the high ones may reach (two bits of k per cascade)."""
    f, n = form.start.shape
    u = len(tests)
    lane, touch = np.empty((f, n, 4**u, LANES), np.float32), form.touch.astype(np.float32)
    passed, own = np.empty(LANES, np.int64), np.empty(LANES, np.float32)
    for a in range(n):
        plain = _sums(form.change[:, a], 0, LOW)
        for i in range(f):
            for k in range(4**u):
                for x in range(LANES):
                    lane[i, a, k, x] = plain[i, x]
        for j in range(u):
            _passed_by_lanes(tests, j, a, passed)
            for i in range(f):
                if (touch[i, j] != 0).any():
                    for x in range(LANES):
                        own[x] = touch[i, j, passed[x]]
                    for k in range(4**u):
                        level = k >> (2 * j) & 3
                        for x in range(LANES):
                            lane[i, a, k, x] += touch[i, j, level] if passed[x] > level else own[x]
        if form.before[a] & (LANES - 1):
            for x in range(LANES):
                if form.before[a] & (LANES - 1) & ~x:
                    lane[0, a, :, x] = np.inf
    return lane


@kernel(nogil=True)
def _passed_by_lanes(tests: Ints, u: int, a: int, passed: Ints) -> None:
    """The first test of cascade u that the regions of each lane pass for a."""
    passed[0] = tests.shape[1]
    for b in range(LOW):
        alone = first_passed(tests, u, a, 1 << b, tests.shape[1])
        for x in range(1 << b):
            passed[(1 << b) | x] = min(passed[x], alone)


@kernel(nogil=True, inline="always")
def first_passed(tests: Ints, u: int, a: int, regions: int, otherwise: int) -> int:
    """The first test of cascade u before `otherwise` that some of the regions passes for a."""
    level = otherwise
    for k in range(otherwise):
        if tests[u, k, a] & regions:
            level = k
            break
    return level


@kernel(nogil=True)
def _two_at_least(form: Form) -> tuple[Single, Ints, Single]:
    """Distances from means, padded to two, which the kernel takes in one go."""
    count, (f, n) = len(form.of), form.start.shape
    t = max(2, count)
    own, of, slope = np.zeros((t, n), np.float32), np.zeros(t, np.int64), np.zeros((f, t), np.float32)
    own[:count], of[:count], slope[:, :count] = form.own, form.of, form.slope
    return own, of, slope


@kernel(nogil=True)
def _counts(form: Form) -> tuple[Ints, Single]:
    """Regions of each lane, and 1 / number of finished regions by the number of high ones."""
    n = form.start.shape[1]
    ones, share = np.empty(LANES, np.int64), np.empty((n - LOW + 1, LANES), np.float32)
    for x in range(LANES):
        ones[x] = count_bits(x)
    inverse = np.float32(1) / np.maximum(form.count + np.arange(n + LOW + 1), 1).astype(np.float32)
    for above in range(len(share)):
        for x in range(LANES):
            share[above, x] = inverse[above + ones[x]]
    return ones, share


@kernel(inline="always")
def count_bits(x: int) -> int:
    n = 0
    while x:
        x &= x - 1
        n += 1
    return n
