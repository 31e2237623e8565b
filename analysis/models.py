"""Observer models: what a vote says about the sequence, and what about the observer."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.special import chdtri

from analysis.projection import project
from analysis.screening import BT500, Bt500Rule, judge, moments
from analysis.votes import Indexed, index_votes

Z95 = 1.95996
"""Normal quantile of a 95 % interval, to the digits that published results were made with."""
ALL_TOO_CONSISTENT = 1e-3
"""Inconsistency over the range of the votes: below, the fit leans on this observer.

In simulated panels of whole votes it is below 1e-6 or above 0.02: nothing lies between.
"""


@dataclass(frozen=True)
class BiasRemoved:
    """Scores of P.913, 12.4.

    Attributes
    ----------
    scores
        `stimulus, n, score, se`: mean and standard error of the corrected votes of the observers
        who pass; nan where nobody is left.
    observers
        `bias` beside the columns of `analysis.screen_bt500`.
    """

    scores: pd.DataFrame
    observers: pd.DataFrame


def p913(votes: pd.DataFrame, rule: Bt500Rule = BT500) -> BiasRemoved:
    """Subtract each observer's bias, screen by BT.500 what remains, and average (P.913, 12.4).

    The bias is the mean of (vote - mean of the stimulus) over the observer's votes.
    """
    scored = index_votes(votes)
    mean = moments(scored.stimulus, scored.vote, 1).mean
    bias = _mean_per_observer(scored, scored.vote - mean[scored.stimulus])
    corrected = scored.vote - bias[scored.observer]
    observers = judge(scored, corrected, rule).assign(bias=bias)
    scores = scores_of(scored, corrected, observers["rejected"].to_numpy(dtype=np.bool_))
    return BiasRemoved(scores, observers)


def scores_of(
    scored: Indexed, vote: NDArray[np.float64], rejected: NDArray[np.bool_]
) -> pd.DataFrame:
    """Return `stimulus, n, score, se` from the votes of the observers who are not rejected."""
    stays = ~rejected[scored.observer]
    table = scored.stimuli[["stimulus"]].assign(n=0, score=np.nan, se=np.nan)
    if not stays.any():
        return table
    judged, group = np.unique(scored.stimulus[stays], return_inverse=True)
    n, mean, sd = moments(group.reshape(-1), vote[stays], 1)
    for name, values in (("n", n), ("score", mean), ("se", sd / np.sqrt(n))):
        column = table[name].to_numpy(copy=True)
        column[judged] = values
        table[name] = column
    return table


@dataclass(frozen=True)
class MaximumLikelihood:
    """Scores of P.910, Annex E (P.913, 12.6).

    Attributes
    ----------
    scores
        `stimulus, score, se, ci_low, ci_high`.
    observers
        `lab, observer, n, bias, bias_ci_low, bias_ci_high, inconsistency, inconsistency_ci_low,
        inconsistency_ci_high, rigid` (true: no inconsistency was found).
    rounds
        Rounds of the alternating projection.
    converged
        False: it was stopped after `analysis.projection.ROUNDS_MAX`.
    """

    scores: pd.DataFrame
    observers: pd.DataFrame
    rounds: int
    converged: bool

    @property
    def degenerate(self) -> bool:
        """Whether the scores rest on some, rigid, observers: they and their errors are of no use.

        Where all are rigid they agree but for their biases, and the scores are plain means.
        """
        return bool(self.observers["rigid"].any() and not self.observers["rigid"].all())


def p910(votes: pd.DataFrame) -> MaximumLikelihood:
    """Fit vote = score + bias + inconsistency X, X ~ N(0, 1), by alternating projection.

    Score by stimulus, weighted by 1 / inconsistency^2; bias and inconsistency by observer; the
    biases have mean zero. An observer's interval follows from chi^2 with as many degrees of freedom
    as there are votes; a score's from the spread of the residuals on that stimulus. Population sd
    throughout, as in the programs whose results are published.

    The likelihood has no maximum: it grows without limit as the scores approach one observer's
    votes. With few votes each the projection often ends there; the result is then `degenerate`.
    """
    return fit_p910(index_votes(votes))


def fit_p910(scored: Indexed) -> MaximumLikelihood:
    """Fit as `p910` does, votes that are indexed already."""
    found = project(scored.stimulus, scored.observer, scored.vote, len(scored.observers))
    se = np.sqrt(found.variance / found.n)
    shift = found.bias.mean()
    score = found.score + shift
    scores = pd.DataFrame(
        {
            "stimulus": scored.stimuli["stimulus"],
            "score": score,
            "se": se,
            "ci_low": score - Z95 * se,
            "ci_high": score + Z95 * se,
        }
    )
    observers = _observers(scored, found.bias - shift, found.inconsistency)
    return MaximumLikelihood(scores, observers, found.rounds, found.converged)


def _mean_per_observer(scored: Indexed, values: NDArray[np.float64]) -> NDArray[np.float64]:
    return scored.per_observer(values) / np.bincount(scored.observer)


def _observers(
    scored: Indexed, bias: NDArray[np.float64], spread: NDArray[np.float64]
) -> pd.DataFrame:
    n = np.bincount(scored.observer)
    # Equal votes may leave rounding errors, which are no range.
    width = max(float(np.ptp(scored.vote)), 1e-9 * float(np.abs(scored.vote).max()))
    half = Z95 * spread / np.sqrt(n)
    return pd.DataFrame(
        {
            "lab": scored.observers["lab"],
            "observer": scored.observers["observer"],
            "n": n,
            "bias": bias,
            "bias_ci_low": bias - half,
            "bias_ci_high": bias + half,
            "inconsistency": spread,
            "inconsistency_ci_low": spread * np.sqrt(n / chdtri(n, 0.025)),
            "inconsistency_ci_high": spread * np.sqrt(n / chdtri(n, 0.975)),
            "rigid": spread <= ALL_TOO_CONSISTENT * width,
        }
    )
