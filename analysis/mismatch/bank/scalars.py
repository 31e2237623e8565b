"""The measures of one channel of one exposure, transformed so that they are near normal.

Mean squares enter as the cube root of their ratio to the next finer one (Wilson and Hilferty 1931:
chi-squared^(1/3) is normal, var 2 / (9 dof)); largest values by the normal score of Gumbel's law.
"""

from collections.abc import Mapping
from functools import lru_cache
from math import cbrt, exp, inf, isfinite, log, log2, nan, pi, sqrt

import numpy as np
import scipy.special

from analysis.mismatch.bank.framenoise import NAME as FRAME_NOISE
from analysis.mismatch.bank.framenoise import unequal_noise
from dsis.measures import Channel, Estimate
from dsis.measures.fixed_pattern import Smooth
from dsis.measures.median import median

Number = tuple[float, float]
"""Transformed value and its standard deviation in white noise; nan where unknown."""

UNKNOWN: Number = (nan, inf)
_EULER = 0.5772156649
_CODE_SD = 0.1  # codes on every second DN stand at ten of these
CORRELATIONS = (
    "correlation_0_1",
    "correlation_1_0",
    "correlation_1_1",
    "correlation_0_2",
    "correlation_2_0",
)
NAMES = (
    "row_variance",
    "column_variance",
    "frame_variance",
    FRAME_NOISE,
    "skewness",
    "kurtosis",
    "kurtosis_within_pixels",
    *CORRELATIONS,
    "spectral_peak",
    "row_spectrum_peak",
    "frame_correlation",
    "variance_spread",
    "one_off_outliers",
    "code_spacing",
    "code_imbalance",
    "fixed_pixel_variance",
    "fixed_row_variance",
    "fixed_column_variance",
    "fixed_smooth_variance",
    "fixed_correlation_0_1",
    "fixed_correlation_1_0",
)
OF_MEAN_FRAMES = frozenset(name for name in NAMES if name.startswith("fixed_"))
OF_CODES = frozenset({"code_spacing", "code_imbalance"})


def scalars(channel: Channel, frames: int) -> dict[str, Number]:
    """Return every number of `NAMES` of a channel that was measured from so many frames."""
    found = channel.estimates
    n, m = channel.mean_frame.shape
    pixel = found["pixel_variance"].value
    if not pixel > 0:
        return dict.fromkeys(NAMES, UNKNOWN)
    numbers = {
        **_components(found, pixel, (frames, n, m)),
        **_fixed(found, pixel, (frames, n, m)),
        "kurtosis_within_pixels": _plain(channel.kurtosis_within_pixels),
        FRAME_NOISE: ratio_root(*unequal_noise(channel)),
        "one_off_outliers": _largest(channel, frames),
        "variance_spread": _spread(found["variance_spread"], frames),
        "code_spacing": _spacing(found["code_spacing"]),
    }
    for name in ("spectral_peak", "row_spectrum_peak"):
        numbers[name] = _peak(found[name])
    for name in (*CORRELATIONS, "skewness", "kurtosis", "frame_correlation", "code_imbalance",
                 "fixed_correlation_0_1", "fixed_correlation_1_0"):  # fmt: skip
        numbers[name] = _plain(found[name])
    return {name: numbers[name] for name in NAMES}


def ratio_root(ratio: float, dof: float, dof_of_finer: float = inf) -> Number:
    """Return the cube root of a ratio of mean squares, and its standard deviation about one."""
    if not isfinite(ratio) or dof <= 0:
        return UNKNOWN
    return cbrt(ratio), sqrt(2 / (9 * dof) + 2 / (9 * dof_of_finer))


def _components(
    found: Mapping[str, Estimate], pixel: float, size: tuple[int, int, int]
) -> dict[str, Number]:
    frames, n, m = size
    seen = frames - 1
    dof = seen * (n - 1) * (m - 1)
    row = pixel + m * found["row_variance"].value
    column = pixel + n * found["column_variance"].value
    still = max(row + column - pixel, pixel)
    frame = still + n * m * found["frame_variance"].value
    return {
        "row_variance": ratio_root(row / pixel, seen * (n - 1), dof),
        "column_variance": ratio_root(column / pixel, seen * (m - 1), dof),
        "frame_variance": ratio_root(frame / still, seen, dof),
    }


def _fixed(
    found: Mapping[str, Estimate], pixel: float, size: tuple[int, int, int]
) -> dict[str, Number]:
    """Return each part of the fixed pattern against the next finer one."""
    frames, n, m = size
    smooth = Smooth.of(n, m)
    mixed = smooth.kinds
    dof = (n - 1) * (m - 1) - mixed
    noise = pixel / frames
    square = noise + found["fixed_pixel_variance"].value
    if not square > 0:
        square = noise
    degree = smooth.degree
    kinds = mixed + 2 * degree
    return {
        "fixed_pixel_variance": ratio_root(square / noise, dof, dof * (frames - 1)),
        "fixed_row_variance": ratio_root(
            1 + m * found["fixed_row_variance"].value / square, n - 1 - degree, dof
        ),
        "fixed_column_variance": ratio_root(
            1 + n * found["fixed_column_variance"].value / square, m - 1 - degree, dof
        ),
        "fixed_smooth_variance": ratio_root(
            1 + n * m * found["fixed_smooth_variance"].value / square / kinds, kinds, dof
        ),
    }


def _plain(found: Estimate) -> Number:
    if not found.known or not isfinite(found.null_error):
        return UNKNOWN
    return found.value, found.null_error


def _spread(found: Estimate, frames: int) -> Number:
    if not found.known or frames < 3:
        return UNKNOWN
    white = 2 / (frames - 1)
    raw = found.value * (1 + white) + white
    if raw <= 0:
        return UNKNOWN
    return log(raw), found.null_error * (1 + white) / white


def _spacing(found: Estimate) -> Number:
    return (log2(found.value), _CODE_SD) if found.known else UNKNOWN


def _peak(found: Estimate) -> Number:
    if not found.known or not found.null_error > 0:
        return UNKNOWN
    scaled = pi / sqrt(6) * (found.value - found.null_value) / found.null_error + _EULER
    return gumbel_score(scaled), 1.0


def gumbel_score(scaled: float) -> float:
    """Return the normal score of a standard Gumbel variate."""
    return score_of_log(-scaled if scaled > 30 else log(-np.expm1(-exp(-scaled))))


def normal_score(chance: float) -> float:
    """Return the normal deviate that is exceeded with this probability."""
    return -float(scipy.special.ndtri(max(chance, 1e-300)))


def score_of_log(log_chance: float) -> float:
    """Return the normal deviate exceeded with a probability of which the logarithm is given.

    So a strong line has no highest score, from which on its amplitude could not be told.
    """
    return -float(scipy.special.ndtri_exp(min(log_chance, -1e-12)))


@lru_cache(maxsize=256)
def middle_of_gamma(degrees: float) -> float:
    """Return the median of a Gamma variate."""
    return float(scipy.special.gammaincinv(degrees, 0.5))


def _largest(channel: Channel, frames: int) -> Number:
    """Return the normal score of the largest pixel variance, chi-squared in white noise.

    Unknown where half of the pixels have one code in all frames: that is no such noise.
    """
    if frames < 3:
        return UNKNOWN
    middle = median(channel.variance_map)
    if not middle > 0:
        return UNKNOWN
    dof = frames - 1
    largest = float(channel.variance_map.max()) / middle * 2 * middle_of_gamma(dof / 2)
    single = float(scipy.special.gammaincc(dof / 2, largest / 2))
    chance = -np.expm1(channel.variance_map.size * np.log1p(-min(single, 0.5)))
    return normal_score(float(chance)), 1.0
