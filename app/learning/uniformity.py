"""Is a handful of counts evenly spread? Pearson's chi-squared test, exact where counts are small."""

from functools import lru_cache
from itertools import combinations_with_replacement, pairwise
from math import exp, lgamma, log

from scipy.stats import chi2

SMALL = 5.0  # expected counts under this make the chi-squared approximation poor


def uniform_p_value(counts: tuple[int, ...]) -> float:
    """Probability of counts at least this uneven if all categories are equally likely.

    Args:
        counts: Observed count per category that can occur, at least two categories for anything but 1.

    Returns:
        p in (0, 1]; 1 for no observations.

    Paper: the chi-squared test of Sec. IV-C. Where the expected count is under 5 the multinomial distribution is enumerated instead
        (sum of the probabilities of all outcomes no more likely than the observed one), so no random numbers are needed.
    """
    total, k = sum(counts), len(counts)
    if total == 0 or k < 2:
        return 1.0
    if total / k < SMALL:
        return _exact(tuple(sorted(counts, reverse=True)))
    statistic = sum((c - total / k) ** 2 for c in counts) / (total / k)
    return float(chi2.sf(statistic, k - 1))


@lru_cache(maxsize=4096)
def _exact(counts: tuple[int, ...]) -> float:
    total, k = sum(counts), len(counts)
    observed = _log_probability(counts)
    likely = 0.0
    for walls in combinations_with_replacement(range(total + 1), k - 1):
        edges = (0, *walls, total)
        value = _log_probability(tuple(b - a for a, b in pairwise(edges)))
        if value <= observed + 1e-9:
            likely += exp(value)
    return min(1.0, likely)


def _log_probability(counts: tuple[int, ...]) -> float:
    total = sum(counts)
    return lgamma(total + 1) - sum(lgamma(c + 1) for c in counts) - total * log(len(counts))
