"""One pass over a histogram of codes: what is asked of every channel of every exposure."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dsis.compiled import kernel

Counts = NDArray[np.int64]
_PILE, _BEYOND = 0.25, 0.1  # shares of the samples
_STEEPLY = 1.75  # noise of 1.4 steps that is cut off at its mean; no code of a Gaussian


class Histogram(NamedTuple):
    """What a histogram shows.

    Attributes
    ----------
    total, squares
        Samples, and the sum of squared counts.
    clipped
        Whether the ends hold more than the tail of a smooth density would.
    used
        How many codes occur, without the first and the last where these may be clipped.
    first, step
        Place of the first of these, and the greatest common divisor of their distances; 0: one
        code, or none.
    low, high
        Places of the quartiles.
    """

    total: int
    squares: float
    clipped: bool
    used: int
    first: int
    step: int
    low: float
    high: float


@kernel
def limits(counts: Counts) -> tuple[int, int]:
    """Return the places of the first and the last count that is not zero."""
    first, last = 0, counts.size - 1
    while first < last and counts[first] == 0:
        first += 1
    while first < last and counts[last] == 0:
        last -= 1
    return first, last


@kernel
def histogram(counts: Counts) -> Histogram:
    """Return what a histogram shows, see `Histogram`."""
    total, squares = 0, 0.0
    for count in counts:
        total += count
        squares += np.float64(count) * count
    start, end = limits(counts)
    clipped = max(counts[0], counts[counts.size - 1]) > 5 + 0.1 * np.sqrt(np.float64(total))
    used, first, step, before = 0, 0, 0, 0
    for i in range(start + clipped, end + 1 - clipped):
        if counts[i] == 0:
            continue
        if used:
            a, b = step, i - before
            while b:
                a, b = b, a % b
            step = a
        else:
            first = i
        used, before = used + 1, i
    low, high = _place(counts, total, 0.25), _place(counts, total, 0.75)
    return Histogram(total, squares, clipped, used, first, step, low, high)


@kernel
def _place(counts: Counts, total: int, share: float) -> float:
    """Return the place below which a share of the samples lies, half of a code's own among them."""
    summed, before = counts[0], (counts[0] - counts[0] / 2) / total
    if share < before or counts.size == 1:
        return 0.0
    for i in range(1, counts.size):
        summed += counts[i]
        below = (summed - counts[i] / 2) / total
        if share < below:
            return i - 1.0 if before == share else 1 / (below - before) * (share - before) + i - 1
        before = below
    return counts.size - 1.0


@kernel
def squared(transform: NDArray[np.complex128]) -> NDArray[np.float64]:
    """Return the squared moduli of a transform (bin,)."""
    power = np.empty(transform.size)
    for i in range(transform.size):
        power[i] = transform[i].real * transform[i].real + transform[i].imag * transform[i].imag
    return power


def piled_up(counts: Counts) -> bool:
    """Return whether samples are cut off at the lowest code, the first of `counts`.

    There a quarter of all are, and far more than at the next code that occurs, while a tenth lies
    beyond: no normal noise so wide has none below.
    """
    total, lowest = int(counts.sum()), int(counts[0])
    if lowest < _PILE * total:
        return False
    next_one = int(counts[1 + int((counts[1:] > 0).argmax())]) if counts.size > 1 else 0
    return lowest >= _STEEPLY * next_one and total - lowest - next_one >= _BEYOND * total
