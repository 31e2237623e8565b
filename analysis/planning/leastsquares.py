"""Least squares of vote = score + bias: what a pilot says when each of its votes weighs the same.

The tests that are planned compare plain votes, paired. Where everybody judged everything, a
difference of these scores is the mean of the paired differences, and so is what those tests find.
P.910's likelihood weighs observers by their consistency instead; with few votes each it grows
without limit as the scores approach one observer's votes, and often ends there.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from analysis.votes import Indexed


class Additive(NamedTuple):
    """Result of `fit_additive`.

    Attributes
    ----------
    score, bias
        (stimulus,) and (observer,): grades; the biases have mean zero.
    variance
        (observer,): unbiased, of the votes about score + bias; nan where `freedom` is 0.
    freedom
        (observer,): degrees of freedom of that, the observer's share of all.
    """

    score: NDArray[np.float64]
    bias: NDArray[np.float64]
    variance: NDArray[np.float64]
    freedom: NDArray[np.float64]

    @property
    def spread(self) -> float:
        """Sd of the votes of all about score + bias; nan where nothing is left to tell it from."""
        freedom = float(self.freedom.sum())
        squares = float(np.nansum(self.variance * self.freedom))
        return float(np.sqrt(squares / freedom)) if freedom > 0 else float("nan")


def fit_additive(scored: Indexed) -> Additive:
    """Fit vote = score of the stimulus + bias of the observer + residual by least squares.

    Stimuli that share no observer, directly or by way of others, keep the levels of their means.
    """
    n = np.bincount(scored.observer).astype(np.float64)
    votes = np.bincount(scored.stimulus).astype(np.float64)
    counts = np.zeros((len(n), len(votes)))
    np.add.at(counts, (scored.observer, scored.stimulus), 1.0)
    mean = scored.per_stimulus(scored.vote) / votes
    left = scored.vote - mean[scored.stimulus]
    bias = scored.per_observer(left) / n
    # The scores move from the means as the biases of those who judged each ask for.
    right = -(counts.T @ bias)
    information = np.diag(votes) - (counts.T / n) @ counts
    moved, _, rank, _ = np.linalg.lstsq(information, right, rcond=1e-10)
    bias = bias - counts @ moved / n
    residual = left - moved[scored.stimulus] - bias[scored.observer]
    squares = scored.per_observer(residual**2)
    freedom = np.maximum(n - 1 - int(rank) * n / n.sum(), 0.0)
    freedom[freedom < 1e-9 * n] = 0.0
    variance = np.divide(squares, freedom, out=np.full(len(n), np.nan), where=freedom > 0)
    shift = float(bias.mean())
    return Additive(mean + moved + shift, bias - shift, variance, freedom)
