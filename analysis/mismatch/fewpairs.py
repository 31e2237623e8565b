"""Which numbers hang on a few pairs of spikes, so that their spread says little."""

from collections.abc import Sequence
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.key import Key

Array = NDArray[np.float64]
_TAILED = 1.0  # excess kurtosis of a sum of products, from which it is not near normal
_OF_PRODUCTS = ("correlation", "spectr", "alternation")


def of_few_pairs(keys: Sequence[Key], values: Array, errors: Array) -> NDArray[np.bool_]:
    """Return which sums of products cannot be judged by their spread under a model.

    A sum of N products of samples of excess kurtosis K has an excess kurtosis of (3 + K)^2 / N.

    Parameters
    ----------
    keys
        Of the numbers.
    values
        Of simulated recordings: (recording, number).
    errors
        In white noise, (number,): that of a kurtosis is (24 / N)^(1/2).
    """
    tailed = {
        key.place
        for i, key in enumerate(keys)
        if (key.statistic, key.scope) == ("kurtosis", "exposure")
        and (3 + float(np.median(values[:, i]))) * errors[i] > sqrt(24 * _TAILED)
    }
    return np.array([bool(tailed) and _hangs(key, tailed) for key in keys], np.bool_)


def _hangs(key: Key, tailed: set[tuple[str, str]]) -> bool:
    """Return whether a number is a sum of products, of a place among these or of all."""
    if key.statistic.startswith("fixed") or not any(w in key.statistic for w in _OF_PRODUCTS):
        return False
    return key.scope != "exposure" or key.place in tailed
