"""Bootstrap over observers, with the removal of votes inside each resample.

Resampling observers, not votes, keeps what one person's votes have in common; repeating the removal
in each resample lets the interval know that the votes were chosen by looking at them.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.stats import norm, t

from analysis.intervals import LEVEL, Interval
from analysis.screening import THRESHOLD_SD, TIE
from analysis.votes import Indexed, index_votes
from dsis.compiled import kernel

RESAMPLES = 2000
SEED = 1


def bootstrap_scores(
    votes: pd.DataFrame,
    *,
    threshold: float | None = THRESHOLD_SD,
    passes: int = 1,
    resamples: int = RESAMPLES,
    seed: int = SEED,
    level: float = LEVEL,
) -> pd.DataFrame:
    """Return percentile intervals of each stimulus' MOS from resamples of the observers.

    The percentiles are those of the expanded percentile interval (Hesterberg, The American
    Statistician 69(4), 2015), which makes up for the narrowness of the bootstrap at small n:
    Phi(sqrt(n / (n - 1)) t(n - 1)) in place of 97.5 %.

    Parameters
    ----------
    votes
        Table of votes.
    threshold, passes
        Votes beyond so many sample sd of the resample's mean are removed in each resample, so many
        times; None: nothing is removed.
    resamples, seed
        Number of resamples; the seed that fixes them.
    level
        Nominal coverage.

    Returns
    -------
    DataFrame
        `stimulus, boot_low, boot_high`; nan where fewer than two observers voted.
    """
    scored = index_votes(votes)
    drawn = draw_resamples(len(scored.observers), resamples, seed)
    low, high = np.full((2, len(scored.stimuli)), np.nan)
    for at, observer, vote in _by_stimulus(scored):
        people = np.unique(observer)
        if len(people) < 2:
            continue
        place = np.searchsorted(people, observer)
        mean = _means(drawn[:, people], place, vote, threshold, passes)
        low[at], high[at] = _percentiles(mean, len(people), level)
    return scored.stimuli[["stimulus"]].assign(boot_low=low, boot_high=high)


def draw_resamples(observers: int, resamples: int, seed: int) -> NDArray[np.float64]:
    """Return how often each observer is in each resample, (resample, observer)."""
    random = np.random.Generator(np.random.PCG64(np.random.SeedSequence([seed, observers])))
    uniform = np.full(observers, 1 / observers)
    return random.multinomial(observers, uniform, size=resamples).astype(np.float64)


def _by_stimulus(
    scored: Indexed,
) -> Iterator[tuple[int, NDArray[np.intp], NDArray[np.float64]]]:
    """Yield (stimulus, observers, votes) of each stimulus."""
    order = np.argsort(scored.stimulus, kind="stable")
    cuts = np.cumsum(np.bincount(scored.stimulus))[:-1]
    parts = zip(
        np.split(scored.observer[order], cuts), np.split(scored.vote[order], cuts), strict=True
    )
    for at, (observer, vote) in enumerate(parts):
        yield at, observer, vote


def _means(
    drawn: NDArray[np.float64],
    observer: NDArray[np.intp],
    vote: NDArray[np.float64],
    threshold: float | None,
    passes: int,
) -> NDArray[np.float64]:
    """Return the mean of each resample in which anybody voted.

    Votes of one grade are counted together, so that a resample is a histogram: exact counts.
    """
    grade, at = np.unique(vote, return_inverse=True)
    means = np.empty(len(drawn))
    rounds = 0 if threshold is None else passes
    limit = 0.0 if threshold is None else threshold * (1 + TIE)
    cells = (observer.astype(np.uintp), at.reshape(-1).astype(np.uintp))
    _resampled_means(drawn, *cells, grade, limit, rounds, means)
    return means[~np.isnan(means)]


@kernel
def _resampled_means(
    drawn: Any, observer: Any, at: Any, grade: Any, limit: float, rounds: int, means: Any
) -> None:
    count = np.empty(len(grade))
    for b in range(len(drawn)):
        count[:] = 0.0
        for k in range(len(at)):
            count[at[k]] += drawn[b, observer[k]]
        mean = (count * grade).sum() / count.sum()  # nan where nobody in it voted
        for _ in range(rounds):
            squares = (count * (grade - mean) ** 2).sum()
            sd = np.sqrt(squares / max(count.sum() - 1.0, 1.0))
            for g in range(len(grade)):
                if abs(grade[g] - mean) > limit * sd + TIE:
                    count[g] = 0.0
            mean = (count * grade).sum() / count.sum()
        means[b] = mean


def _percentiles(mean: NDArray[np.float64], n: int, level: float) -> NDArray[np.float64]:
    tail = norm.cdf(np.sqrt(n / (n - 1)) * t.ppf((1 - level) / 2, n - 1))
    return np.asarray(np.quantile(mean, [tail, 1 - tail]), dtype=np.float64)


def bootstrap_interval(
    scored_votes: NDArray[np.float64], drawn: NDArray[np.float64], threshold: float | None
) -> Interval:
    """Return the interval of one stimulus on which everybody votes once, for simulations.

    Parameters
    ----------
    scored_votes
        (observer,): grades.
    drawn
        (resample, observer): how often each observer is in each resample.
    threshold
        As for `bootstrap_scores`.
    """
    n = len(scored_votes)
    mean = _means(drawn, np.arange(n), scored_votes, threshold, 1)
    low, high = _percentiles(mean, n, LEVEL)
    return Interval(np.asarray(low), np.asarray(high))
