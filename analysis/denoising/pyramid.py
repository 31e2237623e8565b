"""The full steerable pyramid: an image as bands of eight orientations at octaves, by FFT.

Simoncelli and Freeman, "The steerable pyramid", Proc. IEEE ICIP (1995) 444-447; "full" because the
high-pass residual is split into orientations too (Portilla et al. 2003). In polar frequencies
(r in radians per pixel of the full grid) band k of level s has the transfer function
i R_s(r) A_k(theta), with

    A_k = a cos^7(theta - k pi/8),   the sum of A_k^2 over k is 1,
    R_0 = sqrt(1 - L_0^2),  R_s = L_(s-1) sqrt(1 - L_s^2),
    L_s = 1 below r = 2^-s pi/2, 0 above twice that, cos(pi/2 log2(2^s 2 r/pi)) between,

so that all squares add up to 1 and the transposed filters reconstruct. A level is kept on the
smallest grid that holds its frequencies. All grids have odd sizes: no frequency is its own mirror
image, where an odd filter would lose it.
"""

from dataclasses import dataclass
from math import comb
from typing import TypeVar, cast

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from dsis.compiled import kernel

ORIENTATIONS = 8
Scalar = TypeVar("Scalar", bound=np.generic)


@dataclass(frozen=True)
class Grid:
    """A periodic grid of odd sizes and its place among the frequencies of the full grid."""

    rows: int
    columns: int

    def crop(self, spectrum: NDArray[Scalar]) -> NDArray[Scalar]:
        """Return the part of a larger grid's half spectrum (`rfft2`) that this grid holds."""
        half = self.rows // 2
        upper, lower = spectrum[: half + 1], spectrum[len(spectrum) - half :]
        return np.concatenate([upper, lower])[:, : self.columns // 2 + 1]

    def add_to(self, spectrum: NDArray[np.complex64], part: NDArray[np.complex64]) -> None:
        """Add this grid's half spectrum to a larger grid's: the transpose of `crop`."""
        half, columns = self.rows // 2, self.columns // 2 + 1
        spectrum[: half + 1, :columns] += part[: half + 1]
        if half:
            spectrum[-half:, :columns] += part[half + 1 :]

    def forward(self, band: NDArray[np.float32]) -> NDArray[np.complex64]:
        """Return the half spectrum of a band on this grid, divided by the number of samples."""
        return cast("NDArray[np.complex64]", scipy.fft.rfft2(band, norm="forward"))

    def inverse(self, spectrum: NDArray[np.complex64]) -> NDArray[np.float32]:
        """Return the band of a half spectrum made by `forward`."""
        size = (self.rows, self.columns)
        return cast("NDArray[np.float32]", scipy.fft.irfft2(spectrum, size, norm="forward"))

    def autocovariance(
        self,
        power: NDArray[np.float64],
        a: NDArray[np.float32],
        b: NDArray[np.float32],
    ) -> NDArray[np.float64]:
        """Return the covariance of two bands of one image at lags -2..2, (5, 5), lag 0 inside.

        `power` of the image, `a` and `b` of the bands' filters, all real and even, on the half
        spectrum, (row, column): the sum of P A B cos(2 pi (f dy + g dx)) over all frequencies f, g.
        """
        turn = 2 * np.pi * np.arange(self.rows) / self.rows
        along_rows = np.stack([np.cos(turn), np.cos(2 * turn), np.sin(turn), np.sin(2 * turn)])
        sums = np.zeros((5, self.columns // 2 + 1))
        sum_rows(power, a, b, along_rows, sums)
        sums[:, 1:] *= 2  # the other half
        turn = 2 * np.pi * np.arange(sums.shape[1]) / self.columns * np.arange(-2, 3)[:, None]
        even, odd = (
            sums[[2, 1, 0, 1, 2]],
            sums[[4, 3, 0, 3, 4]] * np.sign(np.arange(-2, 3))[:, None],
        )
        return np.asarray((even[:, None] * np.cos(turn) - odd[:, None] * np.sin(turn)).sum(2))


@dataclass(frozen=True)
class Level:
    """Eight bands of one octave.

    Attributes
    ----------
    grid
        Where the bands are sampled.
    radial
        R_s on the grid's half spectrum, float32.
    parent
        R_(s+1) there; None for the lowest octave.
    angular
        A_k there, k = 0..7, float32.
    """

    grid: Grid
    radial: NDArray[np.float32]
    parent: NDArray[np.float32] | None
    angular: tuple[NDArray[np.float32], ...]


@dataclass(frozen=True)
class Pyramid:
    """The filters for images of one size.

    Attributes
    ----------
    grid
        The full grid.
    levels
        High-pass residual first, then octave by octave downwards.
    low_pass
        L of the last octave on the full grid's half spectrum; that residual has no orientation.
    """

    grid: Grid
    levels: tuple[Level, ...]
    low_pass: NDArray[np.float32]

    @classmethod
    def of(cls, rows: int, columns: int, octaves: int) -> "Pyramid":
        """Return the pyramid of `octaves` octaves for a grid of odd sizes."""
        grids = [Grid(rows, columns)] * 2
        for s in range(1, octaves):
            held = (good_odd_size(2 * (size // 2 ** (s + 1)) + 1) for size in (rows, columns))
            grids.append(Grid(*held))
        full, levels, angular = grids[0], list[Level](), tuple[NDArray[np.float32], ...]()
        for s, grid in enumerate(grids):
            r, theta = polar(full, grid)
            if not levels or grid != levels[-1].grid:
                angular = _angular(theta)
            parent = None if s == octaves else _radial(r, s + 1)
            levels.append(Level(grid, _radial(r, s), parent, angular))
        return cls(full, tuple(levels), _low(polar(full, full)[0], octaves))


def polar(full: Grid, grid: Grid) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return radius (radians per pixel of the full grid) and angle of a grid's half spectrum."""
    fy = np.fft.fftfreq(grid.rows, 1 / grid.rows)[:, None] * (2 * np.pi / full.rows)
    fx = np.fft.rfftfreq(grid.columns, 1 / grid.columns) * (2 * np.pi / full.columns)
    return np.hypot(fy, fx), np.arctan2(fy, fx)


@kernel
def sum_rows(
    power: NDArray[np.float64], a: NDArray[np.float32], b: NDArray[np.float32],
    weights: NDArray[np.float64], sums: NDArray[np.float64],
) -> None:  # fmt: skip
    """Add to sums[0] the sum over the rows of P A B, to sums[1 + k] that times weights[k, row]."""
    for y in range(power.shape[0]):
        p, q, r = power[y], a[y], b[y]
        w0, w1, w2, w3 = weights[0, y], weights[1, y], weights[2, y], weights[3, y]
        for i in range(power.shape[1]):
            x = np.uintp(i)
            value = p[x] * q[x] * r[x]
            sums[0, x] += value
            sums[1, x] += w0 * value
            sums[2, x] += w1 * value
            sums[3, x] += w2 * value
            sums[4, x] += w3 * value


def good_odd_size(least: int) -> int:
    """Return the smallest odd number of at least `least` whose prime factors are 3, 5 and 7."""
    size = least | 1
    while True:
        rest = size
        for prime in (3, 5, 7):
            while rest % prime == 0:
                rest //= prime
        if rest == 1:
            return size
        size += 2


def _low(r: NDArray[np.float64], s: int) -> NDArray[np.float32]:
    """Return L_s."""
    octave = np.log2(np.maximum(r, 1e-12) * 2 / np.pi) + s
    low: NDArray[np.float64] = np.cos(np.pi / 2 * np.clip(octave, 0, 1))
    return np.where(octave >= 1, 0, low).astype(np.float32)


def _radial(r: NDArray[np.float64], s: int) -> NDArray[np.float32]:
    """Return R_s."""
    octave = np.log2(np.maximum(r, 1e-12) * 2 / np.pi) + s
    high = np.sin(np.pi / 2 * np.clip(octave, 0, 1)).astype(np.float32)
    return high if s == 0 else np.asarray(high * _low(r, s - 1))


def _angular(theta: NDArray[np.float64]) -> tuple[NDArray[np.float32], ...]:
    """Return A_k, k = 0..7."""
    n = ORIENTATIONS - 1
    scale = np.sqrt(4.0**n / (ORIENTATIONS * comb(2 * n, n)))
    turns = np.pi / ORIENTATIONS * np.arange(ORIENTATIONS)
    return tuple((scale * np.cos(theta - turn) ** n).astype(np.float32) for turn in turns)
