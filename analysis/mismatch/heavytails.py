"""How far numbers whose law has heavier tails than a normal one depart.

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


def degrees(keys: Sequence[Key], drawn: Array) -> Array:
    """Return the degrees of freedom of the law of each number: (number,); inf: a normal one.

    Numbers of a statistic and scope have in common how heavy their tails are, at least.

    Parameters
    ----------
    keys
        Of the numbers.
    drawn
        Of simulated recordings: (simulation, number), four of them or more.
    """
    count = len(drawn)
    excess, error = _excess(drawn), sqrt(24 / count)
    groups: dict[tuple[str, str], list[int]] = {}
    for i, key in enumerate(keys):
        groups.setdefault((key.statistic, key.scope), []).append(i)
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


def equivalent(departures: Array, own: Array, common: float) -> Array:
    """Return departures that are as rare under Student's law of `common` degrees of freedom.

    Parameters
    ----------
    departures
        In standard deviations: (number,).
    own
        Degrees of freedom of their own laws, of unit variance, above 2: (number,); inf: the common.
    common
        Degrees of freedom by which they will be judged.
    """
    heavy = np.isfinite(own) & (departures != 0)
    far, nu = np.abs(departures[heavy]), own[heavy]
    chances = scipy.special.stdtr(nu, -far * np.sqrt(nu / (nu - 2)))
    found = departures.copy()
    found[heavy] = -np.sign(departures[heavy]) * scipy.special.stdtrit(common, chances)
    return found
