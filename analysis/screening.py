"""Screening: the paper's removal of votes, and of observers by BT.500 or by correlation.

The 2-sigma rule removes votes; the others judge observers, and only say who should go and why.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.stats import rankdata

from analysis.table import Column, Kind
from analysis.votes import COLUMNS, Indexed, index_votes
from analysis.votes import scored as scored_rows
from dsis.errors import InputError

# A vote exactly on a limit would fall on either side by rounding: it counts as lying on it.
TIE = 1e-9
THRESHOLD_SD = 2.0  # of the paper's removal of votes

_VOTE = {column.name: column for column in COLUMNS}
REMOVED_COLUMNS = (
    Column("row", Kind.WHOLE, "", "line of the vote in the file of votes"),
    _VOTE["lab"],
    _VOTE["observer"],
    _VOTE["stimulus"],
    _VOTE["repetition"],
    _VOTE["vote"],
    Column("z", Kind.NUMBER, "sd", "(vote - mean) / sd"),
    Column("mean", Kind.NUMBER, "grade", "mean of the votes it is judged by, itself included"),
    Column("sd", Kind.NUMBER, "grade", "sample standard deviation of these votes"),
    Column("n", Kind.WHOLE, "vote", "number of these votes"),
    _VOTE["simulated"],
)


class Removal(NamedTuple):
    """Votes kept and votes removed; the latter with `z`, `mean`, `sd` and `n` of the stimulus."""

    kept: pd.DataFrame
    removed: pd.DataFrame


def remove_outliers(
    votes: pd.DataFrame, threshold: float = THRESHOLD_SD, ddof: int = 1, passes: int = 1
) -> Removal:
    """Remove the votes that lie further than `threshold` sd from the mean of their stimulus.

    |u - mean| > threshold sd, strictly (Seybold et al. 2014), over the scored votes. With the
    sample sd no |z| exceeds (n - 1) / sqrt(n), so at n <= 5 nothing can be removed at 2 sd.
    Intervals from the votes kept are too short: show them beside those from all votes.

    Parameters
    ----------
    votes
        Table of votes; rows that are not scored are in neither part of the result.
    threshold
        In standard deviations, at least 1.
    ddof
        1: sample standard deviation; 0: population.
    passes
        How often at most; each pass has the mean and sd of what the one before has kept. The paper
        names none: one.
    """
    if passes < 1 or not threshold >= 1:  # from 1 on, no stimulus loses all votes
        fact = f"are {threshold:g} and {passes}, must both be at least 1"
        raise InputError.of("threshold, passes", "", fact)
    kept, found = scored_rows(votes), []
    for _ in range(passes):
        kept, removed = _remove_once(kept, threshold, ddof)
        found.append(removed)
        if removed.empty or kept.empty:
            break
    removed = pd.concat(found).sort_index() if len(found) > 1 else found[0]
    return Removal(kept, removed)


def _remove_once(votes: pd.DataFrame, threshold: float, ddof: int) -> Removal:
    scored = index_votes(votes)
    n, mean, sd = moments(scored.stimulus, scored.vote, ddof)
    at = scored.stimulus
    deviation = scored.vote - mean[at]
    out = np.abs(deviation) > threshold * sd[at] * (1 + TIE)
    removed = scored.table[out].assign(
        row=scored.table.index[out],
        z=deviation[out] / sd[at][out],
        mean=mean[at][out],
        sd=sd[at][out],
        n=n[at][out],
    )
    return Removal(scored.table[~out], removed[[c.name for c in REMOVED_COLUMNS]])


class Moments(NamedTuple):
    """Number, mean and standard deviation by group, each (group,)."""

    n: NDArray[np.int64]
    mean: NDArray[np.float64]
    sd: NDArray[np.float64]


def moments(group: NDArray[np.intp], values: NDArray[np.float64], ddof: int) -> Moments:
    """Return the moments of the `values` of each group 0, 1 ...; sd nan where n <= ddof.

    Values that are all equal have that mean and an sd of zero exactly, free of rounding.
    """
    n = np.bincount(group)
    lowest, highest = np.full(len(n), np.inf), np.full(len(n), -np.inf)
    np.minimum.at(lowest, group, values)
    np.maximum.at(highest, group, values)
    mean = np.where(lowest == highest, lowest, np.bincount(group, values) / n)
    squares = np.bincount(group, (values - mean[group]) ** 2)
    variance = np.full(len(n), np.nan)
    np.divide(squares, n - ddof, out=variance, where=n > ddof)
    return Moments(n.astype(np.int64), mean, np.sqrt(variance))


@dataclass(frozen=True)
class Bt500Rule:
    """How BT.500's observer screening (BT.500-14, A1-2.3.1) is read.

    Attributes
    ----------
    ddof
        1: sample standard deviation, as the text has it; 0: population.
    skip_constant
        Presentations on which all agree accuse nobody; else they accuse everybody, twice.
    of_votes_cast
        The 5 % are of the votes that the observer cast; else of all presentations.
    """

    ddof: int = 1
    skip_constant: bool = True
    of_votes_cast: bool = True


BT500 = Bt500Rule()
SUREAL = Bt500Rule(ddof=0, skip_constant=False, of_votes_cast=False)
"""As the program `sureal` counts: for comparing with results it gave."""


def screen_bt500(votes: pd.DataFrame, rule: Bt500Rule = BT500) -> pd.DataFrame:
    """Return for each observer whether BT.500's kurtosis method rejects them, and the numbers.

    For each presentation (stimulus and repetition) an observer's vote counts in `p` if it lies at
    least eps sd above the mean, in `q` if as far below; eps = 2 where the kurtosis is in 2..4, else
    sqrt(20). Rejected: (p + q) / n > 0.05 and |p - q| / (p + q) < 0.3. One pass.

    Returns
    -------
    DataFrame
        `lab, observer, n` (the denominator), `p, q, outside` = (p + q) / n, `balance` =
        |p - q| / (p + q) (nan if p + q = 0), `rejected`, and `above`, `below`: the stimuli counted.
    """
    scored = index_votes(votes)
    return judge(scored, scored.vote, rule)


def judge(scored: Indexed, vote: NDArray[np.float64], rule: Bt500Rule) -> pd.DataFrame:
    """Screen as `screen_bt500` does, by the values `vote` (vote,) in place of the votes."""
    above, below = _outside(scored.presentation, vote, rule)
    p = np.bincount(scored.observer[above], minlength=len(scored.observers))
    q = np.bincount(scored.observer[below], minlength=len(scored.observers))
    presentations = int(scored.presentation.max()) + 1
    cast = np.bincount(scored.observer)
    n = cast if rule.of_votes_cast else np.full_like(cast, presentations)
    outside = p + q
    balance = np.full(len(n), np.nan)
    np.divide(np.abs(p - q), outside, out=balance, where=outside > 0)
    # In whole numbers, so that 5 % and 0.3 are exact.
    rejected = (20 * outside > n) & (10 * np.abs(p - q) < 3 * outside)
    return scored.observers[["lab", "observer"]].assign(
        n=n,
        p=p,
        q=q,
        outside=outside / n,
        balance=balance,
        rejected=rejected,
        above=_names(scored, above),
        below=_names(scored, below),
    )


def _outside(
    presentation: NDArray[np.intp], vote: NDArray[np.float64], rule: Bt500Rule
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return for each vote whether it lies far above, and far below, its presentation's mean."""
    n, mean, sd = moments(presentation, vote, rule.ddof)
    deviation = vote - mean[presentation]
    m2 = np.bincount(presentation, deviation**2) / n
    m4 = np.bincount(presentation, deviation**4) / n
    spread = (sd > 0) & (m2 > 0)
    kurtosis = np.full(len(n), np.nan)
    np.divide(m4, m2**2, out=kurtosis, where=spread)
    normal = (kurtosis >= 2 * (1 - TIE)) & (kurtosis <= 4 * (1 + TIE))
    limit = np.where(normal, 2.0, np.sqrt(20.0)) * np.nan_to_num(sd) * (1 - TIE)
    counts = (spread | (not rule.skip_constant))[presentation]
    return (
        counts & (deviation >= limit[presentation]),
        counts & (deviation <= -limit[presentation]),
    )


def _names(scored: Indexed, counted: NDArray[np.bool_]) -> list[str]:
    """Return for each observer the stimuli of the votes counted, in the order of the table."""
    names: list[list[str]] = [[] for _ in range(len(scored.observers))]
    for stimulus, observer in zip(
        scored.table["stimulus"][counted], scored.observer[counted], strict=True
    ):
        names[observer].append(stimulus)
    return ["; ".join(of_one) for of_one in names]


def screen_correlation(votes: pd.DataFrame, limit: float = 0.7) -> pd.DataFrame:
    """Return for each observer how the votes correlate with the MOS, and whether that is too low.

    `correlation` is the smaller of Pearson's and Spearman's (as in BT.1788). Rejected: it is at
    most min(`limit`, mean - sd over the observers). It is nan, and nobody is rejected by it, where
    an observer's votes, or their MOS, are all equal.

    Returns
    -------
    DataFrame
        `lab, observer, pearson, spearman, correlation, threshold, rejected`.
    """
    scored = index_votes(votes)
    expected = moments(scored.stimulus, scored.vote, 1).mean[scored.stimulus]
    order = np.argsort(scored.observer, kind="stable")
    cuts = np.cumsum(np.bincount(scored.observer))[:-1]
    pairs = zip(np.split(scored.vote[order], cuts), np.split(expected[order], cuts), strict=True)
    both = np.array([(_pearson(u, m), _spearman(u, m)) for u, m in pairs])
    correlation = both.min(axis=1)
    known = correlation[~np.isnan(correlation)]
    threshold = min(limit, known.mean() - known.std(ddof=1)) if len(known) > 1 else np.nan
    return scored.observers[["lab", "observer"]].assign(
        pearson=both[:, 0],
        spearman=both[:, 1],
        correlation=correlation,
        threshold=threshold,
        rejected=correlation <= threshold,
    )


def _pearson(x: NDArray[np.float64], y: NDArray[np.float64]) -> float:
    if any(np.ptp(values) <= TIE * np.abs(values).max() for values in (x, y)):
        return np.nan
    x, y = x - x.mean(), y - y.mean()
    return float(x @ y / np.sqrt((x @ x) * (y @ y)))


def _spearman(x: NDArray[np.float64], y: NDArray[np.float64]) -> float:
    # Means of equal votes may differ in their last bit; rounded, they share a rank.
    return _pearson(rankdata(np.round(x, 9)), rankdata(np.round(y, 9)))
