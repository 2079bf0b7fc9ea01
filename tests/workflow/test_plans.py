"""What a plan says about how sure it is."""

import pytest

from app.workflow.policy_rows import sureness_words


@pytest.mark.parametrize(
    ("cost", "proved", "bound", "words"),
    [
        (10.0, True, 10.0, "Proved optimal"),
        (110.0, False, 100.0, "Best found, at most 10 % above the optimum"),
        (101.0, False, 100.0, "Best found, at most 1.0 % above the optimum"),
        (100.01, False, 100.0, "Best found, at most 0.1 % above the optimum"),
        (100.0, False, 70.0, "Best found, at most 43 % above the optimum"),
        (-5.0, False, -7.0, "Best found, at most 2 above the optimum"),
        (1.0, False, -0.5, "Best found, at most 1.5 above the optimum"),
        (1.0, False, None, "Best found, no limit known"),
    ],
)
def test_sureness_in_words(cost: float, proved: bool, bound: float | None, words: str):
    """Rounded up, never down; a share only where it means something."""
    assert sureness_words(cost, proved, bound) == words
