"""Likelihood of a field of normal scores by its spectrum (Whittle, 1953), against white noise."""

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from dsis.cfa import Cfa

Array = NDArray[np.float64]


def periodogram(fields: NDArray[np.floating]) -> Array:
    """Return the power |F|^2 / N of each bin: (..., row, column // 2 + 1); 1 for white noise."""
    bins = fft.rfft2(fields)
    power = (bins.real**2 + bins.imag**2) / (fields.shape[-1] * fields.shape[-2])
    return np.asarray(power, np.float64)


def bin_counts(shape: tuple[int, int], cfa: Cfa) -> Array:
    """Return how many dimensions each bin of a half spectrum stands for.

    Bins of the means of the sites count nothing: levels have a law of their own.
    """
    rows, columns = shape
    counts = np.full((rows, columns // 2 + 1), 2.0)
    counts[:, 0] = 1.0
    if columns % 2 == 0:
        counts[:, -1] = 1.0
    for y, x in means_bins(shape, cfa):
        counts[y, x] = 0.0
    return counts


def means_bins(shape: tuple[int, int], cfa: Cfa) -> tuple[tuple[int, int], ...]:
    """Return the bins that hold the means of the sites."""
    if cfa is Cfa.MONO:
        return ((0, 0),)
    return tuple((y, x) for y in (0, shape[0] // 2) for x in (0, shape[1] // 2))


def whittle_gain(fields: NDArray[np.floating], spectrum: Array, counts: Array) -> Array:
    """Return the log-likelihood of each field under a spectrum less that of white noise, nats.

    -1/2 sum (ln P + I / P - I) over all dimensions; exact on a torus.
    """
    power = periodogram(fields)
    terms = np.log(spectrum) + power * (1 / spectrum - 1)
    gain: Array = -0.5 * (counts * terms).sum((-2, -1))
    return gain
