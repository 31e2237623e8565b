"""How rare departures are of numbers whose law has heavier tails than a normal one.

What few strong pixels, spikes or jumps bring is far from normal: their number and heights differ
from recording to recording. Simulated recordings show it by their excess kurtosis, which Student's
law has as 6 / (degrees - 4).
"""

from collections.abc import Sequence
from math import sqrt

import numpy as np
import scipy.special
from numpy.typing import NDArray

from analysis.mismatch.bank.key import Key

Array = NDArray[np.float64]
_CLEAR = 4.0  # standard errors of an excess kurtosis
_LEAST = 4.0  # degrees of freedom of the heaviest
_MANY = 32  # simulations that show tails
_COUNTED = "outlying_pixels"  # with a limit: of most recordings there is none


def degrees(keys: Sequence[Key], drawn: Array, known: NDArray[np.bool_]) -> Array:
    """Return the degrees of freedom of the law of each number: (number,); inf: a normal one.

    Numbers of a statistic and scope have in common how heavy their tails are, at least. Counts
    of pixels that next to no recording has say nothing of their tails.

    Parameters
    ----------
    keys
        Of the numbers.
    drawn
        Of simulated recordings: (simulation, number). Few show no tails: all are normal.
    known
        Which numbers are known.
    """
    count = len(drawn)
    if count < _MANY:
        return np.full(len(keys), np.inf)
    excess, error = _excess(drawn), sqrt(24 / count)
    groups: dict[tuple[str, str], list[int]] = {}
    for i, key in enumerate(keys):
        if known[i] and not (key.statistic == _COUNTED and key.detail):
            groups.setdefault((key.statistic, key.scope), []).append(i)
    told = np.array(sorted(i for which in groups.values() for i in which), np.intp)
    excess[np.setdiff1d(np.arange(len(keys)), told)] = 0.0
    heavy = np.where(excess > _CLEAR * error, excess, 0.0)
    for which in groups.values():
        common = float(excess[which].mean())
        if common > _CLEAR * error / sqrt(len(which)):
            heavy[which] = np.maximum(excess[which], common)
    with np.errstate(divide="ignore"):
        return np.asarray(_LEAST + 6 / heavy)


def _excess(drawn: Array) -> Array:
    """Return the excess kurtosis of each column, of which normal ones have none on the average."""
    count = len(drawn)
    spread = drawn.std(0)
    told = spread > 0
    z = (drawn - drawn.mean(0)) / np.where(told, spread, 1.0)
    biased = (z**4).mean(0) - 3
    unbiased = ((count + 1) * biased + 6) * (count - 1) / ((count - 2) * (count - 3))
    return np.asarray(np.where(told, unbiased, 0.0))


def chances(departures: Array, own: Array, common: float) -> Array:
    """Return the two-sided chance of each departure under Student's law of unit variance.

    Parameters
    ----------
    departures
        In standard deviations: (number,).
    own
        Degrees of freedom, above 2: (number,); inf: the common ones, of unit scale.
    common
        Degrees of freedom of how well the standard deviations are known.
    """
    far = np.abs(departures)
    found = 2 * scipy.special.stdtr(common, -far)
    heavy = own < common
    nu = own[heavy]
    found[heavy] = 2 * scipy.special.stdtr(nu, -far[heavy] * np.sqrt(nu / (nu - 2)))
    return np.asarray(found)
