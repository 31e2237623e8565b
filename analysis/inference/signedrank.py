"""Wilcoxon's signed-rank test, exact with ties and zeros: votes are whole numbers and have both."""

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm, rankdata

EXACT_UP_TO = 100
"""Pairs; beyond it the normal approximation, whose error is then below 1e-3."""


def signed_rank(difference: NDArray[np.float64]) -> float:
    """Return the two-sided p-value that differences are symmetric about zero.

    Zeros are ranked and then left out (Pratt 1959). Given the ranks, each sign is a fair coin: the
    distribution of the sum of the positive ranks is counted out, ties and all. 1 where all are
    zero.

    Parameters
    ----------
    difference
        (pair,): any numbers; equal up to 1e-9 counts as tied.
    """
    rounded = np.round(difference, 9)
    doubled = np.rint(2 * rankdata(np.abs(rounded))).astype(np.int64)  # ties have half ranks
    used = rounded != 0
    ranks, positive = doubled[used], int(doubled[rounded > 0].sum())
    if len(ranks) == 0:
        return 1.0
    if len(ranks) > EXACT_UP_TO:
        variance = float((ranks.astype(np.float64) ** 2).sum()) / 4
        return float(2 * norm.sf(abs(positive - ranks.sum() / 2) / np.sqrt(variance)))
    chance = np.zeros(int(ranks.sum()) + 1)
    chance[0] = 1.0
    for rank in ranks.tolist():
        shifted = np.zeros_like(chance)
        shifted[rank:] = chance[:-rank]
        chance = (chance + shifted) / 2
    tail = min(chance[: positive + 1].sum(), chance[positive:].sum())
    return float(min(1.0, 2 * tail))
