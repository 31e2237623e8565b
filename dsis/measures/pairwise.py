"""Sums in kernels whose rounding error does not grow with what is summed."""

import numpy as np
from numpy.typing import NDArray

from dsis.compiled import kernel

_ALONE = 128  # values that are summed in one loop


@kernel
def summed(values: NDArray[np.float64]) -> float:
    """Return the sum of values (any,), in the order in which `numpy.sum` adds them."""
    if values.size > _ALONE:
        half = values.size // 2 // 8 * 8
        return summed(values[:half]) + summed(values[half:])
    a = b = c = d = e = f = g = h = 0.0  # which do not wait for one another
    end = values.size // 8 * 8
    for i in range(0, end, 8):
        a += values[i]
        b += values[i + 1]
        c += values[i + 2]
        d += values[i + 3]
        e += values[i + 4]
        f += values[i + 5]
        g += values[i + 6]
        h += values[i + 7]
    total = ((a + b) + (c + d)) + ((e + f) + (g + h))
    for i in range(end, values.size):
        total += values[i]
    return total
