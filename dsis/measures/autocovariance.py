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

from dsis.compiled import kernel, pairwise_sum
from dsis.measures.estimate import Estimate, estimate, unknown
from dsis.measures.lag_products import half_plane

Array = NDArray[np.float64]
Phases = tuple[tuple[int, int], ...]


@dataclass(frozen=True)
class LagTable:
    """Products and numbers of pairs: (row parity, column parity, 2 L + 1, 2 L + 1), centre lag 0.

    Parities are those of the first pixel of a pair; `all_pairs` (2 L + 1, 2 L + 1) are of any.
    """

    products: Array
    pairs: Array
    all_pairs: Array

    @classmethod
    def of(cls, reach: int, sums: Array, shape: tuple[int, ...]) -> "LagTable":
        """Return the table of sums (lag, row parity, column parity) of the half plane of lags.

        The other half holds the same pairs, seen from their other pixel.
        """
        size = 2 * reach + 1
        products = np.empty(4 * size * size)
        here, there = _entries(reach)
        products[here] = products[there] = sums.reshape(-1)
        return cls(products.reshape(2, 2, size, size), *_pairs(reach, *shape))


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
        total = 1 + _beyond_errors(self.values, self.pairs, self.degrees)
        return total if total > 1 else 1.0  # 1 also where there is no noise at all

    def less(self, temporal: "Autocorrelation", frames: int) -> "Autocorrelation":
        """Return that of a fixed pattern: of a mean frame, less what temporal noise leaves."""
        own = self.values, self.scale
        values, share = _less(*own, temporal.values, temporal.scale, frames)
        return Autocorrelation(values, self.pairs, self.scale, 1, self.values, share, frames)

    def at(self, lags: Mapping[str, tuple[int, int]]) -> dict[str, Estimate]:
        """Return the correlation at some lags (dy, dx) by name; error by Bartlett's formula."""
        told = _bartlett(self.observed, self.pairs, self.degrees, _array(*lags.values()))
        centre = self.values.shape[0] // 2
        # What temporal noise leaves is estimated from T - 1 frames and taken off: its noise again.
        again = 1 / (self.frames - 1)
        null = 1 + (again if self.left else 0.0)
        found = {}
        for (name, (dy, dx)), scatter in zip(lags.items(), told.tolist(), strict=True):
            here = (centre + dy, centre + dx)
            count = self.pairs.item(here) * self.degrees
            error = max(scatter, 0.1) * (1 + self.left**2 * again)
            found[name] = (
                estimate(self.values.item(here), error / count, 0.0, null / count)
                if count >= 1
                else unknown(0.0)
            )
        return found


def autocorrelation(
    table: LagTable,
    phases: Phases,
    variances: Array,
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
        Variance of the pixels of each phase (row parity, column parity), DN^2.
    shape
        Rows and columns of the channel.
    degrees
        Independent frames in the sums.
    lost
        Smooth surfaces taken off besides rows and columns.
    """
    step = 1 if len(phases) > 1 else 2
    pairs = table.pairs[phases[0]] if step == 2 else table.all_pairs
    size = (*shape, step, lost)
    work = _correlate(table.products, pairs, variances, phases[0], degrees, size)
    return Autocorrelation(work[0], pairs, work[1], degrees, work[0])


@kernel
def _correlate(  # noqa: C901, PLR0912 - one loop nest, compiled as one
    table: Array,
    pairs: Array,
    variances: Array,
    phase: tuple[int, int],
    degrees: int,
    size: tuple[int, int, int, int],
) -> Array:
    """Return the correlation, nan without pairs, and the product of standard deviations.

    They are the first two of (4, lag, lag). White noise first, then the lags that stand out, in
    four rounds: converges as 1/columns. Means that were taken off cost each lag the sum of its
    row's lags over m, for a pixel's row mean holds 1/m of every pixel of the partner's channel in
    that row; likewise columns, and both means hold the frame's.
    """
    lags = pairs.shape[0]
    centre = lags // 2
    n, m, step, lost = size
    y, x = phase
    work = np.zeros((4, lags, lags))
    values, scale, rho, least = work[0], work[1], work[2], work[3]
    products = np.empty((lags, lags))
    rows, columns, both = np.empty((lags, step)), np.empty((step, lags)), np.empty((step, step))
    for i in range(lags):
        for j in range(lags):
            partner = variances[(y + i - centre) & 1, (x + j - centre) & 1]
            scale[i, j] = np.sqrt(variances[y, x] * partner)
            product = table[y, x, i, j]
            if step == 1:  # all phases are one channel
                product = product + table[0, 1, i, j] + table[1, 0, i, j] + table[1, 1, i, j]
            products[i, j] = product / max(pairs[i, j], 1.0) / degrees / scale[i, j]
            # Lags within their own error would only add noise.
            least[i, j] = 3 / np.sqrt(pairs[i, j] * degrees)
    rho[centre, centre] = 1.0
    for _ in range(4):
        for p in range(step):
            for i in range(lags):
                rows[i, p] = 0.0
                for k in range(p, lags, step):
                    rows[i, p] += rho[i, k] / m
            for j in range(lags):
                columns[p, j] = 0.0
                for k in range(p, lags, step):
                    columns[p, j] += rho[k, j]
        for p in range(step):
            for q in range(step):
                both[p, q] = 0.0
                for k in range(p, lags, step):
                    both[p, q] += rows[k, q]
        for i in range(lags):
            for j in range(lags):
                p, q = i % step, j % step
                off = rows[i, q] + columns[p, j] / n - both[p, q] * (1 - lost) / n
                values[i, j] = off + products[i, j]
                rho[i, j] = values[i, j] if abs(values[i, j]) > least[i, j] else 0.0
        values[centre, centre] = products[centre, centre]
        rho[centre, centre] = 1.0
    for i in range(lags):
        for j in range(lags):
            if not pairs[i, j] > 0:
                values[i, j] = np.nan
    return work


@kernel
def _beyond_errors(values: Array, pairs: Array, degrees: int) -> float:
    """Return the sum of squares of correlations less what their errors add, centre left out."""
    lags = values.shape[0]
    beyond, counted = np.empty(lags * lags), 0
    for i in range(lags):
        for j in range(lags):
            if pairs[i, j] > 0 and (i != lags // 2 or j != lags // 2):
                beyond[counted] = values[i, j] * values[i, j] - 1 / max(pairs[i, j] * degrees, 1.0)
                counted += 1
    return pairwise_sum(beyond[:counted])


@kernel
def _less(
    values: Array, scale: Array, temporal: Array, temporal_scale: Array, frames: int
) -> tuple[Array, float]:
    """Return correlations less what temporal noise leaves in a mean of frames, and its share.

    The share is that of the variance; nan where there is no noise.
    """
    lags = values.shape[0]
    found, share = np.empty((lags, lags)), 0.0
    for i in range(lags):
        for j in range(lags):
            left = temporal[i, j] * temporal_scale[i, j] / frames / scale[i, j]
            found[i, j] = values[i, j] - left
            if i == lags // 2 and j == lags // 2:
                share = left
    return found, share


@kernel
def _bartlett(observed: Array, pairs: Array, degrees: int, lags: NDArray[np.int64]) -> Array:
    """Return n var(rho) of a linear process at lags (lag, 2), from those known (Bartlett 1946).

    What is known gets a margin of two centres: the formula looks one lag ahead, and one behind.
    Where none is known on one side, it adds nothing.
    """
    size = observed.shape[0]
    centre = size // 2
    top, bottom, left, right = size, 0, size, 0
    known, wide = np.empty((size, size)), np.zeros((size + 4 * centre, size + 4 * centre))
    for i in range(size):
        for j in range(size):
            known[i, j] = observed[i, j] if pairs[i, j] > 0 else 0.0
            if i == centre and j == centre:
                known[i, j] = 1.0
            # Lags within their own error would only add noise: 80 lags of it.
            if abs(known[i, j]) > 3 / np.sqrt(pairs[i, j] * degrees):
                wide[2 * centre + i, 2 * centre + j] = known[i, j]
                top, bottom = min(top, i), max(bottom, i + 1)
                left, right = min(left, j), max(right, j + 1)
    found = np.empty(len(lags))
    for k in range(len(lags)):
        dy, dx = lags[k, 0], lags[k, 1]
        h = known[centre + dy, centre + dx]
        total = 0.0
        for i in range(2 * centre + top, 2 * centre + bottom):
            for j in range(2 * centre + left, 2 * centre + right):
                w, ahead, behind = wide[i, j], wide[i + dy, j + dx], wide[i - dy, j - dx]
                total += w * w + ahead * behind - 4 * h * w * behind + 2 * h * h * (w * w)
        found[k] = total
    return found


@lru_cache(maxsize=64)
def _array(*lags: tuple[int, int]) -> NDArray[np.int64]:
    """Return lags as an array (lag, 2)."""
    return np.array(lags, np.int64).reshape(-1, 2)


@lru_cache(maxsize=16)
def _entries(reach: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return where sums (lag, row parity, column parity) stand in a table, and their mirror."""
    lags = half_plane(reach)
    size = 2 * reach + 1
    y, x = np.indices((2, 2)).reshape(2, -1)
    dy, dx = lags[:, :1], lags[:, 1:]
    here = ((y * 2 + x) * size + reach + dy) * size + reach + dx
    there = (((y + dy) % 2 * 2 + (x + dx) % 2) * size + reach - dy) * size + reach - dx
    return here.reshape(-1), there.reshape(-1)


@lru_cache(maxsize=16)
def _pairs(reach: int, rows: int, columns: int) -> tuple[Array, Array]:
    """Return the number of pairs at each lag by the phase of their first pixel, and of all."""
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
    return pairs, pairs.sum((0, 1))
