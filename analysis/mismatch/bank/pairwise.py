"""Sums within kernels, in the order in which numpy adds a contiguous array: the same bytes."""

import numpy as np
from numpy.typing import NDArray

from dsis.compiled import kernel

Array = NDArray[np.float64]
_BLOCK = 128  # values that are added at once


@kernel
def total(values: Array) -> float:
    """Return the sum of contiguous values, by halves down to blocks, eight partial sums in each."""
    size = values.size
    if size > _BLOCK:
        half = size // 2
        half -= half % 8
        return total(values[:half]) + total(values[half:])
    found, done = 0.0, 0
    if size >= 8:
        a, b, c, d = values[0], values[1], values[2], values[3]
        e, f, g, h = values[4], values[5], values[6], values[7]
        done = 8
        while done + 8 <= size:
            a += values[done]
            b += values[done + 1]
            c += values[done + 2]
            d += values[done + 3]
            e += values[done + 4]
            f += values[done + 5]
            g += values[done + 6]
            h += values[done + 7]
            done += 8
        found = ((a + b) + (c + d)) + ((e + f) + (g + h))
    for i in range(done, size):
        found += values[i]
    return found
