"""Poisson shot noise: the skew of few electrons."""

import math
from collections.abc import Mapping
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from dsis.compiled import inlined, kernel
from dsis.effects.effect import Effect, Exposure, Image, OperatingPoint, Stage

EXACT_BELOW_ELECTRONS = 64.0
_MOST = 400.0  # electrons: none of a mean below that has so many


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
        out = np.empty_like(deviates, order="C")
        _count(
            np.ascontiguousarray(deviates).reshape(-1),
            np.require(exposure.expected_dn, np.float32, ["C", "W"]).reshape(-1),
            out.reshape(-1),
            segments.lower_dn,
            segments.slope_dn,
            segments.intercept_dn2,
        )
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
    while total < probability and n < _MOST:
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
    sigma, g, k = _expansion(mean)
    return _expanded(z, mean, sigma, g, k)


@inlined
def _expansion(mean: float) -> tuple[float, float, float]:
    """Return standard deviation, skewness and excess kurtosis of that sum."""
    variance = mean + 1.0 / 12.0
    sigma = math.sqrt(variance)
    return sigma, mean / (variance * sigma), mean / (variance * variance)


@inlined
def _expanded(z: float, mean: float, sigma: float, g: float, k: float) -> float:
    w = z + g * (z * z - 1) / 6 + k * (z * z - 3) * z / 24 - g * g * (2 * z * z - 5) * z / 36
    return float(np.rint(mean + sigma * w))


@inlined
def _from_table(probability: float, guess: float, table: NDArray[np.float64], count: int) -> float:
    """Return the `exact_quantile` by the distribution function at 0 .. count - 1."""
    n = min(max(int(guess), 0), count - 1)
    while n < count and table[n] < probability:
        n += 1
    while n > 0 and table[n - 1] >= probability:
        n -= 1
    return float(n) if n < count else _MOST


@inlined
def _tabulate(mean: float, table: NDArray[np.float64]) -> int:
    """Fill a table with the distribution function as far as it grows, and return how far that is.

    Term by term as `exact_quantile` sums it.
    """
    n, term = 0, math.exp(-mean)
    total = term
    table[0] = total
    while n < table.size - 1:
        term *= mean / (n + 1.0)
        if n > mean and total + term == total:
            break
        n += 1
        total += term
        table[n] = total
    return n + 1


@kernel
def _count(
    deviates: NDArray[np.float32],
    expected: NDArray[np.float32],
    out: NDArray[np.float32],
    lower: NDArray[np.float32],
    slope: NDArray[np.float32],
    intercept: NDArray[np.float32],
) -> None:
    # Flat fields have one signal, or two by turns: what hangs on that alone is kept from pixel to
    # pixel, and tables are made of what comes back.
    signals = np.full(2, np.nan, np.float32)
    means, roots = np.zeros(2), np.zeros(2)
    sigmas, skews, kurtoses = np.zeros(2), np.zeros(2), np.zeros(2)
    counts = np.zeros(2, np.int64)
    tables = np.empty((2, int(_MOST) + 1))
    last = 0
    for i in range(deviates.size):
        own = last if expected[i] == signals[last] else 1 - last
        known = expected[i] == signals[own]
        last = own
        if not known:
            signals[own] = expected[i]
            s = 0
            while s + 1 < lower.size and lower[s + 1] <= expected[i]:
                s += 1
            m = np.float64(slope[s])
            zero = np.float32(0)
            shot = max(m * np.float64(expected[i]) + np.float64(min(intercept[s], zero)), 0.0)
            means[own] = shot / (m * m) if m > 0 else 0.0
            roots[own] = math.sqrt(means[own])
            sigmas[own], skews[own], kurtoses[own] = _expansion(means[own])
            counts[own] = 0
        mean, z = means[own], float(deviates[i])
        if mean <= 0:
            out[i] = deviates[i]
            continue
        if mean < EXACT_BELOW_ELECTRONS:
            probability = 0.5 * math.erfc(-z / math.sqrt(2.0))
            if counts[own] == 0 and known:
                counts[own] = _tabulate(mean, tables[own])
            if counts[own]:
                guess = mean + roots[own] * z
                n = _from_table(probability, guess, tables[own], counts[own])
            else:
                n = exact_quantile(probability, mean)
        else:
            n = _expanded(z, mean, sigmas[own], skews[own], kurtoses[own])
        out[i] = np.float32((n - mean) / roots[own])
