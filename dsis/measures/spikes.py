"""Where a few values make most of a variance: then the quartiles say what the others have."""

import numpy as np
from numpy.typing import NDArray

SPIKED = 1.5  # times the variance of the many; only tails as heavy as Student's of 2.7 reach it
_QUARTILES = 1.3489795  # of the normal law, apart


def variance_of_quartiles(low: float, high: float) -> float:
    """Return the variance of the normal law that has these quartiles, in their unit squared."""
    return ((high - low) / _QUARTILES) ** 2


def without_spikes(plain: float, most: float) -> float:
    """Return a variance; that of the many where a few values make most of it."""
    return most if plain > SPIKED * most > 0 else plain


def variance_of_most(values: NDArray[np.float64]) -> float:
    """Return the variance of values of any shape, without outliers where they dominate it."""
    low, high = np.percentile(values, [25, 75])
    return without_spikes(float(values.var()), variance_of_quartiles(float(low), float(high)))
