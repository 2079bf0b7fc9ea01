"""Two experts apart, side by side and pooled."""

import numpy as np

from app.learning.expert import ScriptedExpert
from app.learning.experts import compare_experts
from app.sequencing.shortest import shortest_sequence
from tests.learning.made_up import TRUE_WEIGHTS, demonstrations, problems

TOOLS = problems(10)
ANNA = ScriptedExpert(TRUE_WEIGHTS, None)
OTHER = TRUE_WEIGHTS[[0, 1, 2, 3, 10, 9, 8, 4, 7, 6, 5, 12, 11]] ** 2
BEN = ScriptedExpert(OTHER, None)


def test_like_minded_experts_can_be_pooled():
    found = compare_experts({"Anna": demonstrations(ANNA, TOOLS[:4]), "Carl": demonstrations(ANNA, TOOLS[4:8])}, TOOLS[8:])
    assert found.pooled.realisable
    assert found.clash == ()
    assert np.allclose(np.diag(found.likeness), 1.0)


def test_different_experts_are_kept_apart_and_their_differences_shown():
    """Each is explained alone, together they contradict; where they differ, each one's order costs the other more."""
    found = compare_experts({"Anna": demonstrations(ANNA, TOOLS[:8]), "Ben": demonstrations(BEN, TOOLS[:8])}, TOOLS)
    assert all(c.realisable for c in found.certificates)
    assert not found.pooled.realisable
    assert {i < 8 for i in found.clash} == {True, False}  # no smallest set lies within one expert
    assert found.disagreements
    assert [d.extra for d in found.disagreements] == sorted((d.extra for d in found.disagreements), reverse=True)
    d = found.disagreements[0]
    orders = [shortest_sequence(TOOLS[d.tool], c.weights).sequence for c in found.certificates]
    assert TOOLS[d.tool].cost(found.certificates[0].weights, orders[1]) > TOOLS[d.tool].cost(found.certificates[0].weights, orders[0])
    assert found.likeness[0, 1] < 1
