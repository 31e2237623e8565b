"""Level against light and exposure time, with the errors that matter to a straight line.

Pixel noise averages out over 10^5 pixels; what is left is how the whole frame wanders: drift of the
black level and flicker of the light. Both are fitted to the frame means of all exposures, since two
frames of one exposure say little of either.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import nan

import numpy as np
import scipy.optimize
from numpy.typing import NDArray

from dsis.measures.measured import Measured

Array = NDArray[np.float64]
_LEAST_DN2 = 1e-12  # keeps identical frames and levels of zero from dividing by nothing


@dataclass(frozen=True)
class Response:
    """Response of one channel, exposures in the order given.

    Attributes
    ----------
    light
        Light per frame, linear unit of the recording; nan where unknown.
    exposure_time_s
        Exposure time, s.
    level_dn, standard_error_dn
        Mean level, DN above the nominal black, and its error from the wander of frame means; light
        that drifts slower than an exposure lasts is not in it.
    drift_dn, flicker
        Standard deviation of the offset from frame to frame, DN, and of the light, relative.
    """

    light: Array
    exposure_time_s: Array
    level_dn: Array
    standard_error_dn: Array
    drift_dn: float
    flicker: float


def response(
    exposures: Sequence[Measured],
    exposure_time_s: Sequence[float],
    light: Sequence[float | None] | None = None,
) -> dict[str, Response]:
    """Return the response by channel over the exposures of one recording.

    Raises ValueError where the sequences differ in length.
    """
    lights = [None] * len(exposures) if light is None else list(light)
    if not len(exposures) == len(exposure_time_s) == len(lights) > 0:
        found = f"{len(exposures)} exposures, {len(exposure_time_s)} times, {len(lights)} lights"
        message = f"{found}: must be as many of each, one at least"
        raise ValueError(message)
    units = np.array([nan if value is None else value for value in lights])
    times = np.array(exposure_time_s, np.float64)
    return {
        name: _channel([one.channels[name].frame_means for one in exposures], units, times,
                       [_white(one, name) for one in exposures])
        for name in exposures[0].channels
    }  # fmt: skip


def _white(one: Measured, name: str) -> float:
    """Return the variance of a frame mean that pixel, row and column noise give, DN^2."""
    found = one.channels[name].estimates
    n, m = one.channels[name].mean_frame.shape
    rows, columns = found["row_variance"].value, found["column_variance"].value
    pixels = found["pixel_variance"].value / (n * m)
    return float(pixels + max(rows, 0.0) / n + max(columns, 0.0) / m)


def _channel(series: list[Array], light: Array, time: Array, white: list[float]) -> Response:
    """Fit variance of frame means = white + drift^2 + (flicker level)^2, both terms positive."""
    level = np.array([means.mean() for means in series])
    frames = np.array([means.size for means in series])
    found = np.array([means.var(ddof=1) for means in series])
    expected = np.maximum(white, _LEAST_DN2)
    design = np.stack([np.ones_like(level), level**2 + _LEAST_DN2], axis=1)
    drift2, flicker2 = 0.0, 0.0
    for _ in range(20):  # reweighted by the fitted variances: var s^2 = 2 sigma^4 / (T - 1)
        fitted = expected + drift2 + flicker2 * level**2
        weight = np.sqrt((frames - 1) / 2) / fitted
        weighted = design * weight[:, None]
        scale = np.linalg.norm(weighted, axis=0)
        solved, _ = scipy.optimize.nnls(weighted / scale, (found - expected) * weight)
        drift2, flicker2 = (float(part) for part in solved / scale)
    error = np.sqrt((expected + drift2 + flicker2 * level**2) / frames)
    return Response(light, time, level, error, drift2**0.5, flicker2**0.5)
