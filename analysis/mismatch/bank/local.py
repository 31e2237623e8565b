"""The temporal measures of one channel of a static scene, by local signal.

The noise of a scene's pixels follows their signal. With v the variance of a pixel and
q(p) = mean(v^p) / mean(v)^p over the channel, moments of noise that has the same shape everywhere
are q(3/2) and q(2) times what they are in uniform light, and are divided by it; the errors follow
from the same sums. Fixed patterns are not told from the picture.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.scalars import CORRELATIONS, NAMES, UNKNOWN, Number, scalars
from analysis.mismatch.scenes import Local
from dsis.measures import Channel
from dsis.measures.moments import kept

Array = NDArray[np.float64]
_MOMENTS = {"skewness": 3, "kurtosis": 4, "kurtosis_within_pixels": 4}
_LEAST = 2000  # samples that a moment is worth: of fewer it is not near normal
_LINES = {"row_variance": 1, "column_variance": 0}
LOCAL_NAMES = (
    *_LINES,
    "frame_variance",
    *_MOMENTS,
    *CORRELATIONS,
    "spectral_peak",
    "row_spectrum_peak",
    "frame_correlation",
)


def local_scalars(channel: Channel, frames: int, local: Local) -> dict[str, Number]:
    """Return every number of `LOCAL_NAMES` of a channel of a scene.

    Parameters
    ----------
    channel
        Measured from so many `frames`.
    local
        Its pixels by signal.
    """
    found = scalars(channel, frames)
    if found[NAMES[0]] == UNKNOWN or not channel.variance_map.mean() > 0:
        return dict.fromkeys(LOCAL_NAMES, UNKNOWN)
    variance = _at_pixels(channel, local)
    numbers = {name: found[name] for name in LOCAL_NAMES}
    for name in (*CORRELATIONS, "frame_correlation"):
        numbers[name] = found[name][0], found[name][1] * _q(variance, 2) ** 0.5
    for name, axis in _LINES.items():
        numbers[name] = found[name][0], found[name][1] * _q(variance.mean(axis), 2) ** 0.5
    size = (frames, *variance.shape)
    for name, power in _MOMENTS.items():
        value, error = found[name]
        own, square = _q(variance, power / 2), _q(variance, power)
        if (frames - 1) * variance.size * own**2 / square < _LEAST:
            numbers[name] = UNKNOWN
            continue
        if name != "kurtosis_within_pixels":
            value /= own
        if name == "kurtosis":  # what Gaussian residuals of unequal variance show is taken off
            value += 3 * kept(*size, 2) ** 2 / kept(*size, 4) * (1 / own - 1)
        numbers[name] = value, error * square**0.5 / own
    return numbers


def widened(
    numbers: Mapping[str, Number], channels: Mapping[str, Channel], parts: Mapping[str, Local]
) -> dict[str, Number]:
    """Return what channels have in common, errors of lines widened as their variances differ."""
    found = dict(numbers)
    for name, axis in _LINES.items():
        lines = [_at_pixels(channels[c], parts[c]).mean(axis) for c in channels]
        known = [own for own in lines if own.mean() > 0]
        factor = max((_q(own, 2) ** 0.5 for own in known), default=1.0)
        found[name] = found[name][0], found[name][1] * factor
    return found


def variances(channel: Channel, local: Local) -> Array:
    """Return the variance in each range of signal, DN^2.

    Means of lines that are taken off bring the noise of bright pixels to dark ones: to first order
    a pixel's v is measured as v (1 - 1/n - 1/m) + (mean of its row) / m + (of its column) / n.
    """
    found = channel.variance_map
    n, m = found.shape
    others = found.mean(1)[:, np.newaxis] / m + found.mean(0) / n
    return local.by_range(found * (1 + 1 / n + 1 / m) - others)


def _q(variance: Array, power: float) -> float:
    return float((variance**power).mean() / variance.mean() ** power)


def _at_pixels(channel: Channel, local: Local) -> Array:
    """Return the variance of pixels of like signal, at each pixel, DN^2."""
    return np.maximum(variances(channel, local), 0.0)[local.labels]
