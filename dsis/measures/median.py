"""The median, exactly that of `numpy.median`: most calls are for few thousand values."""

from math import isnan
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dsis.compiled import kernel

_PARTS = 512  # of the range of values: that which holds the middle is looked at again
_FEW = 64  # values that are selected among one by one
_MANY = 1 << 15  # values of which numpy finds the limits sooner
_ROUNDS = 4  # far values may keep nearly all others in one part


def median(values: NDArray[np.floating]) -> float:
    """Return the median of all values, nan where one of them is; there must be some."""
    flat = np.ascontiguousarray(values).reshape(-1)
    if not flat.size:
        message = "there are no values, of which none is in the middle"
        raise ValueError(message)
    if flat.size < _MANY:
        return middle_and_largest(flat)[0]
    low, high = flat.min(), flat.max()
    return float(low if low == high or isnan(low) else _median(flat, low, high))


@kernel
def middle_and_largest(values: NDArray[np.floating]) -> tuple[float, float]:
    """Return the median of values (any,), and the largest; both nan where one of them is."""
    low, high = _limits(values)
    if low == high or np.isnan(low):
        return np.float64(low), np.float64(high)
    return np.float64(_median(values, low, high)), np.float64(high)


@kernel
def _median(values: NDArray[np.floating], low: Any, high: Any) -> Any:
    half = values.size // 2
    left, place = _around(values, half, low, high)
    upper = _selected(left, place)
    if values.size % 2:
        return upper
    # What is selected has those before it on its left.
    lower = _largest(left[:place]) if place else _largest_below(values, upper)
    return (lower + upper) / values.dtype.type(2)


@kernel
def _around(values: NDArray[np.floating], rank: int, low: Any, high: Any) -> Any:
    """Return some of the values, all between two of them, and the rank among these."""
    left, place = values, rank
    for _ in range(_ROUNDS):
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
        low, high = _limits(left)
    return left.copy(), place


@kernel
def _limits(values: NDArray[np.floating]) -> Any:
    """Return the least and the largest value, nan where one is not a number."""
    a = b = c = d = values[0]  # which do not wait for one another
    e = f = g = h = values[0]
    unknown, end = False, values.size // 4 * 4
    for i in range(0, end, 4):
        p, q, r, s = values[i], values[i + 1], values[i + 2], values[i + 3]
        a, b, c, d = min(a, p), min(b, q), min(c, r), min(d, s)
        e, f, g, h = max(e, p), max(f, q), max(g, r), max(h, s)
        unknown |= np.isnan(p) | np.isnan(q) | np.isnan(r) | np.isnan(s)
    for i in range(end, values.size):
        a, e = min(a, values[i]), max(e, values[i])
        unknown |= np.isnan(values[i])
    if unknown:
        a = e = values.dtype.type(np.nan)
    else:
        a, e = min(a, b, c, d), max(e, f, g, h)
    return a, e


@kernel
def _largest(values: NDArray[np.floating]) -> Any:
    return values.max()


@kernel
def _largest_below(values: NDArray[np.floating], least: Any) -> Any:
    """Return the largest of the values below one that is not the least of them."""
    found = values.min()
    for i in range(values.size):
        v = values[i]
        found = max(found, v) if v < least else found
    return found


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
