"""Linear mixed model of the contrasts: a mean per stimulus, observers random, by REML.

With one random intercept the restricted likelihood is a function of one number, the ratio of the
two variances; it is maximised over that number, everything else has a closed form. (statsmodels'
MixedLM, the oracle of the tests, may report convergence of lbfgs at an infinite likelihood.)
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar
from scipy.stats import norm

from analysis.inference.contrasts import WHERE_COLUMNS, where
from analysis.inference.design import list_contrasts
from analysis.votes import Indexed, index_votes

_LOG_RATIOS = np.linspace(-14.0, 10.0, 49)  # of the observers' variance to the residual one
_NO_SPREAD = 1e-12  # residual variance over the votes' mean square: nothing is left to estimate


@dataclass(frozen=True)
class LinearFit:
    """Result of `fit_linear`.

    Attributes
    ----------
    contrasts
        `question ... level` as in `CONTRAST_COLUMNS`, `difference, se, ci_low, ci_high, p`.
    observer_sd, residual_sd
        Standard deviation of the observers' biases, and of what is left; grades.
    loglik
        Restricted log-likelihood at its maximum.
    estimable
        False: there are no more votes than stimuli, or nothing is left to spread; the contrasts
        have no interval then.
    """

    contrasts: pd.DataFrame
    observer_sd: float
    residual_sd: float
    loglik: float
    estimable: bool


def fit_linear(votes: pd.DataFrame) -> LinearFit:
    """Fit vote = mean of the stimulus + bias of the observer + residual by REML.

    Intervals are Wald's, normal. Observers differ in bias only: where they differ in what they
    mind, the paired tests are the honest ones.
    """
    scored = index_votes(votes)
    stimuli = len(scored.stimuli)
    contrasts = list_contrasts(scored)
    weights = np.array([c.weights(stimuli) for c in contrasts]).reshape(-1, stimuli)
    names = [column.name for column in WHERE_COLUMNS]
    table = pd.DataFrame([where(contrast) for contrast in contrasts], columns=names)
    found = _fit(scored)
    estimable = found.residual_variance > _NO_SPREAD * float(np.mean(scored.vote**2))
    difference = weights @ found.mean
    if not estimable:
        nothing = dict.fromkeys(("se", "ci_low", "ci_high", "p"), np.nan)
        table = table.assign(difference=difference, **nothing)
        return LinearFit(table, np.nan, np.nan, np.nan, estimable=False)
    variance = np.einsum("ij,jk,ik->i", weights, found.covariance, weights)
    return LinearFit(
        table.assign(**wald(difference, variance)),
        float(np.sqrt(found.ratio * found.residual_variance)),
        float(np.sqrt(found.residual_variance)),
        found.loglik,
        estimable=True,
    )


class _Given(NamedTuple):
    """What follows from a ratio of the variances."""

    ratio: float
    mean: NDArray[np.float64]  # (stimulus,)
    covariance: NDArray[np.float64]  # of the means
    residual_variance: float
    loglik: float


def _fit(scored: Indexed) -> _Given:
    sums = _Sums.of(scored)
    nothing = _given(0.0, sums)
    if not nothing.residual_variance > 0:
        return nothing
    coarse = [-_given(float(np.exp(at)), sums).loglik for at in _LOG_RATIOS]
    middle = int(np.clip(np.argmin(coarse), 1, len(coarse) - 2))
    bounds = (_LOG_RATIOS[middle - 1], _LOG_RATIOS[middle + 1])
    best = minimize_scalar(
        lambda at: -_given(float(np.exp(at)), sums).loglik,
        bounds=bounds,
        method="bounded",
        options={"xatol": 1e-9},
    )
    some = _given(float(np.exp(best.x)), sums)
    return some if some.loglik > nothing.loglik else nothing


class _Sums(NamedTuple):
    """Numbers, sums and squares of the votes."""

    counts: NDArray[np.float64]  # (observer, stimulus): votes
    by_observer: NDArray[np.float64]  # (observer,): sum of votes
    by_stimulus: NDArray[np.float64]  # (stimulus,): sum of votes
    squares: float
    votes: int

    @classmethod
    def of(cls, scored: Indexed) -> "_Sums":
        """Sum the votes."""
        counts = np.zeros((len(scored.observers), len(scored.stimuli)))
        np.add.at(counts, (scored.observer, scored.stimulus), 1.0)
        return cls(
            counts,
            scored.per_observer(scored.vote),
            scored.per_stimulus(scored.vote),
            float(scored.vote @ scored.vote),
            len(scored.vote),
        )


def _given(ratio: float, sums: _Sums) -> _Given:
    """Return means, residual variance and restricted log-likelihood at a ratio of variances.

    The inverse covariance of an observer's n votes is I - c 1 1', c = ratio / (1 + n ratio), over
    the residual variance.
    """
    n = sums.counts.sum(axis=1)
    shrink = ratio / (1 + n * ratio)
    information = np.diag(sums.counts.sum(axis=0)) - (sums.counts.T * shrink) @ sums.counts
    inverse = np.linalg.inv(information)
    right = sums.by_stimulus - sums.counts.T @ (shrink * sums.by_observer)
    mean = inverse @ right
    left = sums.squares - float(shrink @ sums.by_observer**2) - float(right @ mean)
    freedom = sums.votes - len(mean)
    variance = left / freedom if freedom > 0 else np.nan
    if not variance > 0:
        return _Given(ratio, mean, inverse, 0.0, -np.inf)
    determinants = float(np.log1p(n * ratio).sum() + np.linalg.slogdet(information)[1])
    loglik = -0.5 * (freedom * (np.log(2 * np.pi * variance) + 1) + determinants)
    return _Given(ratio, mean, inverse * variance, float(variance), float(loglik))


def wald(
    difference: NDArray[np.float64], variance: NDArray[np.float64]
) -> dict[str, NDArray[np.float64]]:
    """Return `difference, se, ci_low, ci_high, p` of estimates with their variances."""
    se = np.sqrt(variance)
    half = norm.ppf(0.975) * se
    return {
        "difference": difference,
        "se": se,
        "ci_low": difference - half,
        "ci_high": difference + half,
        "p": 2 * norm.sf(np.abs(difference) / se),
    }
