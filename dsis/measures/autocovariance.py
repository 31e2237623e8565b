"""Autocovariance on the mosaic: neighbours of other colours included.

A channel's lag (dy, dx) pairs its pixels (y, x) with the pixels (y + dy, x + dx), whatever their
colour, each divided by the standard deviation of its own channel. Taking row and column means off
makes white noise correlate by -1/columns and -1/rows within a channel; that is added back.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from dsis.measures.estimate import Estimate, estimate, unknown

Array = NDArray[np.float64]
Phases = tuple[tuple[int, int], ...]


@dataclass(frozen=True)
class LagTable:
    """Products and numbers of pairs: (row parity, column parity, 2 L + 1, 2 L + 1), centre lag 0.

    Parities are those of the first pixel of a pair.
    """

    products: Array
    pairs: Array

    @classmethod
    def of(cls, lags: NDArray[np.int64], sums: Array, shape: tuple[int, ...]) -> "LagTable":
        """Return the table of sums (lag, row parity, column parity) of the half plane of lags.

        The other half holds the same pairs, seen from their other pixel.
        """
        reach = int(lags.max())
        size = 2 * reach + 1
        products = np.zeros((2, 2, size, size))
        for (dy, dx), by_phase in zip(lags.tolist(), sums.tolist(), strict=True):
            for y in (0, 1):
                for x in (0, 1):
                    products[y, x, reach + dy, reach + dx] = by_phase[y][x]
                    there = ((y + dy) % 2, (x + dx) % 2)
                    products[(*there, reach - dy, reach - dx)] = by_phase[y][x]
        return cls(products, _pairs(reach, *shape))

    @property
    def reach(self) -> int:
        """Largest lag L."""
        return int(self.products.shape[2] // 2)

    def of_channel(self, phases: Phases) -> tuple[Array, Array]:
        """Return mean products (2 L + 1, 2 L + 1) and pairs of a channel's pixels."""
        pairs = sum(self.pairs[phase] for phase in phases)
        products = sum(self.products[phase] for phase in phases)
        return products / np.maximum(pairs, 1), np.asarray(pairs)


@dataclass(frozen=True)
class Autocorrelation:
    """Correlation of one channel's pixels with their neighbours on the mosaic.

    Attributes
    ----------
    values, pairs
        Correlation, bias removed, and number of pairs: (2 L + 1, 2 L + 1), centre lag 0.
    scale
        Product of the two standard deviations at each lag, DN^2.
    degrees
        Independent frames that each pair was seen in: T - 1, or 1 for the fixed pattern.
    observed
        The correlation before what temporal noise leaves was taken off: its scatter is the error.
    left
        Share of the variance that is temporal noise left in a mean frame (0 for temporal noise).
    frames
        Frames of that mean.
    """

    values: Array
    pairs: Array
    scale: Array
    degrees: int
    observed: Array
    left: float = 0.0
    frames: int = 2

    @property
    def covariance(self) -> Array:
        """Autocovariance, DN^2."""
        return self.values * self.scale

    def inflation(self) -> float:
        """Return the sum of rho^2 over lags less what their errors add; at least 1."""
        squares = np.where(self.pairs > 0, self.values**2, 0.0)
        noise = np.where(self.pairs > 0, 1 / np.maximum(self.pairs * self.degrees, 1), 0.0)
        centre = self.values.shape[0] // 2
        squares[centre, centre], noise[centre, centre] = 1.0, 0.0
        total = float((squares - noise).sum())
        return total if total > 1 else 1.0  # 1 also where there is no noise at all

    def less(self, temporal: "Autocorrelation", frames: int) -> "Autocorrelation":
        """Return that of a fixed pattern: of a mean frame, less what temporal noise leaves."""
        centre = self.values.shape[0] // 2
        with np.errstate(divide="ignore", invalid="ignore"):  # no noise: undefined, and said so
            left = temporal.covariance / frames / self.scale
        share = float(left[centre, centre])
        values = self.values - left
        return Autocorrelation(values, self.pairs, self.scale, 1, self.values, share, frames)

    def at(self, lag: tuple[int, int]) -> Estimate:
        """Return the correlation at a lag (dy, dx); error by Bartlett's formula."""
        centre = self.values.shape[0] // 2
        here = (centre + lag[0], centre + lag[1])
        count = float(self.pairs[here]) * self.degrees
        if count < 1:
            return unknown(0.0)
        rho = float(self.values[here])
        # What temporal noise leaves is estimated from T - 1 frames and taken off: its noise again.
        again = 1 / (self.frames - 1)
        null = 1 + (again if self.left else 0.0)
        error = self._bartlett(lag) * (1 + self.left**2 * again)
        return estimate(rho, error / count, 0.0, null / count)

    def _bartlett(self, lag: tuple[int, int]) -> float:
        """Return n var(rho) of a linear process, from the lags known (Bartlett 1946)."""
        centre = self.values.shape[0] // 2
        reach = 2 * centre
        wide = np.zeros((2 * reach + 1,) * 2)
        inner = slice(reach - centre, reach + centre + 1)
        known = np.where(self.pairs > 0, self.observed, 0.0)
        known[centre, centre] = 1.0
        # Lags within their own error would only add noise: 80 lags of it.
        error = 1 / np.sqrt(np.maximum(self.pairs * self.degrees, 1))
        wide[inner, inner] = np.where(np.abs(known) > 3 * error, known, 0.0)
        h = known[centre + lag[0], centre + lag[1]]
        ahead = np.roll(wide, (-lag[0], -lag[1]), (0, 1))
        behind = np.roll(wide, lag, (0, 1))
        terms = wide**2 + ahead * behind - 4 * h * wide * behind + 2 * h**2 * wide**2
        return max(float(terms.sum()), 0.1)


def autocorrelation(
    table: LagTable,
    phases: Phases,
    variances: Mapping[tuple[int, int], float],
    shape: tuple[int, int],
    degrees: int,
    lost: int = 0,
) -> Autocorrelation:
    """Return the correlation of one channel with its neighbours.

    Parameters
    ----------
    table
        Sums of products over all frames.
    phases
        The channel's 2 x 2 phases.
    variances
        Variance of the pixels of each phase, DN^2.
    shape
        Rows and columns of the channel.
    degrees
        Independent frames in the sums.
    lost
        Smooth surfaces taken off besides rows and columns.
    """
    products, pairs = table.of_channel(phases)
    lag = np.arange(-table.reach, table.reach + 1)
    dy, dx = np.meshgrid(lag, lag, indexing="ij")
    y, x = phases[0]
    own = variances[phases[0]]
    partner = np.vectorize(lambda a, b: variances[(y + a) % 2, (x + b) % 2])(dy, dx)
    scale = np.sqrt(own * partner)
    with np.errstate(divide="ignore", invalid="ignore"):  # no noise: undefined, and said so
        raw = products / degrees / scale
    centre = (table.reach, table.reach)
    rho = np.zeros_like(raw)
    rho[centre] = 1.0
    for _ in range(4):  # white first, then the lags that stand out; converges as 1/columns
        values = raw + _taken_off(rho, shape, 1 if len(phases) > 1 else 2, lost)
        values[centre] = raw[centre]
        # Lags within their own error would only add noise.
        clear = np.abs(values) > 3 / np.sqrt(np.maximum(pairs * degrees, 1))
        rho = np.where(clear & (pairs > 0), values, 0.0)
        rho[centre] = 1.0
    values = np.where(pairs > 0, values, np.nan)
    return Autocorrelation(values, pairs, scale, degrees, values)


def _taken_off(rho: Array, shape: tuple[int, int], step: int, lost: int) -> Array:
    """Return what removed means take off each lag, from the correlations known.

    A pixel's row mean holds 1/m of every pixel of the partner's channel in that row, so each lag
    loses the sum of its row's lags over m; likewise columns, and both means hold the frame's.
    """
    n, m = shape
    off = np.zeros_like(rho)
    for y in range(step):
        for x in range(step):
            plane = rho[y::step, x::step]
            total = plane.sum()
            rows, columns = plane.sum(1, keepdims=True) / m, plane.sum(0, keepdims=True) / n
            off[y::step, x::step] = rows + columns - total * (1 - lost) / (n * m)
    return off


@lru_cache(maxsize=16)
def _pairs(reach: int, rows: int, columns: int) -> Array:
    """Return the number of pairs at each lag by the phase of their first pixel."""
    lag = range(-reach, reach + 1)
    down, across = (
        np.array(
            [
                [len(range(p - 2 * min((d + p) // 2, 0), min(n, n - d), 2)) for d in lag]
                for p in (0, 1)
            ]
        )
        for n in (rows, columns)
    )
    pairs: Array = (down[:, None, :, None] * across[None, :, None, :]).astype(np.float64)
    return pairs
