"""The median, exactly that of `numpy.median`: most calls are for few thousand values."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from dsis.compiled import kernel

_PARTS = 512  # of the range of values: that which holds the middle is looked at again
_FEW = 64  # values that are selected among one by one
_ROUNDS = 4  # far values may keep nearly all others in one part


def median(values: NDArray[np.floating]) -> float:
    """Return the median of all values, nan where one of them is; there must be some."""
    return float(_median(np.ascontiguousarray(values).reshape(-1)))


@kernel
def _median(values: NDArray[np.floating]) -> Any:
    size = values.size
    for i in range(size):
        if values[i] != values[i]:
            return values[i]
    half = size // 2
    upper = _ranked(values, half)
    if size % 2:
        return upper
    below, lower = 0, values.min()
    for i in range(size):
        v = values[i]
        below += v < upper
        lower = max(lower, v) if v < upper else lower
    if below < half:
        lower = upper
    return (lower + upper) / values.dtype.type(2)


@kernel
def _ranked(values: NDArray[np.floating], rank: int) -> Any:
    """Return the value that so many others precede in ascending order."""
    left, place = values, rank
    for _ in range(_ROUNDS):
        low, high = left[0], left[0]
        for i in range(left.size):
            low, high = min(low, left[i]), max(high, left[i])
        if low == high:
            return low
        scale = np.float64(_PARTS - 1) / (np.float64(high) - np.float64(low))
        if left.size <= _FEW or not 0 < scale < np.inf:
            break
        # Rounding keeps the order, so parts hold values that follow one another.
        parts = np.empty(left.size, np.int32)
        counts = np.zeros(_PARTS, np.int64)
        for i in range(left.size):
            parts[i] = np.int32((np.float64(left[i]) - np.float64(low)) * scale)
        for i in range(left.size):
            counts[parts[i]] += 1
        part = 0
        while counts[part] <= place:
            place -= counts[part]
            part += 1
        within, k = np.empty(counts[part], left.dtype), 0
        for i in range(left.size):
            if parts[i] == part:
                within[k] = left[i]
                k += 1
        left = within
    return _selected(left.copy(), place)


@kernel
def _selected(values: NDArray[np.floating], rank: int) -> Any:
    """Return the value of a rank among values, which are reordered (Hoare 1961)."""
    first, last = 0, values.size - 1
    while first < last:
        pivot = values[(first + last) // 2]
        i, j = first, last
        while i <= j:
            while values[i] < pivot:
                i += 1
            while values[j] > pivot:
                j -= 1
            if i <= j:
                values[i], values[j] = values[j], values[i]
                i += 1
                j -= 1
        if rank <= j:
            last = j
        elif rank >= i:
            first = i
        else:
            break
    return values[rank]
