"""Whether all columns meet the same uneven codes, as one converter makes them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_coeffs

from analysis.mismatch.contradicted import Denial
from analysis.mismatch.layout import Layout
from analysis.mismatch.projections import FramesOf

Array = NDArray[np.float64]
_WINDOW, _DEGREE = 9, 5  # of codes, over which a histogram of noise is smooth
_SMOOTH = 2.0  # codes: of less noise it is not; of this it feigns widths that scatter by 1.5 %
_WIDEST = 4096  # codes that the samples of an exposure reach over
_SURE = 4.0  # standard errors
_LIKELY = 2.0
_MET = 1.0  # products of different columns at the same codes, beside squares of single ones
_MOST = 0.4  # of what columns show, that others share: of two converters half of them do


@dataclass(frozen=True)
class ColumnCodes:
    """Mean square of relative widths of codes, less one, beyond chance.

    Attributes
    ----------
    own, own_error
        As single columns show it.
    shared, shared_error
        Of different columns at the same codes: their mean product.
    """

    own: float
    own_error: float
    shared: float
    shared_error: float

    def denial(self) -> Denial | None:
        """Return how codes that are uneven alike everywhere are denied; None: they are not."""
        sure = self.own > _SURE * self.own_error
        if not sure or self.shared + _LIKELY * self.shared_error >= _MOST * self.own:
            return None
        share = max(self.shared / self.own, 0.0)
        return Denial(share, "columns differ in which of their codes are uneven")


def column_codes(layout: Layout, frames_of: FramesOf) -> ColumnCodes | None:
    """Return what the columns of all exposures of uniform light show of uneven codes.

    A column's histogram of codes less a smooth one (Savitzky & Golay, 1964) is what its codes'
    widths make of it, and chance, which is independent. Each is compared with the others' at the
    same code, whatever the columns' offsets. Rows of one parity of a mosaic by themselves. None
    where noise covers too few codes, or columns share too few, and of a large recording.
    """
    if layout.large:
        return None
    kernel = -savgol_coeffs(_WINDOW, _DEGREE)
    kernel[_WINDOW // 2] += 1
    step = 1 + (len(layout.sites) > 1)
    sums = np.zeros(6)
    for exposure in layout.uniform:
        narrowest = min(layout.variance_dn2[exposure.name, c] for c in layout.channels)
        if narrowest < _SMOOTH**2:
            continue
        frames = [np.asarray(frame) for frame in frames_of(exposure.name)]
        for y, x in layout.sites.values():
            planes = [frame[y::step, x::step] for frame in frames]
            counts = _histograms(planes, layout.white_dn)
            if counts is not None:
                sums += _of_columns(counts, kernel)
    own, own_expected, own_square, shared, shared_expected, shared_square = sums
    if not own_expected > 0 or shared_expected < _MET * own_expected:
        return None
    return ColumnCodes(
        own / own_expected,
        float(np.sqrt(2 * own_square)) / own_expected,
        shared / shared_expected,
        float(np.sqrt(2 * max(shared_square, 0.0))) / shared_expected,
    )


def _histograms(planes: Sequence[NDArray[np.generic]], white_dn: float) -> Array | None:
    """Return how often each code occurs in each column of planes (row, column): (column, code).

    Codes are those that may occur, where they come in steps. None where they reach over too many,
    too few, or to an end of the range.
    """
    codes = np.unique(np.concatenate([np.unique(plane) for plane in planes])).astype(np.int64)
    low, high = int(codes[0]), int(codes[-1])
    step = max(int(np.gcd.reduce(codes - low)), 1)
    size = (high - low) // step + 1
    if size > _WIDEST or size <= _WINDOW or low <= 0 or high >= white_dn:
        return None
    columns = planes[0].shape[1]
    first = size * np.arange(columns)
    counts = np.zeros(columns * size, np.int64)
    for plane in planes:
        place = (plane.astype(np.int64) - low) // step + first
        counts += np.bincount(place.ravel(), minlength=counts.size)
    return counts.reshape(columns, size).astype(np.float64)


def _of_columns(counts: Array, kernel: Array) -> Array:
    """Return sums over codes of products of what is uneven, of their weights, of squared chance.

    Of single columns, then of different ones.
    """
    left, chance = _convolved(counts, kernel), _convolved(counts, kernel**2)
    smooth = np.maximum(counts - left, 0.0)
    whole, total, of_all = left.sum(0), smooth.sum(0), chance.sum(0)
    squares, weights = (smooth**2).sum(0), (chance**2).sum(0)
    return np.array(
        [
            float((left**2 - chance).sum()),
            float(squares.sum()),
            float(weights.sum()),
            float((whole**2 - (left**2).sum(0)).sum()),
            float((total**2 - squares).sum()),
            float((of_all**2 - weights).sum()),
        ]
    )


def _convolved(counts: Array, kernel: Array) -> Array:
    half = kernel.size // 2
    padded = np.pad(counts, ((0, 0), (half, half)))
    return np.asarray(sum(k * padded[:, i : i + counts.shape[1]] for i, k in enumerate(kernel)))
