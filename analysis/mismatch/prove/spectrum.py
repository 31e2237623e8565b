"""The spectrum of a model's normal scores, by few numbers, from virtual frames.

What a virtual sensor's mean periodogram has more than that of its base model, which is white, is
described by bands along both axes (lines and columns), correlations at short lags and along one
line, bands off the axes, and single bins that stand out. What is not sure is left white.
"""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from analysis.mismatch.prove.whittle import bin_counts, means_bins
from dsis.cfa import Cfa

Array = NDArray[np.float64]
_LEAST_POWER = 0.02
_NEAR = 3  # lags in both directions
_ALONG = 48  # lags along one line
_PEAK = 8.0  # robust standard deviations between bins
_LEAST_PEAK = 0.7  # of white noise: less gains next to nothing
_ROUNDS = 3
_SURE = 2.5  # standard errors below which an excess counts as none


def spectrum_of(excess: Array, frames: int, shape: tuple[int, int], cfa: Cfa) -> Array | None:
    """Return the spectrum 1 + excess, smoothed: (row, column // 2 + 1); None: white.

    Parameters
    ----------
    excess
        Mean periodogram of the model's frames less that of the base model's.
    frames
        Frames that were averaged.
    shape
        Rows and columns of the field.
    cfa
        Colour filter array.
    """
    counts = bin_counts(shape, cfa)
    excess = np.where(counts > 0, excess, 0.0)
    noise = np.sqrt(2 / frames)
    peaks = _peaks(excess)
    plain = np.where(peaks, 0.0, excess)
    made = _off_axes(plain, peaks, shape, frames)
    made[1:, 0] += _banded((plain - made)[1:, 0], shape[0], 1, noise)
    made[0, 1:] += _banded((plain - made)[0, 1:], shape[1], 2, noise)
    made = np.where(peaks, excess, made)
    for y, x in means_bins(shape, cfa):
        made[y, x] = 0.0
    if not made.any():
        return None
    return np.maximum(1 + made, _LEAST_POWER)


def _peaks(excess: Array) -> NDArray[np.bool_]:
    """Return single bins that stand out of their surroundings: of the axes, and of the rest."""
    found = np.zeros(excess.shape, np.bool_)
    for part in ((slice(1, None), 0), (0, slice(1, None)), (slice(1, None), slice(1, None))):
        own = excess[part]
        middle = float(np.median(own))
        spread = 1.4826 * float(np.median(np.abs(own - middle)))
        found[part] = own - middle > np.maximum(_PEAK * spread, _LEAST_PEAK * (1 + max(middle, 0)))
    return found


def _banded(excess: Array, size: int, per_bin: int, noise: float) -> Array:
    """Return an axis averaged in bands of |frequency| that double, from the lowest up."""
    number = np.arange(1, excess.size + 1)
    away = np.minimum(number, size - number)
    band = np.ceil(np.log2(away)).astype(np.intp)
    mean = float(excess.mean())
    made = np.full(excess.size, _sure(mean, noise * (1 + mean) / np.sqrt(excess.size * per_bin)))
    for label in np.unique(band):
        members = band == label
        rest = float((excess[members] - made[members]).mean())
        error = noise * (1 + abs(mean)) / np.sqrt(members.sum() * per_bin)
        made[members] += _sure(rest, error)
    return made


def _off_axes(
    excess: Array, peaks: NDArray[np.bool_], shape: tuple[int, int], frames: int
) -> Array:
    """Return the smooth spectrum that bins off the axes show: lags, then bands of what they leave.

    Lags describe the axes as well; bands are left to `_banded` there.
    """
    inside = ~peaks
    inside[0, :] = inside[:, 0] = False
    # Bins that are left out are filled by the lags themselves: two rounds suffice, they are few.
    made = np.zeros_like(excess)
    error = 1 / np.sqrt(frames * shape[0] * shape[1])
    for _ in range(_ROUNDS):
        lags = fft.irfft2(np.where(inside, excess, made), shape)
        kept = np.where(_short_lags(shape), _sure_array(lags, error), 0.0)
        made = fft.rfft2(kept).real
    rest = np.where(inside, excess - made, 0.0)
    across = rest[1:, 1:].sum(0) / np.maximum(inside[1:, 1:].sum(0), 1)
    made[1:, 1:] += _bands_of(across, shape[0], np.arange(1, shape[1] // 2 + 1), frames)
    down = rest[1:, 1:].sum(1) / np.maximum(inside[1:, 1:].sum(1), 1)
    number = np.arange(1, shape[0])
    away = np.minimum(number, shape[0] - number)
    made[1:, 1:] += _bands_of(down, shape[1] // 2, away, frames)[:, np.newaxis]
    return made


def _bands_of(profile: Array, across: int, away: NDArray[np.intp], frames: int) -> Array:
    """Return a profile averaged in bands that double; each entry is a mean over `across` bins."""
    band = np.ceil(np.log2(np.maximum(away, 1))).astype(np.intp)
    made = np.zeros(profile.size)
    for label in np.unique(band):
        members = band == label
        error = 1 / np.sqrt(frames * across * members.sum())
        made[members] = _sure(float(profile[members].mean()), error)
    return made


@lru_cache(maxsize=8)
def _short_lags(shape: tuple[int, int]) -> NDArray[np.bool_]:
    """Return which lags of a covariance (row, column), wrapped, are described singly."""
    y = np.minimum(np.arange(shape[0]), shape[0] - np.arange(shape[0]))[:, np.newaxis]
    x = np.minimum(np.arange(shape[1]), shape[1] - np.arange(shape[1]))[np.newaxis]
    near = (y <= _NEAR) & (x <= _NEAR)
    along = ((y == 0) & (x <= min(_ALONG, shape[1] // 4))) | (
        (x == 0) & (y <= min(_ALONG, shape[0] // 4))
    )
    return np.asarray(near | along, np.bool_)


def _sure(value: float, error: float) -> float:
    """Return a value shrunk by how sure it is; nothing below `_SURE` standard errors."""
    return float(_sure_array(np.array(value), error))


def _sure_array(values: Array, error: float) -> Array:
    doubt = (_SURE * error) ** 2
    share = np.maximum(1 - doubt / np.maximum(values**2, 1e-30), 0)
    shrunk: Array = values * share
    return shrunk
