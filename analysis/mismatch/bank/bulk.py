"""Pixel variance of the many: single spikes, and what they do to a plain variance, left out."""

from collections.abc import Iterable, Iterator
from math import inf, nan, sqrt

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.layout import Layout
from dsis.compiled import kernel

_FARTHEST = 5.0  # standard deviations of a difference: normal ones lie within
LOSS = 1.5  # by which differences of successive frames say less than squares about a mean
Plane = NDArray[np.float32]
Sums = NDArray[np.float64]


class Bulk:
    """Sums over differences of successive frames, by channel.

    Parameters
    ----------
    planes
        Rows and columns of each channel.
    expected_dn2
        Variance of each channel's pixels, roughly: differences farther than five standard
        deviations are left out.
    """

    def __init__(
        self, planes: dict[str, tuple[slice, slice]], expected_dn2: dict[str, float]
    ) -> None:
        self.planes = planes
        self.farthest = {c: _FARTHEST * sqrt(2 * v) for c, v in expected_dn2.items()}
        self.sums = {channel: np.zeros(4) for channel in planes}

    @classmethod
    def of(cls, layout: Layout, exposure: str) -> "Bulk":
        """Return empty sums for an exposure; its recorded frames say what is far."""
        step = 1 if len(layout.sites) == 1 else 2
        planes = {
            c: (slice(y, None, step), slice(x, None, step)) for c, (y, x) in layout.sites.items()
        }
        return cls(planes, {c: layout.variance_dn2[exposure, c] for c in planes})

    def watching(self, frames: Iterable[NDArray[np.generic]]) -> Iterator[NDArray[np.generic]]:
        """Yield frames (row, column) as they come, and take their differences."""
        before: dict[str, Plane] = {}
        for frame in frames:
            for channel, place in self.planes.items():
                own = np.ascontiguousarray(frame[place], np.float32)
                if channel in before:
                    farthest = self.farthest.get(channel, inf)
                    self.sums[channel] += _within(before[channel], own, farthest)
                before[channel] = own
            yield frame

    def variance_dn2(self, channel: str) -> float:
        """Return the variance of a pixel over time, DN^2; nan where too little is left."""
        squares, dof, _, _ = self.sums[channel]
        return float(squares / dof / 2) if dof > 0 else nan

    def far(self, channel: str) -> float:
        """Return the share of differences that were left out."""
        _, _, kept, whole = self.sums[channel]
        return float(1 - kept / whole) if whole else nan


@kernel
def _within(one: Plane, other: Plane, farthest: float) -> Sums:
    """Return the sum of squared differences about means of lines, and its degrees of freedom.

    Then how many differences were taken, of how many.
    """
    rows, columns = one.shape
    by_column, met = np.zeros(columns), np.zeros(columns)
    squares, across, total, count, lines = 0.0, 0.0, 0.0, 0.0, 0.0
    for y in range(rows):
        own, n = 0.0, 0.0
        for x in range(columns):
            d = float(other[y, x]) - float(one[y, x])
            if abs(d) > farthest:
                continue
            squares += d * d
            own += d
            n += 1
            by_column[x] += d
            met[x] += 1
        if n > 0:
            across += own * own / n
            lines += 1
        total += own
        count += n
    for x in range(columns):
        if met[x] > 0:
            across += by_column[x] * by_column[x] / met[x]
            lines += 1
    if count < 1:
        return np.array([0.0, 0.0, 0.0, one.size])
    own = squares - across + total * total / count
    return np.array([own, count - lines + 1, count, one.size])
