"""Mean and variance of a rounded, clipped Gaussian: Sheppard's 1/12 fails below 0.5 DN."""

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

Array = NDArray[np.float64]
_WIDE = 1.0  # DN; above, and away from the ends, rounding adds 1/12 to 1e-8
_REACH = 8.0
_STEPS, _SMALL = 40, 1e-5


def rounded(
    mean_dn: float, variance_dn2: float, white_dn: float, step_dn: float = 1.0
) -> tuple[float, float]:
    """Return what rounding to codes 0, step .. white and clipping add to mean and variance.

    DN and DN^2.
    """
    if step_dn != 1:
        shift, added = rounded(mean_dn / step_dn, variance_dn2 / step_dn**2, white_dn // step_dn)
        return shift * step_dn, added * step_dn**2
    sigma = max(variance_dn2, 1e-12) ** 0.5
    inside = _REACH * sigma < mean_dn < white_dn - _REACH * sigma
    if sigma > _WIDE and inside:
        return 0.0, 1 / 12
    low = max(int(np.floor(mean_dn - _REACH * sigma)) - 1, 0)
    high = min(int(np.ceil(mean_dn + _REACH * sigma)) + 1, int(white_dn))
    if high - low > 4096:  # far wider than a code: only the ends matter
        codes = np.unique(np.linspace(low, high, 4097).round())
    else:
        codes = np.arange(low, high + 1, dtype=np.float64)
    if codes.size < 2:
        return float(codes[0] - mean_dn) if codes.size else 0.0, -variance_dn2
    edges = (codes[1:] + codes[:-1]) / 2
    below = np.concatenate([[0.0], ndtr((edges - mean_dn) / sigma), [1.0]])
    share = np.diff(below)
    mean = float((share * codes).sum())
    variance = float((share * (codes - mean) ** 2).sum())
    return mean - mean_dn, variance - max(variance_dn2, 0.0)


def unrounded(
    mean_dn: float, variance_dn2: float, white_dn: float, step_dn: float = 1.0
) -> tuple[float, float, float]:
    """Return the mean, the variance and d variance / d recorded variance before rounding.

    The inverse of `rounded`, by Newton's steps on both. Where all samples have one code nothing can
    be told: the variance comes back as recorded, and the derivative as infinite.
    """
    if step_dn != 1:
        before, variance, slope = unrounded(
            mean_dn / step_dn, variance_dn2 / step_dn**2, white_dn // step_dn
        )
        return before * step_dn, variance * step_dn**2, slope
    if variance_dn2 > 4 * _WIDE**2 and variance_dn2**0.5 * _REACH < mean_dn:
        return mean_dn, variance_dn2 - 1 / 12, 1.0
    if variance_dn2 <= 1e-4:
        return mean_dn, variance_dn2, np.inf
    mean, log_variance = mean_dn, np.log(max(variance_dn2 - 1 / 12, 0.03))
    inverse = np.eye(2)
    for _ in range(_STEPS):
        here = _recorded(mean, log_variance, white_dn)
        columns = [
            (_recorded(mean + _SMALL, log_variance, white_dn) - here) / _SMALL,
            (_recorded(mean, log_variance + _SMALL, white_dn) - here) / _SMALL,
        ]
        inverse = np.linalg.pinv(np.stack(columns, 1), rcond=1e-6)
        step = inverse @ (np.array([mean_dn, variance_dn2]) - here)
        mean += float(np.clip(step[0], -0.2, 0.2))
        log_variance += float(np.clip(step[1], -0.5, 0.5))
        if np.abs(step).max() < 1e-9:
            break
    variance = float(np.exp(log_variance))
    return float(mean), variance, float(abs(inverse[1, 1]) * variance)


def _recorded(mean_dn: float, log_variance: float, white_dn: float) -> Array:
    variance = float(np.exp(log_variance))
    shift, added = rounded(mean_dn, variance, white_dn)
    return np.array([mean_dn + shift, variance + added])
