"""Variance components of the temporal noise, by the balanced two-way model.

The temporal residual (frame less mean frame) is z(t, y, x) = f(t) + r(t, y) + c(t, x) + e(t, y, x)
(Searle, Casella & McCulloch, "Variance components", 1992, chapter 4): frame, row, column and pixel
variance, each unbiased and each blind to the others.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from dsis.compiled import kernel
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


class LineSquares(NamedTuple):
    """Mean squares of lines of some planes per degree of freedom, and their variances: (plane,)."""

    mean: list[float]
    variance: list[float]


def components(
    of_rows: LineSquares,
    of_columns: LineSquares,
    frame_means: Array,
    shape: tuple[int, int],
    pixels: Sequence[tuple[float, float]],
) -> list[Components]:
    """Return the components of channels of one size.

    Parameters
    ----------
    of_rows, of_columns
        `line_squares` of both.
    frame_means
        Of each frame, DN: (plane, frame).
    shape
        Rows and columns of a channel.
    pixels
        Temporal variance of a pixel without rows, columns and frames, and the variance of that.
    """
    frames, (rows, columns) = frame_means.shape[1], shape
    wander = frame_means - frame_means.sum(1, keepdims=True) / frames
    squares = np.vecdot(wander, wander).tolist()
    found = []
    for k, (variance, error2) in enumerate(pixels):
        ms_frame = rows * columns * squares[k] / (frames - 1)
        found.append(
            Components(
                frames,
                rows,
                columns,
                variance,
                of_rows.mean[k],
                of_columns.mean[k],
                ms_frame,
                error2,
                of_rows.variance[k],
                of_columns.variance[k],
                2 * ms_frame**2 / (frames + 1),
            )
        )
    return found


def line_power(means: Array, frame_means: Array) -> Array:
    """Return sums over frames of the power of line means less the frame's, their mean left out.

    Means (plane, frame, line), (plane, frame); power (plane, bin): half spectrum of a real
    transform along the lines; the sum of the whole one is that of squares.
    """
    transforms = scipy.fft.rfft(_wander(means, frame_means), overwrite_x=True)
    return _summed_power(transforms, means.shape[2])


@kernel
def _wander(means: Array, frame_means: Array) -> Array:
    """Return line means less the frame's, about their mean over frames: (plane, frame, line)."""
    count, frames, lines = means.shape
    found, mean = np.empty((count, frames, lines)), np.empty(lines)
    for k in range(count):
        mean[:] = 0.0
        for t in range(frames):
            for y in range(lines):
                found[k, t, y] = means[k, t, y] - frame_means[k, t]
                mean[y] += found[k, t, y]
        for y in range(lines):
            mean[y] /= frames
        for t in range(frames):
            for y in range(lines):
                found[k, t, y] -= mean[y]
    return found


@kernel
def _summed_power(transforms: NDArray[np.complex128], lines: int) -> Array:
    """Return sums over frames of the power in each bin, per line: (plane, bin)."""
    count, frames, bins = transforms.shape
    power = np.zeros((count, bins))
    for k in range(count):
        for t in range(frames):
            for i in range(bins):
                re, im = transforms[k, t, i].real, transforms[k, t, i].imag
                power[k, i] += re * re + im * im
        for i in range(bins):
            power[k, i] /= lines
    return power


def line_squares(power: Array, frames: int, lines: int, size: int) -> LineSquares:
    """Return the mean squares of lines of `size` pixels and their variances, from `line_power`.

    var of the sum of power P_k is 2 sum P_k^2 / T for Gaussian lines of any spectrum: coloured
    lines have fewer degrees of freedom.
    """
    weighted = _halves(power.shape[1], lines % 2 == 0) * power
    scale = size / ((frames - 1) * (lines - 1))
    sums, squares = weighted.sum(1).tolist(), np.vecdot(weighted, power).tolist()
    return LineSquares(
        [one * scale for one in sums], [2 * square / frames * scale**2 for square in squares]
    )


@lru_cache(maxsize=64)
def _halves(bins: int, even: bool) -> Array:
    """Return how often each bin of a half spectrum stands in the whole one."""
    twice = np.full(bins, 2.0)
    twice[0] = 1.0
    if even:
        twice[-1] = 1.0
    return twice
