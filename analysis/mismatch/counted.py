"""How likely counts of pixels are that stand out of the maps of a sensor.

A few pixels of a law with a heavy tail make the excess kurtosis of a map: it is that of the
brightest one, scatters from sensor to sensor by more than its mean, and a few simulated sensors
do not say what to expect. Counts are Poisson's: of few as of many pixels they say what their law
says. Bins of height share no pixel, and all channels are counted together.
"""

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaln, ndtr
from scipy.stats import poisson

from analysis.mismatch.bank.key import Key
from analysis.mismatch.bank.maps import MAPS
from analysis.mismatch.bank.parts import counted, rooted
from analysis.mismatch.bank.together import TOGETHER

Array = NDArray[np.float64]
_STATISTIC = "outlying_pixels"
_ELSEWHERE = 1e-3  # share of maps with pixels of which no law is known
_MANY = 40.0  # from which the mean of a root is that of a normal variate
_FAR, _NO_PIXEL = 5.0, 0.5  # standard deviations; pixels of a normal map beyond them are fewer
_LEAST = 1e-9  # of a variance, beside the Poisson law's own


class Counted:
    """The numbers that are counts of pixels of maps, by height.

    Parameters
    ----------
    keys
        Of all numbers.
    pixels
        Of the sensor: of so many normal ones few lie beyond a limit.
    """

    def __init__(self, keys: Sequence[Key], pixels: int) -> None:
        own = {i: key for i, key in enumerate(keys) if key.statistic == _STATISTIC}
        joint = any(key.detail.endswith(TOGETHER) for key in own.values())
        maps: dict[str, dict[float, int]] = {}
        for i, key in own.items():
            limit, _, of = key.detail.partition(",")
            if limit and key.scope in MAPS and joint == bool(of):
                maps.setdefault(key.scope, {})[float(limit)] = i
        # Of each map the limits, rising, and which numbers they are.
        self.maps = [(np.array(sorted(by)), np.array([by[x] for x in sorted(by)], np.intp))
                     for by in maps.values()]  # fmt: skip
        self.which = np.array([i for _, which in self.maps for i in which], np.intp)
        # What these say is not said once more: by channel, by a map that has what is another's, by
        # the brightest pixel.
        self.said = np.zeros(len(keys), np.bool_)
        self.said[list(own) if maps else []] = True
        self.repeated = self.said.copy()
        self.repeated[self.which] = False
        self.pixels = pixels

    def loglik(
        self,
        values: Array,
        mean: Array,
        before: Array,
        form: float,
        replicates: int,
        known: NDArray[np.bool_] | None = None,
    ) -> float:
        """Return the log-likelihood of the counts that were recorded.

        Parameters
        ----------
        values, mean, before
            Of all numbers: recorded, predicted, and of the current model.
        form
            Relative error of a predicted change.
        replicates
            Simulated recordings that a prediction is from: they are counts, too.
        known
            Which numbers are known; None: all. Maps with others say nothing.
        """
        total = 0.0
        for limits, which in self.maps:
            if known is not None and not known[which].all():
                continue
            normal = _between(self.pixels * ndtr(-limits))
            seen = np.rint(_between(counted(values[which])))
            expected, current = (
                np.maximum(_between(expected_of(one[which])), normal) for one in (mean, before)
            )
            own = np.maximum(expected - normal, 0.0) / replicates
            excess = own + (form * (expected - current)) ** 2
            total += float(_mixed(seen, expected, excess).sum())
        return total

    def normal(self, mean: Array) -> bool:
        """Return whether a model with these numbers expects no pixel that is far out of a map."""
        return not any(
            (expected_of(mean[which][limits >= _FAR]) > _NO_PIXEL).any()
            for limits, which in self.maps
        )


def _between(beyond: Array) -> Array:
    """Return counts between successive limits, and beyond the last."""
    return np.maximum(-np.diff(beyond, append=0.0), 0.0)


def _mixed(seen: Array, expected: Array, excess: Array) -> Array:
    """Return the log-probability of counts of an uncertain mean, and rarely of any.

    A Poisson variate whose mean is gamma-distributed is a negative binomial one. Counts of which no
    law is known have no scale: 1 / ((n + 1) (n + 2)).
    """
    own = poisson.logpmf(seen, expected)
    shape = expected**2 / np.maximum(excess, _LEAST)
    spread = (
        gammaln(seen + shape)
        - gammaln(shape)
        - gammaln(seen + 1)
        + shape * np.log(shape / (shape + expected))
        + seen * np.log(expected / (shape + expected))
    )
    law = np.where(excess > _LEAST * expected, spread, own)
    any_of_all = -np.log((seen + 1) * (seen + 2))
    return np.asarray(np.logaddexp(np.log1p(-_ELSEWHERE) + law, np.log(_ELSEWHERE) + any_of_all))


def expected_of(roots: Array) -> Array:
    """Return the means of Poisson variates whose roots have these means; see `rooted`."""
    grid, means = _roots()
    far = np.maximum((roots / 2) ** 2 - 1 / 8, 0.0)
    return np.where(roots < means[-1], np.interp(roots, means, grid), far)


@lru_cache(maxsize=1)
def _roots() -> tuple[Array, Array]:
    """Return means of Poisson variates up to many, and those of their roots."""
    grid = np.concatenate([np.linspace(0, 1, 101)[:-1], np.linspace(1, _MANY, 400)])
    numbers = np.arange(int(_MANY + 12 * _MANY**0.5))
    chances = poisson.pmf(numbers, grid[:, np.newaxis])
    return grid, chances @ rooted(numbers)
