"""Skewness, kurtosis, correlation in time and spread of variance, from sums over each pixel.

Moments of a residual about a mean of T frames are smaller than those of the noise by sums of powers
of the weights with which samples enter it: 1 - 1/T of its own, -1/T of the others (Cramer,
"Mathematical methods of statistics", 1946, chapter 27). Standard errors come from how the pixels
scatter, so strong pixels and heavy tails are in them; null errors are those of Gaussian noise.
"""

from dataclasses import dataclass
from functools import lru_cache
from math import factorial, inf, prod

import numpy as np
from numpy.typing import NDArray

from dsis.measures.estimate import Estimate, estimate, unknown
from dsis.measures.pixels import Scatter

Array = NDArray[np.float64]


@dataclass(frozen=True)
class PixelMoments:
    """What the pixels of a channel show over time, row, column and frame means removed.

    Attributes
    ----------
    frames, rows, columns
        Number of frames T, rows and columns of the channel.
    variance_map
        Unbiased variance of each pixel over time: (row, column), DN^2.
    neighbour
        Mean over T - 1 pairs of the residual times the next frame's: (row, column), DN^2.
    scatter
        Means and products over pixels of the residual's mean powers.
    """

    frames: int
    rows: int
    columns: int
    variance_map: Array
    neighbour: Array
    scatter: Scatter

    @property
    def variance(self) -> float:
        """Mean of the variance map, DN^2."""
        return self.scatter.square / self._kept(2)

    @property
    def variance_error2(self) -> float:
        """Variance of that mean where pixels are independent, DN^4."""
        return self.scatter.squares / self._kept(2) ** 2 / (self.rows * self.columns)

    def estimates(self, inflation: float = 1.0) -> dict[str, Estimate]:
        """Return skewness, kurtosis, frame_correlation and variance_spread.

        `inflation`: sum of rho^2 over lags, by which products of correlated neighbours scatter
        more (higher powers: rho^3 and beyond, left out).
        """
        if not self.scatter.any:
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
        t, size = self.frames, self.rows * self.columns
        if t < 4 or not self.scatter.any:
            return unknown(0.0)
        scale = _share(self.rows, 4) * _share(self.columns, 4) * self.variance**2
        null = 24 * t * (t + 1) / ((t - 1) * (t - 2) * (t - 3)) / size
        null *= _loss(self.rows, 4) * _loss(self.columns, 4)
        return estimate(
            self.scatter.k4 / scale, self.scatter.k4_squares / size / scale**2, 0.0, null
        )

    def _kept(self, power: int) -> float:
        """Return the sum of weights^power of a residual: over time, rows and columns."""
        return kept(self.frames, self.rows, self.columns, power)

    def _null(self, power: int) -> float:
        """Return the variance of a standardised cumulant of Gaussian residuals."""
        return _null(self.frames, self.rows, self.columns, power)

    def _skewness(self) -> Estimate:
        weights = self._kept(3)
        if weights == 0:
            return unknown(0.0)  # the residuals of two samples are symmetric
        of, size = self.scatter, self.rows * self.columns
        scale = self._kept(2) ** 1.5 / weights / of.square**1.5
        lean = 1.5 * of.cube / of.square
        influence = of.cubes - 2 * lean * of.cube_square + lean**2 * of.squares
        return estimate(of.cube * scale, influence / size * scale**2, 0.0, self._null(3))

    def _kurtosis(self) -> Estimate:
        of, size = self.scatter, self.rows * self.columns
        scale = self._kept(2) ** 2 / self._kept(4) / of.square**2
        lean = 2 * of.fourth / of.square
        influence = of.fourths - 2 * lean * of.fourth_square + lean**2 * of.squares
        value = (of.fourth - 3 * (of.square**2 - of.squares / size)) * scale
        return estimate(value, influence / size * scale**2, 0.0, self._null(4))

    def _frame_correlation(self, inflation: float) -> Estimate:
        """Solve the expected ratio for rho: the removed mean correlates frames by -1/(T-1).

        Exact for noise that is correlated with the next frame only.
        """
        t, size, of = self.frames, self.rows * self.columns, self.scatter
        if t < 3:
            return unknown(0.0)  # two residuals are each other's negative
        ratio = of.neighbour / of.square
        # Traces of P A P A, A P and P: P takes the mean off, A pairs neighbours.
        papa = (t - 1) / 2 - 2 * (t - 1.5) / t + ((t - 1) / t) ** 2
        top = ratio * (t - 1) / t + 1 / t
        bottom = 2 * papa / (t - 1) + 2 * ratio * (t - 1) / t**2
        slope = (t - 1) / t / bottom - top * 2 * (t - 1) / t**2 / bottom**2
        influence = of.neighbours - 2 * ratio * of.neighbour_square + ratio**2 * of.squares
        a, b = t / (t - 1) ** 2, -1 / (t - 1) ** 2
        null = 2 * (a**2 * papa + 2 * a * b * (t - 1) / t + b**2 * (t - 1)) / size
        null_bottom = 2 * papa / (t - 1) - 2 / t**2
        return estimate(
            top / bottom,
            influence / of.square**2 / size * slope**2 * inflation,
            0.0,
            null * ((t - 1) / t / null_bottom) ** 2,
        )

    def _variance_spread(self) -> Estimate:
        d, size, of = self.frames - 1, self.rows * self.columns, self.scatter
        second = of.squares / of.square**2
        spread = second * size / (size - 1)
        influence = of.squares_4 / of.square**4 - 4 * spread * of.squares_3 / of.square**3
        influence += 4 * spread**2 * second - second**2
        null = 8 / d**2 * (1 + 2 / d) / size
        # Pixels of equal variance v have a variance of v^2 2/(T-1) between them.
        value = (spread - 2 / d) / (1 + 2 / d)
        shrink = (1 + 2 / d) ** -2
        return estimate(value, influence / size * shrink, 0.0, null * shrink)


@lru_cache(maxsize=1024)
def kept(frames: int, rows: int, columns: int, power: int) -> float:
    """Return the sum of the weights' powers with which samples enter a residual."""
    return prod(_share(size, power) for size in (frames, rows, columns))


@lru_cache(maxsize=1024)
def _null(frames: int, rows: int, columns: int, power: int) -> float:
    loss = prod(_loss(size, power) for size in (frames, rows, columns))
    return factorial(power) / (frames * rows * columns) * loss


@lru_cache(maxsize=1024)
def _share(size: int, power: int) -> float:
    """Return (1 - 1/k)^p + (k - 1) (-1/k)^p: the sum of the weights' powers of a residual."""
    return float((1 - 1 / size) ** power + (size - 1) * (-1 / size) ** power)


@lru_cache(maxsize=1024)
def _loss(size: int, power: int) -> float:
    """Return by how much the removed mean of `size` samples raises the variance of a cumulant.

    Residuals correlate by -1/(k-1), their Hermite polynomials by that to the power.
    """
    kept = _share(size, power)
    if kept == 0:
        return inf
    correlated = 1 + (size - 1) * (-1 / (size - 1)) ** power
    return correlated * _share(size, 2) ** power / kept**2
