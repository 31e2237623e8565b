"""The scatter of the many: few pixels or lines that are far out do not change it."""

import numpy as np
from numpy.typing import NDArray

from dsis.measures.median import median

Array = NDArray[np.float64]
_MEDIAN = 0.455  # of chi-squared of one degree of freedom
_FAR_OUT = 5.0  # standard deviations, beyond which values count as so far out


def typical_square(values: Array) -> float:
    """Return the mean square that normal values of this median square have."""
    return median(values**2) / _MEDIAN


def drawn_in(values: Array) -> Array:
    """Return values about their mean; those far out count as so far out as the many ever are."""
    apart = values - values.mean()
    limit = _FAR_OUT * typical_square(apart) ** 0.5
    return np.asarray(np.clip(apart, -limit, limit))
