"""Peaks of power spectra, against the largest of as many bins of white noise."""

from functools import lru_cache

import numpy as np
import scipy.special
from numpy.typing import NDArray

from dsis.measures.estimate import Estimate, estimate, unknown
from dsis.measures.median import median

Array = NDArray[np.float64]


def spectral_peak(power: Array, columns: int, degrees: int) -> Estimate:
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
    rows = power.shape[0]
    inner = power[1:, 1 : (columns + 1) // 2]
    edge = power[1 : (rows + 1) // 2, columns // 2] if columns % 2 == 0 else power[:0, 0]
    alone = [power[rows // 2, columns // 2]] if rows % 2 == 0 and columns % 2 == 0 else []
    return _peak(inner.reshape(-1), edge, np.array(alone), degrees)


def line_peak(power: Array, lines: int, degrees: int) -> Estimate:
    """Return the largest bin of a 1-D spectrum (lines // 2 + 1), the mean left out."""
    alone = power[lines // 2 :] if lines % 2 == 0 else power[:0]
    return _peak(power[1 : (lines + 1) // 2], power[:0], alone, degrees)


def _peak(inner: Array, edge: Array, alone: Array, degrees: int) -> Estimate:
    """Return the largest of complex bins (`inner`, `edge`) and of self-conjugate ones (`alone`)."""
    if inner.size < 4:
        return unknown()
    middle, density = _median_of_white(degrees)
    white = median(inner) / middle
    if white == 0:
        return unknown()
    value = max(float(part.max()) for part in (inner, edge, alone) if part.size) / white
    mean, variance = _largest_of_white(inner.size + edge.size, alone.size, degrees)
    # The median of K bins scatters by 1 / (4 K density^2); the largest is divided by it.
    scatter = 1 / (4 * inner.size * (density * middle) ** 2)
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
