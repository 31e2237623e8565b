"""What a calibration of the base model can know: standard errors in closed form."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from planter.case import Case


@dataclass(frozen=True)
class Precision:
    """Standard errors of a segment's slope (DN) and intercept (DN^2), of the black level (DN)."""

    slope_se: float
    intercept_se: float
    black_se: float


def levels(case: Case) -> Iterator[tuple[float, int]]:
    """Yield (signal DN, number of samples) of every channel of darks and flats."""
    weights = dict(zip("RGB", case.response, strict=True))
    for plan in case.exposures:
        if plan.kind == "scene":
            continue
        for name, place in case.channels().items():
            size = np.empty((case.rows, case.columns), bool)[place].size
            yield plan.signal_dn * weights.get(name[0], weights["G"]), size * (plan.frames - 1)


def precision(case: Case, segment: int) -> Precision:
    """Return what this recording says about a segment: weighted least squares of its levels.

    A variance of n samples has the standard error v sqrt(2 / n); rounding adds 1/12 to v.
    """
    path = case.segments[segment]
    low = case.segments[segment - 1].upper_dn if segment else -np.inf
    high = np.inf if path.upper_dn is None else path.upper_dn
    within = [(s, n) for s, n in levels(case) if low <= s < high]
    signal, samples = np.array([s for s, _ in within]), np.array([n for _, n in within])
    variance = path.slope * signal + path.intercept + 1 / 12
    weight = samples / (2 * variance**2)
    design = np.stack([signal, np.ones_like(signal)], 1)
    information = design.T @ (weight[:, None] * design)
    covariance = np.linalg.pinv(information)
    dark = [n for s, n in levels(case) if s == 0]
    black = np.sqrt((case.segments[0].intercept + 1 / 12) / sum(dark)) if dark else np.nan
    return Precision(float(np.sqrt(covariance[0, 0])), float(np.sqrt(covariance[1, 1])), black)
