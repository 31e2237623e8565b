"""Mean and variance of a rounded, clipped Gaussian: Sheppard's 1/12 fails below 0.5 DN."""

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.special import ndtr

from dsis.effects.quantisation import last_step, whole_codes

Array = NDArray[np.float64]
_WIDE = 1.0  # DN; above, and away from the ends, rounding adds 1/12 to 1e-8
_REACH = 8.0
_ROUNDS = 12  # of steps that are no whole number of codes
_LEAST_LOG = -14.0  # of a variance, codes^2: less is none
_SOLVED = 1e-8  # codes and squared codes
_CUT = 5.0  # recorded standard deviations: nearer to an end noise was cut, and was wider before
_WIDER = 4.0  # times as wide, and as far out of it, at most: beyond, little is left of its shape
_THIRD = 1e-3  # share of the third code, below which two are all there is
_NARROW = (0.08, 0.12, 0.17, 0.24, 0.34, 0.48)  # standard deviations, codes


def rounded(
    mean_dn: float,
    variance_dn2: float,
    white_dn: float,
    step_dn: float = 1.0,
    phase_dn: float = 0.0,
) -> tuple[float, float]:
    """Return what rounding to codes and clipping add to mean and variance, DN and DN^2.

    The codes are phase, phase + step .. up to white; 0 <= phase < step.
    """
    if step_dn != 1:
        mean, last = (mean_dn - phase_dn) / step_dn, last_step(white_dn, step_dn, phase_dn)
        shift, added = rounded(mean, variance_dn2 / step_dn**2, last)
        more = _whole(mean_dn, variance_dn2, white_dn, step_dn, phase_dn)
        return shift * step_dn + more[0], added * step_dn**2 + more[1]
    sigma = max(variance_dn2, 1e-12) ** 0.5
    inside = _REACH * sigma < mean_dn < white_dn - _REACH * sigma
    if sigma > _WIDE and inside:
        return 0.0, 1 / 12
    codes, share = _codes(mean_dn, sigma, white_dn)
    if codes.size < 2:
        return float(codes[0] - mean_dn), -variance_dn2
    mean = float((share * codes).sum())
    variance = float((share * (codes - mean) ** 2).sum())
    return mean - mean_dn, variance - max(variance_dn2, 0.0)


def _whole(
    mean_dn: float, variance_dn2: float, white_dn: float, step_dn: float, phase_dn: float
) -> tuple[float, float]:
    """Return what whole codes add to the mean and the variance of steps that are none."""
    if float(step_dn).is_integer() and float(phase_dn).is_integer():
        return 0.0, 0.0
    sigma = max(variance_dn2, 1e-12) ** 0.5 / step_dn
    numbers, share = _codes(
        (mean_dn - phase_dn) / step_dn, sigma, last_step(white_dn, step_dn, phase_dn)
    )
    steps = phase_dn + step_dn * numbers
    (first, before), (second, after) = (
        (mean := float(share @ own), float(share @ (own - mean) ** 2))
        for own in (steps, whole_codes(numbers, step_dn, phase_dn))
    )
    return second - first, after - before


def _codes(mean_dn: float, sigma_dn: float, white_dn: float) -> tuple[Array, Array]:
    """Return the codes that occur, and the share of samples that each has."""
    last = int(white_dn)
    low = min(max(int(np.floor(mean_dn - _REACH * sigma_dn)) - 1, 0), last)
    high = max(min(int(np.ceil(mean_dn + _REACH * sigma_dn)) + 1, last), 0)
    if high - low > 4096:  # far wider than a code: only the ends matter
        codes = np.unique(np.linspace(low, high, 4097).round())
    else:
        codes = np.arange(low, high + 1, dtype=np.float64)
    edges = (codes[1:] + codes[:-1]) / 2
    below = np.concatenate([[0.0], ndtr((edges - mean_dn) / sigma_dn), [1.0]])
    return codes, np.diff(below)


def unrounded(
    mean_dn: float,
    variance_dn2: float,
    white_dn: float,
    step_dn: float = 1.0,
    phase_dn: float = 0.0,
) -> tuple[float, float, float, float]:
    """Return the mean and the variance before rounding, and by how much their errors grow.

    The inverse of `rounded`. The third is the standard error of the variance before rounding over
    that of a normal variate of the recorded variance, the fourth that of the mean over that of the
    recorded one: mean and variance of few codes err together, as their third and fourth moments
    say. Where all samples have one code nothing can be told: the variance comes back as recorded,
    and the third and the fourth are infinite.
    """
    if step_dn != 1:
        last, before, variance = last_step(white_dn, step_dn, phase_dn), mean_dn, variance_dn2
        whole = float(step_dn).is_integer() and float(phase_dn).is_integer()
        for _ in range(1 if whole else _ROUNDS):  # what whole codes add depends on what was before
            shift, added = _whole(before, variance, white_dn, step_dn, phase_dn)
            mean = (mean_dn - shift - phase_dn) / step_dn
            left = max(variance_dn2 - added, 0.0) / step_dn**2
            before, variance, *errors = unrounded(mean, left, last)
            before, variance = before * step_dn + phase_dn, variance * step_dn**2
        return before, variance, errors[0], errors[1]
    end = min(mean_dn, white_dn - mean_dn)
    if variance_dn2 > 4 * _WIDE**2 and variance_dn2**0.5 * _REACH < end:
        return mean_dn, variance_dn2 - 1 / 12, 1.0, 1.0
    if variance_dn2 <= 1e-4:
        return mean_dn, variance_dn2, np.inf, np.inf
    recorded = np.array([mean_dn, variance_dn2])

    def miss(at: Array) -> Array:
        return np.asarray(_recorded(float(at[0]), float(at[1]), white_dn) - recorded)

    usual = np.array([mean_dn, np.log(max(variance_dn2 - 1 / 12, 0.03))])
    far, wider, sd = 1.0, 1.0, variance_dn2**0.5
    if sd > _WIDE / 2 and end < _CUT * sd:
        far, wider = max(_WIDER * sd, 1.0), _WIDER**2
    most = max(np.log(wider * variance_dn2 + 1), usual[1] + 1e-3)
    inside = ([mean_dn - far, _LEAST_LOG], [mean_dn + far, most])
    found = least_squares(miss, usual, bounds=inside, xtol=1e-13, ftol=1e-13, gtol=1e-13)
    if np.abs(found.fun).max() > _SOLVED:  # narrow noise: far from the start, past flat stretches
        starts = [
            np.array([mean_dn + offset, 2 * np.log(sigma)])
            for offset in np.linspace(-0.45, 0.45, 7)
            for sigma in _NARROW
        ]
        start = min(starts, key=lambda at: float(np.abs(miss(at)).max()))
        other = least_squares(miss, start, bounds=inside, xtol=1e-13, ftol=1e-13, gtol=1e-13)
        found = min(found, other, key=lambda one: float(one.cost))
    mean, log_variance = (float(value) for value in found.x)
    variance = float(np.exp(log_variance))
    inverse = np.linalg.pinv(np.asarray(found.jac), rcond=1e-9)
    inverse[1] *= variance
    codes, share = _codes(mean, variance**0.5, white_dn)
    second, cube, fourth = (float((share * (codes - mean_dn) ** k).sum()) for k in (2, 3, 4))
    apart = np.array([[second, cube], [cube, fourth - second**2]])
    of_mean, of_variance = (float(row @ apart @ row) for row in inverse)
    if np.abs(found.fun).max() >= _SOLVED or not min(of_mean, of_variance) > 0:
        return mean, variance, np.inf, np.inf
    grown = np.sqrt([of_variance / (2 * variance_dn2**2), of_mean / variance_dn2])
    return mean, variance, float(grown[0]), float(grown[1])


def of_two_codes(mean_dn: float, variance_dn2: float, white_dn: float) -> bool:
    """Return whether all but one in a thousand samples of rounded noise have two codes, or one.

    Their variance follows from their mean, and says nothing besides.
    """
    _, share = _codes(mean_dn, max(variance_dn2, 1e-12) ** 0.5, white_dn)
    return bool(share.size < 3 or np.sort(share)[-3] < _THIRD)


def _recorded(mean_dn: float, log_variance: float, white_dn: float) -> Array:
    variance = float(np.exp(log_variance))
    shift, added = rounded(mean_dn, variance, white_dn)
    return np.array([mean_dn + shift, variance + added])
