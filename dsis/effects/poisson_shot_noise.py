"""Poisson shot noise: the skew of few electrons."""

import math
from collections.abc import Mapping
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from dsis.compiled import inlined, kernel
from dsis.effects.effect import Effect, Exposure, Image, OperatingPoint, Stage

EXACT_BELOW_ELECTRONS = 64.0


class PoissonShotNoise(Effect):
    """Shot noise counts whole electrons: mean and variance of the base model, Poisson's skew.

    N ~ Poisson(S / m), v = m N: variance m S, third central moment m^2 S. The count is the
    quantile of the base model's own normal deviate: exact below 64 electrons, above by Cornish and
    Fisher's expansion rounded to whole electrons. `shot = "poisson"` of the base model is the same.
    """

    kind: Literal["poisson_shot_noise"] = "poisson_shot_noise"

    stage: ClassVar[Stage] = Stage.CHARGE
    rank: ClassVar[int] = -100
    reference: ClassVar[str] = "Janesick, Photon Transfer, SPIE Press, 2007"
    measures: ClassVar[frozenset[str]] = frozenset({"skewness", "kurtosis"})
    confounders: ClassVar[str] = (
        "Its skew goes with the signal's root; impulse and clipping skew darks as well."
    )
    reshapes: ClassVar[str] = "shot_noise"

    def apply(self, image: Image, exposure: Exposure) -> Image:
        """Leave the image: the shot noise itself is reshaped."""
        del exposure
        return image

    def reshape(self, deviates: Image, exposure: Exposure) -> Image:
        """Return (N - mean) / sqrt(mean) of a Poisson count of shot variance / m^2 electrons."""
        segments = exposure.read_out.segments
        i = segments.index(exposure.expected_dn)
        m = segments.slope_dn[i].astype(np.float64)
        shot = np.maximum(m * exposure.expected_dn + np.minimum(segments.intercept_dn2[i], 0), 0)
        electrons = np.divide(shot, m * m, out=np.zeros_like(shot), where=m > 0)
        out = np.empty_like(deviates, order="C")
        _count(np.ascontiguousarray(deviates).reshape(-1), electrons.reshape(-1), out.reshape(-1))
        return out

    def contributions(self, point: OperatingPoint) -> Mapping[str, float]:
        """Return skewness m^2 S / V^1.5 and excess kurtosis m^3 S / V^2."""
        m, shot, total = point.slope_dn, point.shot_variance_dn2, point.variance_dn2
        return {"skewness": m * shot / total**1.5, "kurtosis": m * m * shot / total**2}


@inlined
def exact_quantile(probability: float, mean: float) -> float:
    """Return the smallest n whose Poisson distribution function reaches `probability`."""
    n, term = 0.0, math.exp(-mean)
    total = term
    while total < probability and n < 400.0:
        n += 1.0
        term *= mean / n
        total += term
    return n


@inlined
def expanded_quantile(z: float, mean: float) -> float:
    """Return the whole number next to the quantile of count + uniform(-1/2, 1/2).

    That sum has the cumulants mean, mean + 1/12, mean, mean - 1/120; rounding takes its uniform
    part away again, so that the moments are right to order mean^-3/2.
    """
    variance = mean + 1.0 / 12.0
    sigma = math.sqrt(variance)
    g, k = mean / (variance * sigma), mean / (variance * variance)
    w = z + g * (z * z - 1) / 6 + k * (z * z - 3) * z / 24 - g * g * (2 * z * z - 5) * z / 36
    return float(np.rint(mean + sigma * w))


@kernel
def _count(
    deviates: NDArray[np.float32], electrons: NDArray[np.float64], out: NDArray[np.float32]
) -> None:
    for i in range(deviates.size):
        mean, z = electrons[i], float(deviates[i])
        if mean <= 0:
            out[i] = deviates[i]
        elif mean < EXACT_BELOW_ELECTRONS:
            n = exact_quantile(0.5 * math.erfc(-z / math.sqrt(2.0)), mean)
            out[i] = np.float32((n - mean) / math.sqrt(mean))
        else:
            out[i] = np.float32((expanded_quantile(z, mean) - mean) / math.sqrt(mean))
