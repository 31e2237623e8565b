"""Evidence in what stays: mean maps that are offsets, gains or dark currents of pixels."""

from collections.abc import Callable

import numpy as np
from scipy.ndimage import gaussian_filter

from planter.evidence.look import Evidence, Look

# Exposure times that follow light closer than this leave no dark current to see.
LEAST_INDEPENDENT = 1e-6


def coefficient_map(look: Look, wanted: str, *free: str) -> np.ndarray | None:
    """Return each pixel's coefficient of "offset", "gain" or "time", others being free.

    Weighted least squares of the exposures' mean maps, each channel's mean taken off. None where
    the exposures cannot tell: two patterns are proportional.
    """
    places = look.exposures()
    plans = [look.case.exposures[e] for e in places]
    patterns = {
        "offset": np.ones(len(plans)),
        "gain": np.array([plan.signal_dn for plan in plans]),
        "time": np.array([plan.exposure_time_s for plan in plans]),
    }
    design = np.stack([patterns[name] for name in (wanted, *free)], 1)
    design /= np.abs(design).max(0)
    # Codes that never move are known to a code, not without error.
    variance = np.array([max(np.var(look.residuals[e]), 1 / 12) for e in places])
    weight = np.array([plan.frames for plan in plans]) / variance
    scaled = design * np.sqrt(weight / weight.max())[:, None]
    if np.linalg.svd(scaled, compute_uv=False)[-1] < LEAST_INDEPENDENT:
        return None
    coefficient = np.linalg.pinv(scaled)[0] * np.sqrt(weight / weight.max())
    total = np.zeros(look.means[0].shape)
    for c, e in zip(coefficient, places, strict=True):
        centred = look.means[e].copy()
        for place in look.case.channels().values():
            centred[place] -= centred[place].mean()
        total += c * centred
    return total


def pixels(look: Look, wanted: str, *free: str) -> Evidence:
    """Return the variance of a coefficient map less its rows and columns."""
    return _of(look, wanted, free, lambda m: np.var(m - m.mean(0) - m.mean(1)[:, None]))


def blurred(look: Look, width: float, wanted: str, *free: str) -> Evidence:
    """Return the variance of a coefficient map that is blurred, less its lines and what is wide.

    Uneven light is wide too: it says nothing.
    """

    def value(m: np.ndarray) -> float:
        own = m - m.mean(0) - m.mean(1)[:, None]
        return float(np.var(gaussian_filter(own, width) - gaussian_filter(own, min(m.shape) / 8)))

    return _of(look, wanted, free, value)


def lines(look: Look, axis: int, wanted: str = "offset", free: str = "gain") -> Evidence:
    """Return the variance of fixed offsets, or gains, of lines; axis 1 means rows."""
    return _of(look, wanted, (free,), lambda m: np.var(m.mean(axis)))


def outliers(look: Look, wanted: str, *free: str) -> Evidence:
    """Return how far the upper tail of a coefficient map reaches."""
    return _of(look, wanted, free, upper_tail)


def along(look: Look, template: np.ndarray, wanted: str, *free: str) -> Evidence:
    """Return a coefficient map's share of a template."""
    template = template.astype(float)
    for place in look.case.channels().values():
        template[place] -= template[place].mean()
    return _of(look, wanted, free, lambda m: np.mean(m * template))


def _of(
    look: Look, wanted: str, free: tuple[str, ...], value: Callable[[np.ndarray], float]
) -> Evidence:
    found = coefficient_map(look, wanted, *free)
    return Evidence(np.zeros(1) if found is None else np.array([float(value(found))]))


def upper_tail(values: np.ndarray) -> float:
    """Return the mean square excess over 2.5 robust standard deviations, in units of them."""
    centre = np.median(values)
    deviation = 1.4826 * np.median(np.abs(values - centre))
    return float(np.mean(np.maximum((values - centre) / deviation - 2.5, 0) ** 2))


def noise_map(look: Look) -> np.ndarray:
    """Return each pixel's temporal variance, all exposures weighted as read noise is best seen."""
    total, weights = np.zeros(look.means[0].shape), 0.0
    for e in look.exposures():
        z = look.residuals[e]
        own = np.sum(np.square(z), 0) / (len(z) - 1)
        weight = (len(z) - 1) / np.mean(own) ** 2
        total += weight * own
        weights += weight
    total /= weights
    for place in look.case.channels().values():
        total[place] /= total[place].mean()
    return total


def noise_spread(look: Look) -> Evidence:
    """Return the variance of the pixels' own variances."""
    return Evidence(np.array([np.var(noise_map(look))]))


def noise_outliers(look: Look) -> Evidence:
    """Return how far the noisiest pixels reach."""
    return Evidence(np.array([upper_tail(noise_map(look))]))
