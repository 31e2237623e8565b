"""The scatter of the many: few pixels or lines that are far out do not change it."""

import numpy as np
from numpy.typing import NDArray

from dsis.compiled import kernel, pairwise_sum
from dsis.measures.median import median

Array = NDArray[np.float64]
_MEDIAN = 0.455  # of chi-squared of one degree of freedom
FAR_OUT = 5.0  # standard deviations of the many, beyond which values are far out
FEW = 0.1  # share of values that are few
EFFICIENCY = 0.37  # of a normal variate's scale by its quartiles, or the median of its squares


def typical_square(values: Array) -> float:
    """Return the mean square that normal values of this median square have."""
    return median(values**2) / _MEDIAN


def drawn_in(values: Array, farthest: float = FAR_OUT) -> Array:
    """Return values about their mean; those far out count as so far out as the many ever are.

    So many standard deviations of the many are the `farthest`.
    """
    apart = values - values.mean()
    limit = farthest * typical_square(apart) ** 0.5
    return np.asarray(np.clip(apart, -limit, limit))


@kernel
def drawn_in_mean(pairs: Array, farthest: float, rounds: int) -> float:
    """Return the mean of values with weights, (value, 2), by so many rounds of reweighting.

    Values farther off than so many standard deviations, whose squares the weights are the inverse
    of, do not bend it (Huber).
    """
    size = len(pairs)
    weights, products = pairs[:, 1].copy(), np.empty(size)
    mean = 0.0
    for again in range(rounds + 1):
        for i in range(size):
            value, weight = pairs[i]
            if again:
                far = abs(value - mean) * np.sqrt(weight)
                weights[i] = weight * min(1.0, farthest / max(far, 1e-12))
            products[i] = value * weights[i]
        mean = pairwise_sum(products) / pairwise_sum(weights)
    return float(mean)
