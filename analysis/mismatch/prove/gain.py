"""Gain of log-likelihood on locked frames, with its interval by the bootstrap."""

import numpy as np
import scipy.stats
from numpy.typing import NDArray

from analysis.mismatch.finding import Gain
from analysis.mismatch.prove.likelihood import Loglik

Array = NDArray[np.float64]
_DRAWS = 2000
_LEAST_BLOCKS = 6  # blocks of frames in an exposure from which neighbours stay together
_BLOCK = 2
_PRIOR_DOF = 2


def heldout_gain(before: Loglik, after: Loglik, *, seed: int) -> Gain:
    """Return the mean gain per frame and its 95 % interval.

    Parameters
    ----------
    before, after
        Log-likelihood of the locked frames under two models.
    seed
        Of the bootstrap.

    Frames are drawn within their exposure, blocks of neighbours where there are many; exposures
    with one locked frame are drawn together; so are the gains of the exposures' levels. Departures
    are scaled to the variance that `_variance` estimates, and the interval is widened by Student's t.
    """
    strata = _strata([after.frames[name] - before.frames[name] for name in before.frames])
    frames = sum(gains.size for gains in strata)
    strata.append(np.array([after.levels[name] - before.levels[name] for name in before.levels]))
    mean = float(sum(float(gains.sum()) for gains in strata) / frames)
    rng = np.random.default_rng([seed, frames])
    drawn, variance, square = np.zeros(_DRAWS), 0.0, 0.0
    for gains in strata:
        if gains.size > 1:
            own = gains.size * _variance(gains)
            drawn += _drawn_sums(gains, rng) * np.sqrt(own)
            variance += own
            square += own**2 / (gains.size - 1 + _PRIOR_DOF)
    if not variance:
        return Gain(mean, (-np.inf, np.inf))
    dof = variance**2 / square  # Satterthwaite's
    wide = float(scipy.stats.t.ppf(0.975, dof) / scipy.stats.norm.ppf(0.975))
    low, high = (mean + wide * float(q) / frames for q in np.percentile(drawn, [2.5, 97.5]))
    return Gain(mean, (low, high))


def _variance(gains: Array) -> float:
    """Return the variance of single gains, from few of them.

    Log-likelihood ratios of close models have a variance of twice the size of their mean: that
    counts as `_PRIOR_DOF` degrees of freedom.
    """
    n = gains.size - 1
    prior = 2 * abs(float(gains.mean()))
    return (n * float(gains.var(ddof=1)) + _PRIOR_DOF * prior) / (n + _PRIOR_DOF)


def _strata(gains: list[Array]) -> list[Array]:
    single = [g for g in gains if g.size == 1]
    many = [g for g in gains if g.size > 1]
    return [*many, np.concatenate(single)] if single else many


def _drawn_sums(gains: Array, rng: np.random.Generator) -> Array:
    """Return sums of departures from the mean in frames drawn anew, of variance 1: (draw,)."""
    n = gains.size
    block = _BLOCK if n >= _BLOCK * _LEAST_BLOCKS else 1
    starts = rng.integers(0, n, (_DRAWS, -(-n // block)))
    places = (starts[..., np.newaxis] + np.arange(block)) % n
    sums = (gains - gains.mean())[places.reshape(_DRAWS, -1)[:, :n]].sum(1)
    size = float(gains.std()) * np.sqrt(n)
    return sums / size if size else np.zeros(_DRAWS)
