"""Normal scores of probabilities."""

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

Array = NDArray[np.float64]
_FARTHEST = 1e-9  # probability: scores end at six standard deviations


def normal_scores(chances: Array) -> Array:
    """Return the normal deviates below which one lies by these chances; they end at six."""
    return np.asarray(ndtri(np.clip(chances, _FARTHEST, 1 - _FARTHEST)))
