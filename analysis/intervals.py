"""Confidence intervals of a mean opinion score, by closed forms: Student's t and Clopper-Pearson.

Student's t is the default. It has no width where all votes agree; there the binomial interval,
which is conservative and never leaves the scale, is what remains.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import betaincinv
from scipy.stats import t

from analysis.scale import Scale

LEVEL = 0.95


class Interval(NamedTuple):
    """Ends of intervals, each (cell,); nan where there is none."""

    low: NDArray[np.float64]
    high: NDArray[np.float64]


def student_interval(
    n: ArrayLike, mean: ArrayLike, sd: ArrayLike, level: float = LEVEL
) -> Interval:
    """Return mean +- t(n - 1) sd / sqrt(n); nan for a single vote.

    Parameters
    ----------
    n, mean, sd
        (cell,): number of votes, mean, sample standard deviation.
    level
        Nominal coverage.
    """
    n, mean, sd = np.asarray(n), np.asarray(mean, np.float64), np.asarray(sd, np.float64)
    half = t.ppf((1 + level) / 2, np.maximum(n - 1, 1)) * sd / np.sqrt(n)
    return Interval(mean - half, mean + half)


def binomial_interval(
    n: ArrayLike, mean: ArrayLike, scale: Scale, level: float = LEVEL
) -> Interval:
    """Return the Clopper-Pearson interval of a mean: k = n (mean - L) / (H - L) successes of n.

    Beta quantiles, (1 - level) / 2 of (k, n - k + 1) and (1 + level) / 2 of (k + 1, n - k). A vote
    on a scale of L..H varies no more than a coin of the same mean, so it is conservative (Hossfeld
    et al., arXiv:1806.01126).

    Parameters
    ----------
    n, mean
        (cell,): number of votes and their mean, within the scale.
    scale
        Its ends are L and H.
    level
        Nominal coverage.
    """
    n, mean = np.asarray(n, np.float64), np.asarray(mean, np.float64)
    width = scale.high - scale.low
    successes = np.clip(n * (mean - scale.low) / width, 0.0, n)
    failures = n - successes
    tail = (1 - level) / 2
    # The arguments are kept positive where the end is known: 0 at no success, 1 at no failure.
    low = betaincinv(np.maximum(successes, 0.5), failures + 1, tail)
    high = betaincinv(successes + 1, np.maximum(failures, 0.5), 1 - tail)
    low, high = np.where(successes > 0, low, 0.0), np.where(failures > 0, high, 1.0)
    ends = (np.asarray(scale.low + width * end, dtype=np.float64) for end in (low, high))
    return Interval(*ends)


def default_interval(
    n: ArrayLike, mean: ArrayLike, sd: ArrayLike, scale: Scale | None
) -> tuple[Interval, NDArray[np.str_]]:
    """Return the 95 % intervals that a report shows, and of each which it is.

    "t": Student's. "binomial": Clopper-Pearson's, where all of two or more votes agree or there is
    a single one, and the scale is known. "none": neither.
    """
    found = student_interval(n, mean, sd)
    sd = np.asarray(sd, np.float64)
    flat = ~(sd > 0)
    if scale is None:
        return found, np.where(flat, "none", "t")
    binomial = binomial_interval(n, mean, scale)
    low = np.where(flat, binomial.low, found.low)
    high = np.where(flat, binomial.high, found.high)
    return Interval(low, high), np.where(flat, "binomial", "t")
