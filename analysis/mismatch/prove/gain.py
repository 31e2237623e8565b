"""Gain of log-likelihood on locked frames, with its interval by the bootstrap."""

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.finding import Gain
from analysis.mismatch.prove.likelihood import Loglik

Array = NDArray[np.float64]
_DRAWS = 4000
_LEAST_BLOCKS = 6  # blocks of frames in an exposure from which neighbours stay together
_BLOCK = 2


def heldout_gain(before: Loglik, after: Loglik, *, seed: int) -> Gain:
    """Return the mean gain per frame and its 95 % interval.

    Parameters
    ----------
    before, after
        Log-likelihood of the locked frames under two models.
    seed
        Of the bootstrap.

    n - 1 of the n frames of an exposure are drawn, which gives the mean its unbiased variance
    however few they are (Rao & Wu, Resampling inference with complex survey data, JASA 83, 1988);
    blocks of neighbours where there are many. Exposures with one locked frame are drawn together;
    so are the gains of the exposures' levels. With one frame in all the interval is infinite.
    Only exposures that tell count, see `telling`.
    """
    names = telling(before, after)
    levels = np.array([after.levels[name] - before.levels[name] for name in names])
    return gain_of([after.frames[name] - before.frames[name] for name in names], levels, seed=seed)


def gain_of(gains: list[Array], levels: Array, *, seed: int) -> Gain:
    """Return the mean gain per frame and its interval, see `heldout_gain`.

    Parameters
    ----------
    gains
        Of the frames of each exposure: (frame,), nats.
    levels
        Of the exposures' levels: (exposure,), or none.
    seed
        Of the bootstrap.
    """
    strata = _strata(gains)
    frames = sum(own.size for own in strata)
    strata.append(levels)
    mean = float(sum(float(own.sum()) for own in strata) / frames)
    if frames < 2:
        return Gain(mean, (-np.inf, np.inf))
    rng = np.random.default_rng([seed, frames])
    drawn = np.sum([own.size * _drawn_means(own, rng) for own in strata], 0) / frames
    low, high = (float(q) for q in np.percentile(drawn, [2.5, 97.5]))
    return Gain(mean, (low, high))


def telling(before: Loglik, after: Loglik) -> list[str]:
    """Return the exposures that tell two models apart: not those that both say are full.

    Where charge ends codes are so sharp that hundredths of a DN decide. If all are full, all tell.
    """
    full = before.filled & after.filled
    return [name for name in before.frames if name not in full] or list(before.frames)


def _strata(gains: list[Array]) -> list[Array]:
    single = [g for g in gains if g.size == 1]
    many = [g for g in gains if g.size > 1]
    return [*many, np.concatenate(single)] if single else many


def _drawn_means(gains: Array, rng: np.random.Generator) -> Array:
    """Return means of frames drawn anew: (draw,)."""
    n = gains.size
    if n < 2:
        return np.full(_DRAWS, gains.mean() if n else 0.0)
    block = _BLOCK if n >= _BLOCK * _LEAST_BLOCKS else 1
    starts = rng.integers(0, n, (_DRAWS, -(-(n - 1) // block)))
    places = (starts[..., np.newaxis] + np.arange(block)) % n
    means: Array = gains[places.reshape(_DRAWS, -1)[:, : n - 1]].mean(1)
    return means
