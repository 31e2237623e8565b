"""Variance components of the temporal noise, by the balanced two-way model.

The temporal residual (frame less mean frame) is z(t, y, x) = f(t) + r(t, y) + c(t, x) + e(t, y, x)
(Searle, Casella & McCulloch, "Variance components", 1992, chapter 4): frame, row, column and pixel
variance, each unbiased and each blind to the others.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from dsis.measures.estimate import Estimate, estimate

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Components:
    """Mean squares of the temporal residual of one channel, DN^2, with their variances.

    Attributes
    ----------
    frames, rows, columns
        Size of the stack.
    ms_pixel, ms_row, ms_column, ms_frame
        Mean squares per degree of freedom; all equal the pixel variance in white noise.
    var_ms_pixel, var_ms_row, var_ms_column, var_ms_frame
        Unbiased estimates of the variance of each.
    """

    frames: int
    rows: int
    columns: int
    ms_pixel: float
    ms_row: float
    ms_column: float
    ms_frame: float
    var_ms_pixel: float
    var_ms_row: float
    var_ms_column: float
    var_ms_frame: float

    @property
    def dof_pixel(self) -> int:
        """Degrees of freedom of the pixel mean square."""
        return (self.frames - 1) * (self.rows - 1) * (self.columns - 1)

    def estimates(self) -> dict[str, Estimate]:
        """Return pixel, row, column and frame variance.

        Null errors take every mean square as the next finer one says: var MS = 2 MS^2 / dof.
        """
        n, m, seen = self.rows, self.columns, self.frames - 1
        white = 2 * self.ms_pixel**2
        var_row = self.var_ms_row + self.var_ms_pixel
        var_column = self.var_ms_column + self.var_ms_pixel
        var_frame = self.var_ms_frame + self.var_ms_row + self.var_ms_column + self.var_ms_pixel
        # The null of drift keeps row and column noise: they wander too.
        still = self.ms_row + self.ms_column - self.ms_pixel
        null_frame = 2 * max(still, self.ms_pixel) ** 2 / seen
        null_frame += self.var_ms_row + self.var_ms_column + self.var_ms_pixel
        pixel_null = white / self.dof_pixel
        return {
            "pixel_variance": estimate(self.ms_pixel, self.var_ms_pixel, np.nan, pixel_null),
            "row_variance": estimate(
                (self.ms_row - self.ms_pixel) / m,
                var_row / m**2,
                0.0,
                (white / (seen * (n - 1)) + pixel_null) / m**2,
            ),
            "column_variance": estimate(
                (self.ms_column - self.ms_pixel) / n,
                var_column / n**2,
                0.0,
                (white / (seen * (m - 1)) + pixel_null) / n**2,
            ),
            "frame_variance": estimate(
                (self.ms_frame - still) / (n * m),
                var_frame / (n * m) ** 2,
                0.0,
                null_frame / (n * m) ** 2,
            ),
        }


def components(
    row_power: Array,
    column_power: Array,
    frame_means: Array,
    shape: tuple[int, int],
    pixel: tuple[float, float],
) -> Components:
    """Return the components of one channel.

    Parameters
    ----------
    row_power, column_power
        `line_power` of the means of rows and of columns less the frame's, DN^2.
    frame_means
        Of each frame, DN.
    shape
        Rows and columns of the channel.
    pixel
        Temporal variance of a pixel without rows, columns and frames, and the variance of that.
    """
    frames, (rows, columns) = frame_means.size, shape
    wander = frame_means - frame_means.sum() / frames
    ms_frame = rows * columns * float(wander @ wander) / (frames - 1)
    ms_row, var_row = _lines(row_power, frames, rows, columns)
    ms_column, var_column = _lines(column_power, frames, columns, rows)
    return Components(
        frames,
        rows,
        columns,
        pixel[0],
        ms_row,
        ms_column,
        ms_frame,
        pixel[1],
        var_row,
        var_column,
        2 * ms_frame**2 / (frames + 1),
    )


def line_power(means: Array, frame_means: Array) -> Array:
    """Return sums over frames of the power of line means less the frame's, their mean left out.

    Means (plane, frame, line), (plane, frame); power (plane, bin): half spectrum of a real
    transform along the lines; the sum of the whole one is that of squares.
    """
    wander = means - frame_means[:, :, np.newaxis]
    wander -= wander.sum(1, keepdims=True) / means.shape[1]
    transform = scipy.fft.rfft(wander)
    power: Array = (transform.real**2 + transform.imag**2).sum(1) / means.shape[2]
    return power


def _lines(power: Array, frames: int, lines: int, size: int) -> tuple[float, float]:
    """Return the mean square of lines of `size` pixels and its variance.

    var of the sum of power P_k is 2 sum P_k^2 / T for Gaussian lines of any spectrum: coloured
    lines have fewer degrees of freedom.
    """
    twice = _halves(len(power), lines % 2 == 0)
    scale = size / ((frames - 1) * (lines - 1))
    weighted = twice * power
    return float(weighted.sum()) * scale, 2 * float(weighted @ power) / frames * scale**2


@lru_cache(maxsize=64)
def _halves(bins: int, even: bool) -> Array:
    """Return how often each bin of a half spectrum stands in the whole one."""
    twice = np.full(bins, 2.0)
    twice[0] = 1.0
    if even:
        twice[-1] = 1.0
    return twice
