"""Do observers repeat themselves? Votes of the same observer on the same stimulus, shown again."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.stats import t

from analysis.votes import scored

KEY = ["lab", "observer", "stimulus"]


@dataclass(frozen=True)
class Retest:
    """Agreement of first and second votes.

    Attributes
    ----------
    pairs, observers
        How many pairs of votes, of how many observers.
    shift, shift_ci
        Mean of second - first, and its 95 % interval over observers (Student t); grades.
    repeat_sd
        Standard deviation of a vote when shown again: root of the mean squared difference from the
        shift over 2; grades.
    equal, within_one
        Share of pairs that are equal; that differ by at most one grade.
    correlation
        Pearson's, over the pairs; nan where one side does not vary.
    """

    pairs: int
    observers: int
    shift: float
    shift_ci: tuple[float, float]
    repeat_sd: float
    equal: float
    within_one: float
    correlation: float


def retest(votes: pd.DataFrame) -> Retest | None:
    """Compare repetition 1 with repetition 2 of every stimulus; None where none was repeated."""
    rows = scored(votes)
    sides = [rows[rows["repetition"] == k].set_index(KEY)["vote"] for k in (1, 2)]
    pairs = pd.concat(sides, axis=1, join="inner", keys=["first", "second"])
    if pairs.empty:
        return None
    difference = pairs["second"] - pairs["first"]
    by_person = difference.groupby(level=["lab", "observer"]).mean()
    n, shift = len(by_person), float(by_person.mean())
    half = t.ppf(0.975, n - 1) * by_person.std(ddof=1) / np.sqrt(n) if n > 1 else np.nan
    varies = (pairs.max() > pairs.min()).all()
    return Retest(
        pairs=len(pairs),
        observers=n,
        shift=shift,
        shift_ci=(shift - half, shift + half),
        repeat_sd=float(np.sqrt(((difference - difference.mean()) ** 2).mean() / 2)),
        equal=float((difference == 0).mean()),
        within_one=float((difference.abs() <= 1).mean()),
        correlation=float(pairs["first"].corr(pairs["second"])) if varies else np.nan,
    )
