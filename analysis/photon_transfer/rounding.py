"""Undo rounding to whole codes: mean and variance of a Gaussian from those of its codes.

The Fourier series of the rounding error gives for N(mu, sigma) and w_k = (-1)^k exp(-2 (pi k s)^2):

    E round   = mu + sum w_k sin(2 pi k mu) / (pi k)
    Var round = sigma^2 + 1/12 + sum w_k cos(2 pi k mu) (4 sigma^2 + 1 / (pi k)^2) - (bias)^2

s^2 = sigma^2 + the variance of the pixels' fixed offsets, over which mu spreads. Above one code of
noise only Sheppard's 1/12 is left. (Widrow & Kollar, "Quantization noise", 2008, chapters 4, 9.)
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

SHEPPARD_DN2 = 1 / 12
_SMOOTH_DN2 = 1.0  # beyond this variance the series is below 1e-7
_LEAST_SD_DN = 0.25  # below it the codes hardly move: the noise cannot be recovered
_TERMS = np.arange(1, 5)


@dataclass(frozen=True)
class Unrounded:
    """Level and variance before rounding, with their standard errors; DN and DN^2."""

    level_dn: float
    level_se_dn: float
    variance_dn2: float
    variance_se_dn2: float
    recovered: bool


def rounded_moments(mean_dn: float, sd_dn: float, fixed_dn2: float = 0.0) -> tuple[float, float]:
    """Return mean and temporal variance of codes: Gaussian noise, offsets spread by `fixed_dn2`."""
    k = _TERMS
    spread = sd_dn**2 + max(fixed_dn2, 0.0)
    weight = (-1.0) ** k * np.exp(-2 * (np.pi * k) ** 2 * spread)
    bias = float((weight * np.sin(2 * np.pi * k * mean_dn) / (np.pi * k)).sum())
    wave = weight * np.cos(2 * np.pi * k * mean_dn) * (4 * sd_dn**2 + 1 / (np.pi * k) ** 2)
    return mean_dn + bias, float(sd_dn**2 + SHEPPARD_DN2 + wave.sum() - bias**2)


def as_coded(
    level_dn: float, level_se_dn: float, variance_dn2: float, variance_se_dn2: float
) -> Unrounded:
    """Return level and variance of codes with Sheppard's 1/12 taken off, whatever they are."""
    plain = variance_dn2 - SHEPPARD_DN2
    return Unrounded(level_dn, level_se_dn, plain, variance_se_dn2, recovered=True)


def unrounded(
    level_dn: float,
    level_se_dn: float,
    variance_dn2: float,
    variance_se_dn2: float,
    fixed_dn2: float = 0.0,
    step_dn: int = 1,
    phase_dn: int = 0,
) -> Unrounded:
    """Return level and variance before rounding; `recovered` is false where codes hide the noise.

    Parameters
    ----------
    level_dn, level_se_dn, variance_dn2, variance_se_dn2
        Mean code, temporal variance of codes, and their standard errors.
    fixed_dn2
        Variance of the pixels' fixed offsets.
    step_dn
        Step between codes: rounding adds its square over 12.
    phase_dn
        The lowest of them, below the step.
    """
    if step_dn > 1:
        k, k2 = step_dn, step_dn**2
        level = (level_dn - phase_dn) / k
        one = unrounded(
            level, level_se_dn / k, variance_dn2 / k2, variance_se_dn2 / k2, fixed_dn2 / k2
        )
        return Unrounded(
            one.level_dn * k + phase_dn,
            one.level_se_dn * k,
            one.variance_dn2 * k2,
            one.variance_se_dn2 * k2,
            one.recovered,
        )
    plain = variance_dn2 - SHEPPARD_DN2
    if not variance_dn2 <= _SMOOTH_DN2:  # one frame's nan too
        return as_coded(level_dn, level_se_dn, variance_dn2, variance_se_dn2)

    def miss(at: np.ndarray) -> list[float]:
        mean, variance = rounded_moments(float(at[0]), float(at[1]), fixed_dn2)
        return [mean - level_dn, variance - variance_dn2]

    start = [level_dn, max(np.sqrt(max(plain, 0.0)), 0.35)]
    bounds = ([level_dn - 0.5, 0.05], [level_dn + 0.5, 1.5])
    found = least_squares(miss, start, bounds=bounds, xtol=1e-12, ftol=1e-12, gtol=1e-12)
    mean, sd = (float(value) for value in found.x)
    jacobian = np.array(found.jac)
    jacobian[:, 1] /= 2 * sd  # with respect to the variance
    solved = bool(np.abs(found.fun).max() < 1e-6) and abs(np.linalg.det(jacobian)) > 0.05
    if not solved or sd < _LEAST_SD_DN:
        return Unrounded(level_dn, level_se_dn, plain, variance_se_dn2, recovered=False)
    inverse = np.linalg.inv(jacobian)
    errors = np.sqrt((inverse**2) @ np.array([level_se_dn**2, variance_se_dn2**2]))
    return Unrounded(mean, float(errors[0]), sd**2, float(errors[1]), recovered=True)
