"""Equation (5): the covariance B Sigma_d B^T of demosaicked noise, predicted and measured.

Sigma_d is diagonal: the variance of each sample of the mosaic, linear in the signal. B is what the
demosaicking makes of one sample. For the bilinear method B is a fixed filter for each Bayer phase,
and `predicted_covariance` is exact. DLMMSE and Lu-Tan weigh samples by the picture itself;
`linearised_covariance` puts their Jacobian in the place of B. Source: Seybold et al., CIC 22, 2014.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from dsis.cfa import Cfa
from dsis.compiled import kernel
from dsis.demosaic import demosaic
from dsis.draw import Draw
from dsis.grid import PixelGrid

Image = NDArray[np.float32]
Region = NDArray[np.bool_]

LAGS = 2  # bilinear noise is uncorrelated beyond
_REACH = 1  # of the bilinear filters
_STEP = 1 / 64  # of noise, where a Jacobian is taken: rounding to float32 adds some 1e-3 of it


@dataclass(frozen=True)
class LagCovariance:
    """Second moments of zero-mean noise by distance, averaged over the pixels of a region.

    Attributes
    ----------
    values
        float64 (2 L + 1, 2 L + 1, C, C) of C channels: [L + k, L + l, a, b] is the mean over
        pixels (i, j) of n_a(i, j) n_b(i + k, j + l), in the unit of the noise squared.
    pixels
        How many pixels were averaged.
    """

    values: NDArray[np.float64]
    pixels: int

    @property
    def lags(self) -> int:
        """L, the largest distance in rows and columns."""
        return len(self.values) // 2

    @property
    def variance(self) -> NDArray[np.float64]:
        """Variance of each channel."""
        return np.diagonal(self.values[self.lags, self.lags]).copy()

    def pooled(self) -> NDArray[np.float64]:
        """Return the paper's Table 1: (L + 1, L + 1) correlations at (k rows, l columns) >= 0.

        Covariances are summed over the channels, then divided by the summed variance.
        """
        sums = np.trace(self.values, axis1=2, axis2=3)[self.lags :, self.lags :]
        return np.asarray(sums / sums[0, 0])

    def of_channel(self, channel: int) -> NDArray[np.float64]:
        """Return the correlations (L + 1, L + 1) inside one channel."""
        own = self.values[self.lags :, self.lags :, channel, channel]
        return np.asarray(own / own[0, 0])

    def correlations(self) -> NDArray[np.float64]:
        """Return all of `values` divided by sqrt(variance_a variance_b): -1..1."""
        sd = np.sqrt(self.variance)
        return np.asarray(self.values / np.outer(sd, sd))

    def between_channels(self) -> NDArray[np.float64]:
        """Return the correlation matrix (C, C) of the channels at one pixel."""
        return np.asarray(self.correlations()[self.lags, self.lags])

    def stationary(self) -> NDArray[np.float64]:
        """Return covariances (2 L + 1, 2 L + 1, C, C) as denoisers take them.

        [L + k, L + m, a, b] is that of channel a at (i + k, j + m) with channel b at (i, j), made
        to equal its mirror image [L - k, L - m, b, a], as in noise that is the same everywhere.
        """
        turned = self.values.swapaxes(2, 3)
        return np.asarray(0.5 * (turned + self.values[::-1, ::-1]))


def averaged(parts: Iterable[LagCovariance]) -> LagCovariance:
    """Return the moments of several regions or frames taken together."""
    found = list(parts)
    pixels = sum(part.pixels for part in found)
    return LagCovariance(sum(p.values * p.pixels for p in found) / pixels, pixels)  # type: ignore[arg-type] # sum() of arrays is typed as if it could be the int 0


def measured_covariance(
    noise: Image, *, lags: int = LAGS, region: Region | None = None
) -> LagCovariance:
    """Return the second moments of noise as it is: no mean is taken off.

    Parameters
    ----------
    noise
        float32 (row, column, channel), demosaicked noisy less demosaicked clean say; any unit.
    lags
        Largest distance; the outermost lags + 1 rows and columns are left out.
    region
        bool (row, column): the pixels (i, j) that count; None: all. Raises `ValueError` where no
        pixel is left.
    """
    inside = _inside(noise.shape[:2], lags, region)
    there = np.ascontiguousarray(np.moveaxis(noise, 2, 0), np.float64)
    here = np.zeros_like(there)
    middle = _shifted(noise.shape, lags, 0, 0)
    here[:, *middle] = there[:, *middle] * inside
    values = np.zeros((2 * lags + 1, 2 * lags + 1, *2 * noise.shape[2:]))
    _add_products(here, there, lags + _REACH, values)
    pixels = int(inside.sum())
    return LagCovariance(values / pixels, pixels)


@kernel
def _add_products(
    here: NDArray[np.float64], there: NDArray[np.float64], edge: int, sums: NDArray[np.float64]
) -> None:
    """Add to sums (k, m, a, b) the products of planes (channel, row, column), pixels apart.

    Four running sums a row: independent additions need not wait for one another.
    """
    rows, columns = here.shape[1:]
    lags = sums.shape[0] // 2
    size = columns - 2 * edge
    for i in range(edge, rows - edge):
        for k, m, a, b in np.ndindex(sums.shape):
            x = here[a, i, edge : edge + size]
            start = edge + m - lags
            y = there[b, i + k - lags, start : start + size]
            s0, s1, s2, s3 = 0.0, 0.0, 0.0, 0.0
            for j in range(size // 4):
                s0 += x[4 * j] * y[4 * j]
                s1 += x[4 * j + 1] * y[4 * j + 1]
                s2 += x[4 * j + 2] * y[4 * j + 2]
                s3 += x[4 * j + 3] * y[4 * j + 3]
            for j in range(size - size % 4, size):
                s0 += x[j] * y[j]
            sums[k, m, a, b] += (s0 + s1) + (s2 + s3)


def predicted_covariance(
    variance: Image,
    cfa: Cfa,
    *,
    lags: int = LAGS,
    region: Region | None = None,
) -> LagCovariance:
    """Return B Sigma_d B^T of bilinear demosaicking: exact for any independent noise.

    cov_ab(p, p + d) = sum over sites s of B_a(p, s) B_b(p + d, s) v(s). B depends on the Bayer
    phase of p alone, so that the average over p needs the mean of v around p only.

    Parameters
    ----------
    variance
        v, the variance of each sample of the mosaic, float32 (row, column).
    cfa
        Bayer phase.
    lags, region
        As in `measured_covariance`; a region may be the pixels of one Bayer phase.
    """
    inside = _inside(variance.shape, lags, region)
    filters = _bilinear_filters(cfa)
    values, pixels = np.zeros((2 * lags + 1, 2 * lags + 1, 3, 3)), 0
    for r, c in np.ndindex(2, 2):
        some = inside.copy()
        some[(r + lags) % 2 :: 2] = False  # the inside begins at row lags + 1
        some[:, (c + lags) % 2 :: 2] = False
        pixels += int(some.sum())
        around = _means_around(variance, some, lags)
        for k, m in np.ndindex(values.shape[:2]):
            d = np.array([k, m]) - lags
            other = _moved(filters[(r + d[0]) % 2, (c + d[1]) % 2], d)
            values[k, m] += np.einsum("aij,ij,bij->ab", filters[r, c], around, other)
    return LagCovariance(values / pixels, pixels)


def linearised_noise(function: Callable[[Image], Image], clean: Image, noise: Image) -> Image:
    """Return J n: the noise n as `function`, linearised at the clean data, passes it on.

    A central difference (f(x + h n) - f(x - h n)) / 2 h with h = 1/64: exact for linear functions.
    `function` may be a demosaicking or a whole pipeline to the display.
    """
    step = np.float32(_STEP)
    up, down = function(clean + step * noise), function(clean - step * noise)
    return (up - down) * np.float32(0.5 / _STEP)


def linearised_covariance(
    clean: Image,
    variance: Image,
    cfa: Cfa,
    method: str,
    draw: Draw,
    *,
    full_scale: float = 1.0,
    around: Literal["clean", "noisy"] = "clean",
    draws: int = 4,
    lags: int = LAGS,
    region: Region | None = None,
    threads: int = 1,
) -> LagCovariance:
    """Return J Sigma_d J^T of a demosaicking method, J its Jacobian at the clean mosaic.

    J Sigma_d J^T is the covariance of J n with n of covariance Sigma_d, so it is averaged over
    draws of n: two runs of the algorithm each, where the Jacobian itself would take one per sample
    in its reach of some 600. The error falls as 1 / sqrt(pixels x draws).

    Parameters
    ----------
    clean, variance
        Noise-free mosaic and the variance of each of its samples, float32 (row, column).
    cfa, method, full_scale, threads
        As in `dsis.demosaic.demosaic`.
    draw
        Random fields of the probing noise.
    around
        "noisy" takes each J at the clean mosaic plus noise of the same variance: methods that
        weigh by differences of samples see the noise itself where the picture is flat, and the
        Jacobian at the clean mosaic does not know that.
    draws, lags, region
        Number of fields; the others as in `measured_covariance`.
    """
    grid = PixelGrid(clean.shape[0], clean.shape[1], cfa)
    sd = np.sqrt(variance)

    def full(mosaic: Image) -> Image:
        return demosaic(mosaic, cfa, method, full_scale=full_scale, threads=threads)

    def one(number: int) -> LagCovariance:
        away = np.zeros_like(sd)
        if around == "noisy":
            away = sd * draw.normal("point of linearisation", grid, number)
        probe = sd * draw.normal("probe", grid, number)
        noise = linearised_noise(full, clean + away, probe)
        return measured_covariance(noise, lags=lags, region=region)

    return averaged(one(number) for number in range(draws))


@lru_cache(maxsize=8)
def _bilinear_filters(cfa: Cfa) -> NDArray[np.float64]:
    """Return B by phase: (2, 2, 3, 3, 3), [r, c, a, 1 + k, 1 + l] the weight of site (i+k, j+l).

    Read off the algorithm: what it makes of a single sample at each phase.
    """
    filters = np.zeros((2, 2, 3, 2 * _REACH + 1, 2 * _REACH + 1))
    for r, c in np.ndindex(2, 2):
        impulse = np.zeros((16, 16), np.float32)
        impulse[8 + r, 8 + c] = 1
        answer = demosaic(impulse, cfa, "bilinear")
        for k, m in np.ndindex(filters.shape[3:]):
            i, j = 8 + r - (k - _REACH), 8 + c - (m - _REACH)
            filters[i % 2, j % 2, :, k, m] = answer[i, j]
    return filters


def _moved(filters: NDArray[np.float64], d: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return the filters (3, 3, 3) of a pixel d further on, seen from here: zero outside."""
    wide = np.pad(filters, ((0, 0), *((abs(n), abs(n)) for n in d)))
    row, column = (abs(n) - n for n in d)
    return wide[:, row : row + 2 * _REACH + 1, column : column + 2 * _REACH + 1]


def _means_around(variance: Image, inside: Region, lags: int) -> NDArray[np.float64]:
    """Return the sums of the variance over `inside`, moved by -1..1 rows and columns: (3, 3)."""
    sums = np.empty((2 * _REACH + 1, 2 * _REACH + 1))
    for k, m in np.ndindex(sums.shape):
        there = variance[_shifted(variance.shape, lags, k - _REACH, m - _REACH)]
        sums[k, m] = there[inside].sum(dtype=np.float64)
    return sums


def _shifted(shape: tuple[int, ...], lags: int, row: int, column: int) -> tuple[slice, slice]:
    """Return the slices of the inside of an image, moved by some rows and columns."""
    edge = lags + _REACH
    first, last = (edge + row, edge + column), (shape[0] - edge + row, shape[1] - edge + column)
    return slice(first[0], last[0]), slice(first[1], last[1])


def _inside(shape: tuple[int, ...], lags: int, region: Region | None) -> Region:
    """Return the pixels of the inside that count."""
    whole = np.ones(shape[:2], np.bool_) if region is None else region
    inside = whole[_shifted(shape, lags, 0, 0)].copy()
    if not inside.any():
        message = f"no pixel of the region lies {lags + _REACH} or more pixels inside the image"
        raise ValueError(message)
    return inside
