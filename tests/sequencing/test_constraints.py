"""Wishes that can't hold together are named; those that can are turned into precedence pairs."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.errors import ContradictoryConstraints, InvalidInput
from app.sequencing.constraints import Constraints, check_order, resolve, shortest_cycle

pairs = st.lists(st.tuples(st.integers(0, 4), st.integers(0, 4)).filter(lambda p: p[0] != p[1]), max_size=6)


@pytest.mark.parametrize(
    ("wishes", "words"),
    [
        (Constraints(before=((0, 1), (1, 2), (2, 0))), "No order can have A before B, B before C and C before A"),
        (Constraints(before=((0, 1), (1, 2), (2, 3), (3, 0), (2, 1))), "No order can have B before C and C before B"),
        (Constraints(before=((0, 1),), first=1), "No order can have A before B and B first"),
        (Constraints(before=((0, 1),), last=0), "No order can have A before B and A last"),
        (Constraints(first=2, last=2), "No order can have C last and C first"),
        (Constraints(before=(((0, 1), (2, 3)), (3, 1))), "No order can have B before D and D before B"),
        (Constraints(before=((1, 1),)), "B can't come before itself"),
        (Constraints(first=1, skip=(1,)), "B can't be first and be skipped"),
        (Constraints(before=((0, 1),), done=(1,)), "A before B can't hold: B is finished already, and A is not finished yet"),
        (Constraints(before=((0, 1),), done=(1, 0)), "B is finished already, and A was finished after it"),
        (Constraints(never_next=((0, 1),), done=(0, 1)), "they were finished in that order"),
        (Constraints(first=3, done=(0,)), "D first can't hold: A is finished already, and D is not finished yet"),
        (Constraints(skip=(0, 1, 2, 3, 4)), "Every region is to be skipped"),
        (Constraints(skip=(2,), done=(2,)), "C can't be finished already and be skipped"),
    ],
)
def test_contradictions_are_named(wishes: Constraints, words: str):
    with pytest.raises(ContradictoryConstraints, match=words):
        resolve(wishes, 5)


def test_names_are_the_users_own():
    with pytest.raises(ContradictoryConstraints, match="Rim before Floor and Floor before Rim"):
        resolve(Constraints(before=((0, 1), (1, 0))), 2, ["Rim", "Floor"])


def test_regions_that_are_not_there():
    with pytest.raises(InvalidInput, match="number 7; this tool has 5"):
        resolve(Constraints(skip=(7,)), 5)
    with pytest.raises(InvalidInput, match="B is listed twice among the skipped"):
        resolve(Constraints(skip=(1, 1)), 5)


@given(pairs)
@settings(deadline=None)
def test_refused_exactly_when_no_order_exists(before: list[tuple[int, int]]):
    possible = [o for o in itertools.permutations(range(5)) if all(o.index(a) < o.index(b) for a, b in before)]
    try:
        resolved = resolve(Constraints(before=tuple(before)), 5)
    except ContradictoryConstraints:
        assert not possible
    else:
        assert possible == [o for o in itertools.permutations(range(5)) if not check_order(o, resolved)]


@given(pairs)
@settings(deadline=None)
def test_cycle_is_one_and_none_is_shorter(before: list[tuple[int, int]]):
    matrix = np.zeros((5, 5), np.bool_)
    for a, b in before:
        matrix[a, b] = True
    cycle = shortest_cycle(matrix)
    assert all(matrix[a, b] for a, b in zip(cycle, cycle[1:] + cycle[:1], strict=True))
    power, steps = matrix.astype(int), 1
    while steps <= 5 and not np.trace(power):
        power, steps = (power @ matrix > 0).astype(int), steps + 1
    assert len(cycle) == (steps if steps <= 5 else 0)
