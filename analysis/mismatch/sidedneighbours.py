"""Neighbours that are more alike on one side of the sensor: charge is left behind, line by line."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.robust import FAR_OUT, FEW, typical_square
from analysis.mismatch.basefit import CLIPPED_SHARE
from analysis.mismatch.contradicted import Denial
from analysis.mismatch.layout import Layout
from analysis.mismatch.projections import FramesOf

Array = NDArray[np.float64]
SHARED = frozenset({"brighter_fatter", "crosstalk", "readout_memory", "spatial_filtering"})
"""What all neighbours share alike, wherever they are on the sensor."""
_PARTS = 3
_LEAST_FRAMES, _MOST_FRAMES = 3, 16
_MOST_SAMPLES = 1 << 24  # of one exposure: of large frames fewer are asked, of larger ones none
_EVEN = 1.2  # ratio of variances of thirds, up to which noise is the same all over
_LEAST_LINES = 24
_APART = 1.0  # of what neighbours share in the mean, by which one side has more than the other
_SURE = 6.0  # standard errors


@dataclass(frozen=True)
class Sided:
    """How much more alike neighbours are on one side of the sensor than on the other.

    Attributes
    ----------
    apart, error
        Of what they share in the mean, and its standard error.
    """

    apart: float = 0.0
    error: float = np.inf

    def denial(self, kind: str) -> Denial | None:
        """Return how what all neighbours share is denied; None: it is not."""
        if kind not in SHARED or abs(self.apart) < max(_APART, _SURE * self.error):
            return None
        why = "neighbours are far more alike on one side of the sensor than on the other"
        return Denial(max(1 - abs(self.apart) / 2, 0.0), why)


def sided(layout: Layout, frames_of: FramesOf) -> Sided:
    """Return the surest of how differently neighbours are alike on both sides of the sensor.

    Charge that is transferred from line to line leaves some behind each time: neighbours share the
    more of it, the farther they are from the read-out; what pixels share by their shape, or a
    filter, they share everywhere. Correlations of neighbours along rows, or along columns, of the
    first and the last third of rows, or of columns; of darks and flats by what they share in the
    mean. Means of lines, which may move, are taken off. Where light, or a glow, is so uneven that
    thirds differ in noise, nothing is asked. In white noise a third of N samples tells a
    correlation to (3 / N)^1/2. Of a mosaic neighbours are those of other colours.
    """
    sums: dict[tuple[int, int], Array] = {}
    for exposure in layout.uniform:
        most = _MOST_SAMPLES // (layout.rows * layout.columns)
        count = min(len(exposure.numbers), _MOST_FRAMES, most)
        if count < _LEAST_FRAMES or min(layout.rows, layout.columns) < _LEAST_LINES:
            continue
        first = islice(frames_of(exposure.name), count)
        stack = np.stack([np.asarray(frame, np.float32) for frame in first])
        for at, (low, mean, high, samples) in _alike(layout, stack):
            weight = samples / _PARTS
            own = np.array([mean * (high - low), mean**2]) * weight
            sums[at] = sums.get(at, np.zeros(2)) + own
    found = [
        Sided(through / square, (2 / square) ** 0.5)
        for through, square in sums.values()
        if square > 0
    ]
    return max(found, key=lambda one: abs(one.apart) / one.error, default=Sided())


def _alike(
    layout: Layout, stack: NDArray[np.float32]
) -> Iterator[tuple[tuple[int, int], tuple[float, float, float, int]]]:
    """Yield by axes what neighbours share in the first third, in the mean and in the last one.

    The axis along which they are neighbours, and the one that is parted; last, how many samples
    tell it. Nothing of frames (frame, row, column) of which samples are clipped, or of which many
    pixels are far out: few that are hit once, or blink, are left out.
    """
    if ((stack <= 0) | (stack >= layout.white_dn)).mean() > CLIPPED_SHARE:
        return
    rest = stack - stack.mean(0)
    for y, x in layout.sites.values():
        step = 1 if len(layout.sites) == 1 else 2
        plane = rest[:, y::step, x::step]  # a view: lines, and spreads, are those of a colour
        plane -= plane.mean(1, keepdims=True)
        plane -= plane.mean(2, keepdims=True)
        if not _only_the_many(plane):
            return
    squares = (rest**2).mean(0, dtype=np.float64)
    for along in (1, 2):
        size = rest.shape[along]
        before, after = (rest.take(range(i, size - 1 + i), along) for i in (0, 1))
        product = (before * after).mean(0, dtype=np.float64)
        for parted in (0, 1):
            lines = product.mean(1 - parted)
            third = lines.size // _PARTS
            noise = squares.mean(1 - parted)
            ends = float(noise[:third].mean()), float(noise.mean()), float(noise[-third:].mean())
            if max(ends) > _EVEN * min(ends):
                continue
            shares = float(lines[:third].mean()), float(lines.mean()), float(lines[-third:].mean())
            yield (along, parted), (*shares, rest[1:].size)


def _only_the_many(plane: NDArray[np.float32]) -> bool:
    """Make pixels that are far out once 0, and the mean square 1; return whether these are few.

    Means of lines (frame, row, column) are those of the pixels that are left.
    """
    plane /= max(typical_square(plane.astype(np.float64)) ** 0.5, 1e-9)
    kept = ~(np.abs(plane) > FAR_OUT).any(0)
    if kept.mean() < 1 - FEW:
        return False
    plane *= kept
    for axis in (1, 2):
        count = np.expand_dims(np.maximum(kept.sum(axis - 1), 1), (0, axis))
        plane -= plane.sum(axis, keepdims=True) / count.astype(np.float32)
        plane *= kept
    plane /= max(float(np.sqrt((plane**2).mean())), 1e-9)
    return True
