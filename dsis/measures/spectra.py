"""Peaks of power spectra, against the largest of as many bins of white noise."""

from functools import lru_cache

import numpy as np
import scipy.special
from numpy.typing import NDArray

from dsis.compiled import kernel
from dsis.measures.estimate import Estimate, estimate, unknown
from dsis.measures.median import middle_and_largest

Array = NDArray[np.float64]
_FEWEST = 4  # bins that have a median worth the name


def spectral_peak(power: NDArray[np.floating], columns: int, degrees: int) -> Estimate:
    """Return the largest bin of a 2-D spectrum relative to white noise.

    The axes are left out: they hold what rows, columns and frames have in common. White is the
    median bin over the median of chi-squared, so a few peaks do not raise it.

    Parameters
    ----------
    power
        Half plane of a real transform (row, columns // 2 + 1), mean over frames.
    columns
        Columns of the image.
    degrees
        Independent frames in the mean.
    """
    rows = len(power)
    inner = (rows - 1) * ((columns + 1) // 2 - 1)  # complex bins but those of the last column
    if inner < _FEWEST:
        return unknown()
    middle, largest = _middle_of_plane(power, columns)
    last = columns % 2 == 0
    bins, alone = inner + last * ((rows + 1) // 2 - 1), last and rows % 2 == 0
    return _peak(middle, largest, (inner, bins, int(alone)), degrees)


def line_peak(power: Array, lines: int, degrees: int) -> Estimate:
    """Return the largest bin of a 1-D spectrum (lines // 2 + 1), the mean left out."""
    inner = (lines + 1) // 2 - 1
    if inner < _FEWEST:
        return unknown()
    middle, largest = _middle_of_line(power, inner)
    return _peak(middle, largest, (inner, inner, power.size - 1 - inner), degrees)


@kernel
def _middle_of_plane(power: NDArray[np.floating], columns: int) -> tuple[float, float]:
    """Return the median of complex bins, and the largest of all off the axes."""
    rows, last = power.shape[0], (columns + 1) // 2
    inner = np.empty((rows - 1) * (last - 1), power.dtype)
    i, largest = 0, 0.0
    for y in range(1, rows):
        for x in range(1, last):
            inner[i] = power[y, x]
            i += 1
    if columns % 2 == 0:
        for y in range(1, rows // 2 + 1):  # the others are their conjugates
            largest = max(largest, np.float64(power[y, last]))
    middle, of_inner = middle_and_largest(inner)
    return middle, max(of_inner, largest)


@kernel
def _middle_of_line(power: Array, inner: int) -> tuple[float, float]:
    """Return the median of the complex bins, and the largest but the mean."""
    middle, largest = middle_and_largest(power[1 : inner + 1])
    for i in range(inner + 1, power.size):
        largest = max(largest, power[i])
    return middle, largest


def _peak(middle: float, largest: float, bins: tuple[int, int, int], degrees: int) -> Estimate:
    """Return the largest relative to white noise, from the median bin and the largest.

    `bins`: those that the median is of, complex ones, and self-conjugate ones.
    """
    inner, whole, alone = bins
    middle_of_white, density = _median_of_white(degrees)
    white = middle / middle_of_white
    if white == 0:
        return unknown()
    value = largest / white
    mean, variance = _largest_of_white(whole, alone, degrees)
    # The median of K bins scatters by 1 / (4 K density^2); the largest is divided by it.
    scatter = 1 / (4 * inner * (density * middle_of_white) ** 2)
    null_value, null = mean * (1 + scatter), variance + mean**2 * scatter
    # A line of fixed amplitude and free phase in white noise: non-central chi-squared.
    excess = max(value - null_value - 3 * null**0.5, 0.0)
    return estimate(value, null * (1 + excess) ** 2 + 2 * excess / (degrees + 1), null_value, null)


@lru_cache(maxsize=256)
def _median_of_white(degrees: int) -> tuple[float, float]:
    """Return the median of Gamma(degrees)/degrees, and the density of that variate there."""
    middle = float(scipy.special.gammaincinv(degrees, 0.5)) / degrees
    log_density = (degrees - 1) * np.log(middle * degrees) - middle * degrees
    return middle, float(degrees * np.exp(log_density - scipy.special.gammaln(degrees)))


@lru_cache(maxsize=256)
def _largest_of_white(bins: int, alone: int, degrees: int) -> tuple[float, float]:
    """Return mean and variance of the largest of `bins` Gamma(degrees)/degrees variates.

    `alone` further bins have half the degrees of freedom (real transforms at a Nyquist corner).
    """
    top = 1 + 12 * np.sqrt(2 / degrees) + (np.log(bins + 1) + 30) * 2 / degrees
    x = np.linspace(0, top, 20001)
    below = bins * _log_share_below(degrees, x)
    if alone:
        below += alone * _log_share_below(degrees / 2, x)
    over = -np.expm1(below)
    mean = float(np.trapezoid(over, x))
    return mean, float(np.trapezoid(2 * x * over, x)) - mean**2


def _log_share_below(shape: float, x: Array) -> Array:
    """Return the logarithm of the share of Gamma(shape)/shape variates below x >= 0."""
    above = scipy.special.gammaincc(shape, shape * x)
    share: Array = np.log1p(-np.minimum(above, 1 - 1e-16))
    return share
