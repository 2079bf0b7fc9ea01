"""How alike two sequences of the same tool are."""

from collections.abc import Sequence

import numpy as np

from app.sequencing.problem import check_sequence


def kendall_tau(a: Sequence[int], b: Sequence[int]) -> float:
    """Kendall's tau between two orders: 1 the same, -1 reversed; 1 for a single region."""
    n = len(a)
    place = np.argsort(check_sequence(b, n))[list(check_sequence(a, n))]
    pairs = n * (n - 1) // 2
    if not pairs:
        return 1.0
    first, second = np.triu_indices(n, 1)
    return float(np.sign(place[second] - place[first]).sum() / pairs)
