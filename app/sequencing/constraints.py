"""What an order must respect besides being cheap: precedence, fixed ends, forbidden neighbours, skipped and finished regions.

Everything but `never_next` says which regions must be finished before a region may start, so the state graph only loses
transitions. `never_next` depends on the region worked on last.
"""

from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from app.errors import ContradictoryConstraints, InvalidInput
from app.geometry.tool import region_letters

Group = int | tuple[int, ...]
Edges = dict[tuple[int, int], str]  # (a, b): a must come before b, and the wish behind it in plain words


@dataclass(frozen=True)
class Constraints:
    """Wishes about the order of one tool's regions."""

    before: tuple[tuple[Group, Group], ...] = ()  # every region of the first group before every one of the second
    first: int | None = None
    last: int | None = None
    never_next: tuple[tuple[int, int], ...] = ()  # (a, b): b never directly after a
    skip: tuple[int, ...] = ()  # left undone for good
    done: tuple[int, ...] = ()  # finished already, in this order

    def __bool__(self) -> bool:
        return self != Constraints()


@dataclass(frozen=True)
class Resolved:
    """Constraints without contradiction, per region."""

    before: NDArray[np.bool_]  # (N, N) [a, b]: a must come before b; both free
    never_next: NDArray[np.bool_]  # (N, N) [a, b]: b must not follow a directly
    free: tuple[int, ...]  # regions still to be ordered
    skip: tuple[int, ...]
    done: tuple[int, ...]  # in the order of work

    @cached_property
    def ordered(self) -> bool:
        """Some region must come before another."""
        return bool(self.before.any())

    @cached_property
    def parted(self) -> bool:
        """Some region must not follow another directly."""
        return bool(self.never_next.any())


def resolve(constraints: Constraints | None, n: int, names: Sequence[str] | None = None) -> Resolved:
    """Check the wishes against each other.

    Args:
        constraints: The wishes; None for none.
        n: Number of regions of the tool.
        names: What messages call the regions; letters by default.

    Raises:
        InvalidInput: A region that is not there, or named twice where once is meant.
        ContradictoryConstraints: Names the smallest set of wishes that can't hold together.
    """
    if constraints is None:
        return _unconstrained(n)
    c, called = constraints, tuple(names or region_letters(n))
    _check_regions(c, n, called)
    out = {*c.skip, *c.done}
    free = tuple(a for a in range(n) if a not in out)
    if not free and not c.done:
        raise ContradictoryConstraints("Every region is to be skipped; leave at least one to work on.")
    edges = _edges(c, n, called)
    _against_the_past(c, edges, free, called)
    before = np.zeros((n, n), np.bool_)
    for a, b in edges:
        before[a, b] = a in free and b in free
    cycle = shortest_cycle(before)
    if cycle:
        wishes = list(dict.fromkeys(edges[pair] for pair in zip(cycle, (*cycle[1:], cycle[0]), strict=True)))
        raise ContradictoryConstraints(f"No order can have {listed(wishes)}. Take one of these away.")
    never = np.zeros((n, n), np.bool_)
    for a, b in c.never_next:
        never[a, b] = True
    return Resolved(before, never, free, c.skip, c.done)


@lru_cache(maxsize=128)
def _unconstrained(n: int) -> Resolved:
    nothing = np.zeros((n, n), np.bool_)
    nothing.flags.writeable = False
    return Resolved(nothing, nothing, tuple(range(n)), (), ())


def check_order(order: Sequence[int], resolved: Resolved) -> list[tuple[int, int]]:
    """Pairs (a, b) of a sequence that break a wish: b stands before a although a must come before, or directly after a."""
    place = {a: i for i, a in enumerate(order)}
    wrong = [(int(a), int(b)) for a, b in np.argwhere(resolved.before) if place[int(a)] > place[int(b)]]
    return wrong + [(a, b) for a, b in pairwise(order) if resolved.never_next[a, b]]


def _check_regions(c: Constraints, n: int, called: tuple[str, ...]) -> None:
    ends = [a for a in (c.first, c.last) if a is not None]
    pairs = [a for pair in c.before for group in pair for a in members(group)] + [a for pair in c.never_next for a in pair]
    for a in (*ends, *pairs, *c.skip, *c.done):
        if not 0 <= a < n:
            raise InvalidInput(f"There is no region number {a}; this tool has {n} regions, numbered 0 to {n - 1}.")
    for regions, word in ((c.skip, "skipped"), (c.done, "finished")):
        twice = next((a for a in regions if regions.count(a) > 1), None)
        if twice is not None:
            raise InvalidInput(f"{called[twice]} is listed twice among the {word} regions; list it once.")
    both = sorted({*c.skip} & {*c.done})
    if both:
        raise ContradictoryConstraints(f"{called[both[0]]} can't be finished already and be skipped as well.")


def members(group: Group) -> tuple[int, ...]:
    """The regions of a group; one region is a group of one."""
    return (group,) if isinstance(group, int) else tuple(group)


def _edges(c: Constraints, n: int, called: tuple[str, ...]) -> Edges:
    """Precedence pairs with the wish behind each; the user's own pairs win over those that fixed ends bring."""
    edges: Edges = {}
    kept = [a for a in range(n) if a not in c.skip]
    for first, second in c.before:
        for a in members(first):
            for b in members(second):
                edges.setdefault((a, b), f"{called[a]} before {called[b]}")
    for end, word in ((c.first, "first"), (c.last, "last")):
        if end is None:
            continue
        if end in c.skip:
            raise ContradictoryConstraints(f"{called[end]} can't be {word} and be skipped as well.")
        for b in kept:
            if b != end:
                edges.setdefault((end, b) if word == "first" else (b, end), f"{called[end]} {word}")
    return edges


def _against_the_past(c: Constraints, edges: Edges, free: tuple[int, ...], called: tuple[str, ...]) -> None:
    """Finished regions can't be moved any more."""
    place = {a: i for i, a in enumerate(c.done)}
    for (a, b), wish in edges.items():
        if a == b and a not in c.skip:
            raise ContradictoryConstraints(f"{called[a]} can't come before itself.")
        if b in place and (a in free or (a in place and place[a] > place[b])):
            when = "not finished yet" if a in free else "was finished after it"
            raise ContradictoryConstraints(
                f"{wish} can't hold: {called[b]} is finished already, and {called[a]} {'is ' * (a in free)}{when}."
            )
    for a, b in c.never_next:
        if a in place and b in place and place[b] == place[a] + 1:
            raise ContradictoryConstraints(f"{called[b]} never directly after {called[a]} can't hold: they were finished in that order.")


def shortest_cycle(before: NDArray[np.bool_]) -> tuple[int, ...]:
    """The fewest regions each of which must come before the next, and the last before the first; empty without a cycle."""
    best: tuple[int, ...] = ()
    for start in range(len(before)):
        found = _way_back(before, start)
        if found and (not best or len(found) < len(best)):
            best = found
    return best


def _way_back(before: NDArray[np.bool_], start: int) -> tuple[int, ...]:
    origin, queue = {start: -1}, deque([start])
    while queue:
        a = queue.popleft()
        for b in np.flatnonzero(before[a]).tolist():
            if b == start:
                return tuple(_trail(origin, a))[::-1]
            if b not in origin:
                origin[b] = a
                queue.append(b)
    return ()


def _trail(origin: dict[int, int], a: int) -> Iterator[int]:
    while a >= 0:
        yield a
        a = origin[a]


def listed(words: Sequence[str]) -> str:
    """'x, y and z'."""
    return ", ".join(words[:-1]) + " and " + words[-1] if len(words) > 1 else words[0]
