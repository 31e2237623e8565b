"""Functions of one channel as tables over the bits of single-precision numbers.

A colour transform spends most of its time on curves: logarithms, splines and powers of R, G and B
each for itself. Between two powers of two the table has 1024 points and is interpolated linearly,
so that its relative error is that of single precision, whatever the magnitude (see `Curve.of`).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dsis.compiled import kernel

_SHIFT = 13  # bits of the significand below a point of the table: 2^(23 - 13) points an octave
_SMALLEST, _INFINITE = 0x00800000, 0x7F800000  # bits of 2^-126 and of infinity
TOLERANCE = 4e-6  # relative, and absolute below 1: a thousandth of an 8-bit code

Pixels = NDArray[np.float32]


@dataclass(frozen=True)
class Curve:
    """Three functions of a number, one per channel, constant below zero.

    Attributes
    ----------
    values
        float32 (3, point): at 2^-126 and on, equidistant within every octave.
    at_zero
        float32 (3,): the value for zero, what rounds to it, and negative numbers.
    at_nan
        float32 (3,): the value for what is not a number.
    """

    values: NDArray[np.float32]
    at_zero: NDArray[np.float32]
    at_nan: NDArray[np.float32]

    @classmethod
    def of(cls, exact: Callable[[Pixels], Pixels]) -> "Curve | None":
        """Return the table of a function of pixels (pixel, 3), or None where none would do.

        The table must agree with `exact` halfway between all its points within `TOLERANCE`, and
        `exact` be constant below zero.
        """
        bits = np.arange(_SMALLEST, _INFINITE, 1 << _SHIFT, dtype=np.int32)
        points = _grey(bits.view(np.float32))
        values = exact(np.concatenate([points, _grey(np.array([np.inf], np.float32))]))
        at_zero, at_nan = exact(_grey(np.array([0, np.nan], np.float32)))
        curve = cls(np.ascontiguousarray(values.T), at_zero, at_nan)
        halfway = _grey((bits + (1 << _SHIFT >> 1)).view(np.float32))
        wanted, found = exact(halfway), halfway.copy()
        curve.apply(found)
        below = exact(-points[:: 1 << (23 - _SHIFT)])
        with np.errstate(invalid="ignore"):
            off = np.abs(found - wanted) > TOLERANCE * np.maximum(1, np.abs(wanted))
        known = np.isfinite(wanted) & np.isfinite(found)
        usable = np.array_equal(below, np.broadcast_to(at_zero, below.shape))
        return curve if usable and not (off & known).any() else None

    def apply(self, pixels: Pixels) -> None:
        """Replace contiguous pixels (..., 3) by their values."""
        _look_up(pixels.reshape(-1, 3), self.values, self.at_zero, self.at_nan)


def _grey(values: NDArray[np.float32]) -> Pixels:
    return np.repeat(values[:, np.newaxis], 3, axis=1)


@kernel
def _look_up(
    pixels: NDArray[np.float32],
    values: NDArray[np.float32],
    at_zero: NDArray[np.float32],
    at_nan: NDArray[np.float32],
) -> None:
    smallest = np.array([_SMALLEST], np.int32).view(np.float32)[0]
    step = np.float32(1.0 / (1 << _SHIFT))
    most = values.shape[1] - 2
    for i in range(pixels.shape[0]):
        for c in range(3):
            x = pixels[i, c]
            if x >= smallest:
                bits = np.float32(x).view(np.int32) - np.int32(_SMALLEST)
                point = min(np.intp(bits >> _SHIFT), most)
                part = np.float32(bits - np.int32(point << _SHIFT)) * step
                low = values[c, point]
                pixels[i, c] = low + part * (values[c, point + 1] - low)
            else:
                pixels[i, c] = at_zero[c] if x < smallest else at_nan[c]
