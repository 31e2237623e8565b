"""Skewness, kurtosis, correlation in time and spread of variance, from sums over each pixel.

Moments of a residual about a mean of T frames are smaller than those of the noise by sums of powers
of the weights with which samples enter it: 1 - 1/T of its own, -1/T of the others (Cramer,
"Mathematical methods of statistics", 1946, chapter 27). Standard errors come from how the pixels
scatter, so strong pixels and heavy tails are in them; null errors are those of Gaussian noise.
"""

from dataclasses import dataclass
from math import factorial, inf

import numpy as np
from numpy.typing import NDArray

from dsis.measures.estimate import Estimate, estimate, unknown

Array = NDArray[np.float64]


@dataclass(frozen=True)
class PixelMoments:
    """What each pixel of a channel shows over time, row, column and frame means removed.

    Attributes
    ----------
    frames
        Number of frames T.
    square, cube, fourth
        Mean over frames of the residual's powers: (row, column), DN^2, DN^3, DN^4.
    neighbour
        Mean over T - 1 pairs of the residual times the next frame's: (row, column), DN^2.
    """

    frames: int
    square: Array
    cube: Array
    fourth: Array
    neighbour: Array

    @classmethod
    def of(cls, frames: int, sums: tuple[Array, ...], last: Array) -> "PixelMoments":
        """Return moments from sums over frames of u, u^2, u^3, u^4 and u times the previous u.

        The first u is zero; `last` is the last one.
        """
        s1, s2, s3, s4, s11 = (part / frames for part in sums)
        square = s2 - s1**2
        cube = s3 - 3 * s1 * s2 + 2 * s1**3
        fourth = s4 - 4 * s1 * s3 + 6 * s1**2 * s2 - 3 * s1**4
        ends = 2 * frames * s1 - last
        pairs = frames - 1
        neighbour = (frames * s11 - s1 * ends + pairs * s1**2) / max(pairs, 1)
        return cls(frames, square, cube, fourth, neighbour)

    @property
    def variance_map(self) -> Array:
        """Unbiased variance of each pixel over time: (row, column), DN^2."""
        return self.square / self._kept(2)

    def estimates(self, inflation: float = 1.0) -> dict[str, Estimate]:
        """Return skewness, kurtosis, frame_correlation and variance_spread.

        `inflation`: sum of rho^2 over lags, by which products of correlated neighbours scatter
        more (higher powers: rho^3 and beyond, left out).
        """
        if not self.square.any():
            return {
                "skewness": unknown(0.0),
                "kurtosis": unknown(0.0),
                "frame_correlation": unknown(0.0),
                "variance_spread": unknown(0.0),
            }
        return {
            "skewness": self._skewness(),
            "kurtosis": self._kurtosis(),
            "frame_correlation": self._frame_correlation(inflation),
            "variance_spread": self._variance_spread(),
        }

    def kurtosis_within_pixels(self) -> Estimate:
        """Return the mean fourth cumulant of single pixels over the mean variance squared.

        Blind to pixels that differ in variance, which raise `kurtosis` by three times their spread;
        needs four frames (Fisher's k-statistic k4, var 24 T (T+1) / ((T-1)(T-2)(T-3))).
        """
        t = self.frames
        if t < 4 or not self.square.any():
            return unknown(0.0)
        k4 = t**2 * ((t + 1) * self.fourth - 3 * (t - 1) * self.square**2)
        k4 = k4 / ((t - 1) * (t - 2) * (t - 3))
        rows, columns = self.square.shape
        plane = _share(rows, 4) * _share(columns, 4)
        scale = plane * float(self.variance_map.mean()) ** 2
        null = 24 * t * (t + 1) / ((t - 1) * (t - 2) * (t - 3)) / k4.size
        null *= _loss(rows, 4) * _loss(columns, 4)
        return estimate(k4.mean() / scale, k4.var() / k4.size / scale**2, 0.0, null)

    def _kept(self, power: int) -> float:
        """Return the sum of weights^power of a residual: over time, rows and columns."""
        return float(np.prod([_share(size, power) for size in (self.frames, *self.square.shape)]))

    def _null(self, power: int) -> float:
        """Return the variance of a standardised cumulant of Gaussian residuals."""
        sizes = (self.frames, *self.square.shape)
        loss = float(np.prod([_loss(size, power) for size in sizes]))
        return factorial(power) / float(np.prod(sizes)) * loss

    def _skewness(self) -> Estimate:
        kept = self._kept(3)
        size = self.square.size
        if kept == 0:
            return unknown(0.0)  # the residuals of two samples are symmetric
        m2, m3 = float(self.square.mean()), float(self.cube.mean())
        scale = self._kept(2) ** 1.5 / kept / m2**1.5
        influence = self.cube - 1.5 * m3 / m2 * self.square
        return estimate(m3 * scale, influence.var() / size * scale**2, 0.0, self._null(3))

    def _kurtosis(self) -> Estimate:
        size = self.square.size
        m2, m4 = float(self.square.mean()), float(self.fourth.mean())
        variance = float(self.square.var()) / size
        scale = self._kept(2) ** 2 / self._kept(4) / m2**2
        influence = self.fourth - 2 * m4 / m2 * self.square
        value = (m4 - 3 * (m2**2 - variance)) * scale
        return estimate(value, influence.var() / size * scale**2, 0.0, self._null(4))

    def _frame_correlation(self, inflation: float) -> Estimate:
        """Solve the expected ratio for rho: the removed mean correlates frames by -1/(T-1).

        Exact for noise that is correlated with the next frame only.
        """
        t, size = self.frames, self.square.size
        if t < 3:
            return unknown(0.0)  # two residuals are each other's negative
        m2 = float(self.square.mean())
        ratio = float(self.neighbour.mean()) / m2
        # Traces of P A P A, A P and P: P takes the mean off, A pairs neighbours.
        papa = (t - 1) / 2 - 2 * (t - 1.5) / t + ((t - 1) / t) ** 2
        top = ratio * (t - 1) / t + 1 / t
        bottom = 2 * papa / (t - 1) + 2 * ratio * (t - 1) / t**2
        slope = (t - 1) / t / bottom - top * 2 * (t - 1) / t**2 / bottom**2
        influence = (self.neighbour - ratio * self.square) / m2
        a, b = t / (t - 1) ** 2, -1 / (t - 1) ** 2
        null = 2 * (a**2 * papa + 2 * a * b * (t - 1) / t + b**2 * (t - 1)) / size
        null_bottom = 2 * papa / (t - 1) - 2 / t**2
        return estimate(
            top / bottom,
            influence.var() / size * slope**2 * inflation,
            0.0,
            null * ((t - 1) / t / null_bottom) ** 2,
        )

    def _variance_spread(self) -> Estimate:
        d, size = self.frames - 1, self.square.size
        x = self.square / self.square.mean()
        spread = float(x.var(ddof=1))
        influence = (x - 1) ** 2 - 2 * spread * (x - 1)
        null = 8 / d**2 * (1 + 2 / d) / size
        # Pixels of equal variance v have a variance of v^2 2/(T-1) between them.
        value = (spread - 2 / d) / (1 + 2 / d)
        shrink = (1 + 2 / d) ** -2
        return estimate(value, influence.var() / size * shrink, 0.0, null * shrink)


def _share(size: int, power: int) -> float:
    """Return (1 - 1/k)^p + (k - 1) (-1/k)^p: the sum of the weights' powers of a residual."""
    return float((1 - 1 / size) ** power + (size - 1) * (-1 / size) ** power)


def _loss(size: int, power: int) -> float:
    """Return by how much the removed mean of `size` samples raises the variance of a cumulant.

    Residuals correlate by -1/(k-1), their Hermite polynomials by that to the power.
    """
    kept = _share(size, power)
    if kept == 0:
        return inf
    correlated = 1 + (size - 1) * (-1 / (size - 1)) ** power
    return correlated * _share(size, 2) ** power / kept**2
