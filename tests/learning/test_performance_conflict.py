"""Blame for a contradiction, against a made-up table of what contradicts what; and its words."""

from itertools import combinations

from app.learning.performance_conflict import Contradiction, Members, contradiction_words, find_contradiction

NAMES = ["Trough 01", "Trough 02", "Trough 03", "Trough 04"]


def fits(*conflicts: set[int]):
    """What is left unexplained: one for each conflict that lies wholly within the members."""

    def excess(members: Members) -> float:
        return float(sum(conflict <= set(members) for conflict in conflicts))

    return excess


def test_no_conflict_is_none():
    assert find_contradiction(4, fits()) is None


def test_the_one_in_every_conflict_is_odd():
    found = find_contradiction(4, fits({0, 3}, {1, 3}, {2, 3}))
    assert found == Contradiction((3,), clear=True, alone=False, rest=True)


def test_one_impossible_by_itself():
    assert find_contradiction(4, fits({2})) == Contradiction((2,), clear=True, alone=True, rest=True)
    assert find_contradiction(1, fits({0})) == Contradiction((0,), clear=True, alone=True, rest=False)


def test_a_pair_leaves_open_which():
    assert find_contradiction(4, fits({1, 3})) == Contradiction((1, 3), clear=False, alone=False, rest=True)


def test_two_odd_ones_are_both_found():
    """No single one is enough; without the two all fit, and no other pair does that."""
    table = fits({0, 2}, {0, 3}, {1, 2}, {1, 3}, {0}, {1})
    found = find_contradiction(4, table)
    assert found is not None
    assert found.odd == (0, 1)
    assert [pair for pair in combinations(range(4), 2) if table(pair) == 0] == [(2, 3)]


def test_words_name_who_and_what_to_do():
    odd = contradiction_words(Contradiction((3,), clear=True, alone=False, rest=True), NAMES)
    assert odd.startswith("Trough 04 contradicts Trough 01, Trough 02 and Trough 03:")
    assert "Record Trough 04 again, or use the best compromise, which follows the others." in odd
    pair = contradiction_words(Contradiction((0, 1), clear=False, alone=False, rest=True), NAMES)
    assert pair.startswith("Trough 01 and Trough 02 contradict each other")
    assert "Record Trough 01 or Trough 02 again" in pair
    alone = contradiction_words(Contradiction((0,), clear=True, alone=True, rest=False), ["demonstration 1"])
    assert alone.startswith("Demonstration 1 can't be explained")
    assert alone.endswith("Record demonstration 1 again, or use the best compromise.")


def test_many_names_are_counted():
    names = [f"Trough {k:02d}" for k in range(1, 9)]
    words = contradiction_words(Contradiction((7,), clear=True, alone=False, rest=True), names)
    assert words.startswith("Trough 08 contradicts the other 7: no weights")


def test_one_that_was_suspected_first_is_cleared_again():
    """0 is in the most conflicts and goes first, then 1 and 2; but without 1, 2 and 3 it fits, so it is not named."""
    table = fits({0, 1}, {0, 2}, {0, 3}, {1, 4}, {2, 5}, {3, 6}, {1}, {2}, {3})
    found = find_contradiction(7, table)
    assert found is not None
    assert table(tuple(i for i in range(7) if i not in found.odd)) == 0
    assert found.odd == (1, 2, 3)
