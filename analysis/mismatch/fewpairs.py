"""Which numbers hang on a few pairs of spikes, and how much farther they scatter for it."""

from collections.abc import Mapping, Sequence
from math import inf, sqrt

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.key import Key

Array = NDArray[np.float64]
_TAILED = 1.0  # excess kurtosis of a sum of products, from which it is not near normal
_OF_PRODUCTS = ("correlation", "spectr", "alternation", "carry_over")


def widening(keys: Sequence[Key], values: Array, errors: Array, recorded: Array) -> Array:
    """Return by how much sums of products depart farther by chance than a normal law says.

    A sum of N products of samples of excess kurtosis K has an excess kurtosis of (3 + K)^2 / N. Of
    spikes that is what pairs of them bring: 1 / that is how many there are, and one moves the sum
    by the root of it in standard deviations. inf: of unknown law.

    Parameters
    ----------
    keys
        Of the numbers.
    values
        Of simulated recordings: (recording, number).
    errors
        In white noise, (number,): that of a kurtosis is (24 / N)^(1/2).
    recorded
        Of the recording, (number,): spikes that no model explains yet meet by chance as well.
    """
    pairs = {
        key.place: (3 + max(float(np.median(values[:, i])), recorded[i])) * errors[i] / sqrt(24)
        for i, key in enumerate(keys)
        if (key.statistic, key.scope) == ("kurtosis", "exposure")
    }
    tailed = {place: wide for place, wide in pairs.items() if wide > sqrt(_TAILED)}
    return np.array([_widened(key, tailed) for key in keys])


def _widened(key: Key, tailed: Mapping[tuple[str, str], float]) -> float:
    """Return the factor of a number that is a sum of products, of a place among these or of all."""
    if not tailed or key.statistic.startswith("fixed"):
        return 1.0
    if not any(word in key.statistic for word in _OF_PRODUCTS):
        return 1.0
    return tailed.get(key.place, 1.0) if key.scope == "exposure" else inf
