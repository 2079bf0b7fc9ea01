"""The kept merge tree against trees made by hand."""

import numpy as np
import pytest

from app.errors import InvalidInput
from app.geometry.merge_tree import MergeTree
from app.geometry.segmentation import part_tree
from tests.geometry.test_segmentation import composite, part_of


def by_hand() -> MergeTree:
    """Leaves 0..3 of area 1, 2, 3, 4: (0 1) = 4, (2 3) = 5, (4 5) = 6; face 4 is a second face of leaf 3."""
    return MergeTree(
        leaf=np.array([0, 1, 2, 3, 3]),
        merges=np.array([[0, 1], [2, 3], [4, 5]]),
        costs=np.array([0.03, 0.28, 10.0]),  # RMS 0.1, 0.2, 1
        areas=np.array([1.0, 2, 3, 4, 3, 7, 10]),
    )


@pytest.mark.parametrize(
    ("target", "expected"),
    [(4, [0, 1, 2, 3, 3]), (9, [0, 1, 2, 3, 3]), (3, [0, 0, 1, 2, 2]), (2, [0, 0, 1, 1, 1]), (1, [0, 0, 0, 0, 0]), (0, [0, 0, 0, 0, 0])],
)
def test_cut_by_number(target: int, expected: list[int]) -> None:
    assert by_hand().cut(target).tolist() == expected


@pytest.mark.parametrize(
    ("tolerance", "expected"), [(0.01, [0, 1, 2, 3, 3]), (0.15, [0, 0, 1, 2, 2]), (0.25, [0, 0, 1, 1, 1]), (2, [0, 0, 0, 0, 0])]
)
def test_cut_by_tolerance(tolerance: float, expected: list[int]) -> None:
    assert by_hand().cut(tolerance=tolerance).tolist() == expected


def test_tolerance_and_number_together_give_at_most_the_number() -> None:
    assert by_hand().cut(3, tolerance=0.01).tolist() == [0, 0, 1, 2, 2]
    assert by_hand().cut(3, tolerance=0.25).tolist() == [0, 0, 1, 1, 1]
    with pytest.raises(InvalidInput, match="how closely"):
        by_hand().cut()


def test_walking_down_under_a_face() -> None:
    """In one region of everything the clusters under face 4 are (2 3), then leaf 3; in the region (1 3) only leaf 3."""
    steps = [np.flatnonzero(mask).tolist() for mask in by_hand().children_of(np.zeros(5, int), 4)]
    assert steps == [[2, 3, 4], [3, 4]]
    steps = [np.flatnonzero(mask).tolist() for mask in by_hand().children_of(np.array([0, 1, 0, 1, 1]), 4)]
    assert steps == [[3, 4]]


def test_a_leaf_that_is_its_whole_region_has_nothing_smaller() -> None:
    assert by_hand().children_of(np.array([0, 0, 0, 1, 1]), 3) == ()


def test_pieces_of_faces_keep_their_cluster() -> None:
    cut = by_hand().on(np.array([2, 2, 0, 4])).cut(2)
    assert cut.tolist() == [0, 0, 1, 0]


def test_the_tree_survives_storage() -> None:
    tree = part_tree(part_of(composite()[0]))
    again = MergeTree.from_bytes(tree.to_bytes())
    for target in (3, 9, 30):
        assert (tree.cut(target) == again.cut(target)).all()
        assert tree.cut(target).max() + 1 == target


def test_cuts_are_nested() -> None:
    tree = part_tree(part_of(composite()[0]))
    coarse, fine = tree.cut(5), tree.cut(12)
    assert len(np.unique(np.stack([coarse, fine]), axis=1).T) == 12
