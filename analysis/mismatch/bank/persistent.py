"""Which pixels, and which parts of the sensor, are noisy in every exposure."""

from math import sqrt

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.linemeans import AXES
from analysis.mismatch.bank.robust import drawn_in
from analysis.mismatch.bank.scalars import UNKNOWN, Number, ratio_root
from analysis.mismatch.bank.seams import SMOOTH_DEGREE, beyond_smooth
from dsis.compiled import kernel, pairwise_sum
from dsis.measures.fixed_pattern import Smooth

Array = NDArray[np.float64]
SURFACE = "smooth_variance_spread"
BY_LINE = tuple(f"{axis}_variance_spread" for axis in AXES)
_BOWED = 2  # degree of surfaces that lean or bow
_OF_MANY = 1.5  # standard deviations that many pixels are off by
OUTSTANDING = (4, 7, 12)  # standard deviations of a pixel's summed variance


class VarianceSums:
    """Which pixels are noisy in every exposure.

    Products of the pixel variances of different exposures: what they have in common is a property
    of the pixel (its read noise, a trap); heavy tails and spikes leave it at zero.
    """

    def __init__(self, shape: tuple[int, int]) -> None:
        self.total = np.zeros(shape)
        self.squares, self.fourths = 0.0, 0.0

    def add(self, variance_map: Array, weight: float) -> None:
        """Take the variance of each pixel (row, column) of one exposure."""
        square = _add(np.ascontiguousarray(variance_map), weight, self.total.reshape(-1))
        self.squares += square
        self.fourths += square**2

    def numbers(self) -> dict[str, Number]:
        """Return persistence, surface, lines, and how many pixels stand out by so many deviations.

        Counts enter as twice their root (Anscombe 1948), of standard deviation 1.
        """
        found = {"variance_persistence": self._persistence()}
        found[SURFACE] = _surface(drawn_in(self.total))
        many = drawn_in(self.total, _OF_MANY)
        found |= {name: _lines(many, along) for along, name in enumerate(BY_LINE)}
        sd = sqrt(self.squares)
        for limit in OUTSTANDING:
            count = int((self.total > limit * sd).sum()) if sd > 0 else 0
            found[f"noisy_pixels of {limit}"] = (2 * sqrt(count + 3 / 8), 1.0)
        return found

    def _persistence(self) -> Number:
        """Return the mean product of different exposures in units of its null error."""
        excess = float((self.total**2).mean()) - self.squares
        null = 2 * (self.squares**2 - self.fourths) / self.total.size
        if null <= 1e-12 * self.squares**2:
            return UNKNOWN
        return excess / sqrt(null), 1.0


def _surface(apart: Array) -> Number:
    """Return the power of surfaces that lean or bow in the summed variances: 1 if all is white.

    Of orthonormal polynomials of first and second degree, in the square of single pixels. Few
    pixels that are far noisier count as much as any of the many may.
    """
    smooth = Smooth.of(*apart.shape)
    if smooth.degree < _BOWED:
        return UNKNOWN
    found = smooth.coefficients(apart)
    order = np.arange(len(found))[:, np.newaxis] + np.arange(len(found))
    squares = found[(order > 0) & (order <= _BOWED)] ** 2
    rest = float((apart**2).sum() - squares.sum() - found[0, 0] ** 2)
    free = apart.size - squares.size - 1
    if free <= 0 or not rest > 0:
        return UNKNOWN
    return ratio_root(float(squares.mean()) * free / rest, squares.size, free)


def _lines(apart: Array, along: int) -> Number:
    """Return the mean square of rows' (0) or columns' (1) summed variances, 1 if all is white.

    Beyond what is smooth across them, in the square of single pixels. Those that are noisier than
    most are so by as much wherever they lie: the track of a particle makes no line noisy.
    """
    lines, across = apart.shape[along], apart.shape[1 - along]
    degrees, free = lines - 1 - SMOOTH_DEGREE, lines * (across - 1)
    if degrees < 1 or free < 1:
        return UNKNOWN
    means = apart.mean(1 - along)
    rest = float((apart**2).sum() - across * (means**2).sum())
    if not rest > 0:
        return UNKNOWN
    power = across * float((beyond_smooth(means) ** 2).sum()) / degrees
    return ratio_root(power * free / rest, degrees, free)


@kernel
def _add(variances: Array, weight: float, into: Array) -> float:
    """Add weighted variances of pixels about their mean, relative to it; return their mean square.

    Nothing where the mean is none.
    """
    flat = variances.reshape(-1)
    mean = pairwise_sum(flat) / flat.size
    if not mean > 0:
        return 0.0
    squares = np.empty(flat.size)
    for i in range(flat.size):
        part = weight * (flat[i] / mean - 1)
        into[i] += part
        squares[i] = part * part
    return pairwise_sum(squares) / flat.size
