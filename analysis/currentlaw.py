"""The law of dark currents that differ in all pixels, with noise, and pixels' values binned.

Pixels' dark currents are log-normal (Baer, Proc. SPIE 6068, 2006): d exp(s k - s^2 / 2), k standard
normal, of mean d. What frames show of them has normal noise besides. Of that sum there is no closed
form: it is a mixture of normal laws, one for each k of a fine grid.
"""

from dataclasses import dataclass
from math import pi, sqrt

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.special import log_ndtr, ndtr

Array = NDArray[np.float64]
BIN = 0.05  # of noise, and beyond `FAR` noises of a value's logarithm
FAR = 10.0
_NODES, _END = 400, 6.0  # of the grid of k


def of_all(sigma: float, ratio: float) -> float:
    """Return the spread about another mean, of the same standard deviation.

    `ratio` is that of the mean whose spread `sigma` is to the other.
    """
    return sqrt(np.log1p(np.expm1(sigma**2) * ratio**2))


@dataclass(frozen=True)
class Binned:
    """Values of a map's pixels, in noises from their median, and how many there are of each."""

    values: Array
    counts: Array

    @classmethod
    def of(cls, values: Array, noise: float) -> "Binned":
        """Return pixels, those of much the same value as one."""
        unit = ((values - np.median(values)) / noise).ravel()
        size = np.maximum(np.abs(unit), FAR)
        away = np.sign(unit) * FAR * np.exp(np.round(np.log(size / FAR) / BIN) * BIN)
        rounded = np.where(size > FAR, away, np.round(unit / BIN) * BIN)
        own, counts = np.unique(rounded, return_counts=True)
        return cls(own, counts.astype(np.float64))


@dataclass(frozen=True)
class Body:
    """The law of most pixels: log-normal dark currents beside normal noise, all in noises.

    Attributes
    ----------
    mean
        Of the dark currents.
    log_sigma
        Of their logarithm; 0: all are the same.
    shot
        Share of the noise variance that is a mean dark current's shot noise: dark pixels have less.
    """

    mean: float = 0.0
    log_sigma: float = 0.0
    shot: float = 0.0

    def __bool__(self) -> bool:
        """Return whether dark currents differ."""
        return bool(self.mean > 0 and self.log_sigma > 0)

    def density(self, values: Array, width: float) -> Array:
        """Return the density at values from the median, where noise is so many times as wide."""
        centres, widths, weights = self._parts(width)
        part = values[:, np.newaxis] + self._middle(width) - centres
        # In place: there are some hundred laws for each value.
        part /= widths
        np.square(part, out=part)
        part /= -2
        np.exp(part, out=part)
        part /= widths * sqrt(2 * pi)
        return np.asarray(part @ weights)

    def _middle(self, width: float) -> float:
        centres, widths, weights = self._parts(width)
        if centres.size == 1:
            return 0.0
        ends = float((centres - 9 * widths).min()), float((centres + 9 * widths).max())
        return float(brentq(lambda x: ndtr((x - centres) / widths) @ weights - 0.5, *ends))

    def _parts(self, width: float) -> tuple[Array, Array, Array]:
        """Return centres, widths and weights of normal laws."""
        if not self:
            return np.zeros(1), np.full(1, width), np.ones(1)
        k = np.linspace(-_END, _END, _NODES)
        weights = np.exp(-(k**2) / 2)
        s = self.log_sigma
        own = self.mean * np.exp(s * k - s**2 / 2)
        noise = width * np.sqrt(1 + self.shot * (own / self.mean - 1))
        between = own * s * (k[1] - k[0])  # where they lie far apart, each stands for all between
        return own - self.mean, np.hypot(noise, between), weights / weights.sum()


def exponential(values: Array, rate: Array | float) -> Array:
    """Return the log-density of exponential variates of a rate beside normal noise of 1.

    Exponentially modified Gaussian (Grushka, Analytical Chemistry 44, 1972).
    """
    return np.asarray(np.log(rate) + rate**2 / 2 - rate * values + log_ndtr(values - rate))
