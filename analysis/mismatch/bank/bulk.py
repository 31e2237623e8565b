"""Pixel variance of the many: single spikes, and what they do to a plain variance, left out."""

from collections.abc import Iterable, Iterator
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.layout import Layout
from dsis.compiled import kernel

_FARTHEST = 5.0  # standard deviations of a difference: normal ones lie within
_MOST_FAR = 0.2  # share of differences: more are no spikes
_SAMPLES = 4096  # that tell by how much a frame moved as a whole
Plane = NDArray[np.float32]
Sums = NDArray[np.float64]


class Bulk:
    """Sums over differences of successive frames less what frames moved as a whole, by channel.

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
        self.pairs = 0

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
            self.pairs += bool(before)
            for channel, place in self.planes.items():
                own = np.ascontiguousarray(frame[place], np.float32)
                if channel in before:
                    last, farthest = before[channel], self.farthest[channel]
                    self.sums[channel] += _within(last, own, _moved(last, own), farthest)
                before[channel] = own
            yield frame

    def variance_dn2(self, channel: str, plain_dn2: float) -> float:
        """Return the variance of a pixel, DN^2; the plain one where spikes are not rare."""
        squares, dof, _, _ = self.sums[channel]
        return float(squares / dof / 2) if dof > 0 and self.far(channel) < _MOST_FAR else plain_dn2

    def dof(self, channel: str) -> float:
        """Return its degrees of freedom: differences of successive frames share a frame.

        Of n - 1 of them (3 n - 4) / (2 n - 2) say as much as one square about a mean.
        """
        frames = self.pairs + 1
        return float(self.sums[channel][1]) * (2 * frames - 2) / max(3 * frames - 4, 1)

    def far(self, channel: str) -> float:
        """Return the share of differences that were left out."""
        _, _, kept, whole = self.sums[channel]
        return float(1 - kept / whole) if whole else 0.0


def _moved(one: Plane, other: Plane) -> float:
    """Return by how much most pixels moved: light flickers, offsets drift."""
    step = max(one.size // _SAMPLES, 1)
    return float(np.median(other.reshape(-1)[::step] - one.reshape(-1)[::step]))


@kernel
def _within(one: Plane, other: Plane, moved: float, farthest: float) -> Sums:
    """Return the sum of squared differences about means of lines, and its degrees of freedom.

    Then how many differences were taken, of how many.
    """
    rows, columns = one.shape
    by_column, met = np.zeros(columns), np.zeros(columns)
    squares, across, total, count, lines = 0.0, 0.0, 0.0, 0.0, 0.0
    for y in range(rows):
        own, n = 0.0, 0.0
        for x in range(columns):
            d = float(other[y, x]) - float(one[y, x]) - moved
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
