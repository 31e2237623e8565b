"""Pixel variance of the many: single spikes, and what they do to a plain variance, left out."""

from collections.abc import Iterable, Iterator
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.layout import Layout
from dsis.compiled import inlined, kernel
from dsis.measures.median import median

_FARTHEST = 5.0  # standard deviations of a difference: normal ones lie within
_MOST_FAR = 0.2  # share of differences: more are no spikes
_SAMPLES = 4096  # that tell by how much a frame moved as a whole
Image = NDArray[np.float32]
Sums = NDArray[np.float64]


class Bulk:
    """Sums over differences of successive frames less what frames moved as a whole, by channel.

    Parameters
    ----------
    places
        First row, first column and step of each channel.
    expected_dn2
        Variance of each channel's pixels, roughly: differences farther than five standard
        deviations are left out.
    """

    def __init__(
        self, places: dict[str, tuple[int, int, int]], expected_dn2: dict[str, float]
    ) -> None:
        self.places = places
        self.farthest = {c: _FARTHEST * sqrt(2 * v) for c, v in expected_dn2.items()}
        self.sums = {channel: np.zeros(4) for channel in places}
        self.pairs = 0

    @classmethod
    def of(cls, layout: Layout, exposure: str) -> "Bulk":
        """Return empty sums for an exposure; its recorded frames say what is far."""
        step = 1 if len(layout.sites) == 1 else 2
        places = {c: (y, x, step) for c, (y, x) in layout.sites.items()}
        return cls(places, {c: layout.variance_dn2[exposure, c] for c in places})

    def watching(self, frames: Iterable[NDArray[np.generic]]) -> Iterator[NDArray[np.generic]]:
        """Yield frames (row, column) as they come, and take their differences."""
        last: Image | None = None
        for frame in frames:
            own = np.ascontiguousarray(frame, np.float32)
            if last is not None:
                self.pairs += 1
                for channel, place in self.places.items():
                    moved = _moved(last, own, place)
                    self.sums[channel] += _within(last, own, place, moved, self.farthest[channel])
            last = own
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


def _moved(one: Image, other: Image, place: tuple[int, int, int]) -> float:
    """Return by how much most pixels of a channel moved: light flickers, offsets drift."""
    return median(_sampled(one, other, place))


@kernel
def _sampled(one: Image, other: Image, place: tuple[int, int, int]) -> Image:
    """Return the change of every so many pixels of a channel."""
    y0, x0, step = place
    rows, columns = -((y0 - one.shape[0]) // step), -((x0 - one.shape[1]) // step)
    every = max(rows * columns // _SAMPLES, 1)
    found = np.empty((rows * columns + every - 1) // every, np.float32)
    y = x = 0
    for i in range(found.size):
        while x >= columns:
            x -= columns
            y += 1
        at, along = y0 + y * step, x0 + x * step
        found[i] = other[at, along] - one[at, along]
        x += every
    return found


@kernel
def _within(
    one: Image, other: Image, place: tuple[int, int, int], moved: float, farthest: float
) -> Sums:
    """Return the sum of squared differences about means of lines, and its degrees of freedom.

    Then how many differences were taken, of how many. Loops over `lines` alone are vector
    instructions, whatever the step.
    """
    y0, x0, step = place
    rows, columns = -((y0 - one.shape[0]) // step), -((x0 - one.shape[1]) // step)
    lines = np.zeros((5, columns))
    change, near, by_column, met, squares = lines[0], lines[1], lines[2], lines[3], lines[4]
    across, total, count, taken = 0.0, 0.0, 0.0, 0.0
    for y in range(rows):
        _differ(one[y0 + y * step], other[y0 + y * step], x0, step, moved, change)
        for x in range(columns):
            far = abs(change[x]) > farthest
            near[x] = 0.0 if far else 1.0
            change[x] = 0.0 if far else change[x]
        for x in range(columns):
            squares[x] += change[x] * change[x]
            by_column[x] += change[x]
            met[x] += near[x]
        own, n = _summed(change), _summed(near)
        if n > 0:
            across += own * own / n
            taken += 1
        total += own
        count += n
    for x in range(columns):
        if met[x] > 0:
            across += by_column[x] * by_column[x] / met[x]
            taken += 1
    size = float(rows * columns)
    if count < 1:
        return np.array([0.0, 0.0, 0.0, size])
    return np.array(
        [_summed(squares) - across + total * total / count, count - taken + 1, count, size]
    )


@inlined
def _differ(one: Image, other: Image, x0: int, step: int, moved: float, change: Sums) -> None:
    """Write by how much samples of a line changed beyond what most did."""
    if step == 1:
        for x in range(change.size):
            change[x] = np.float64(other[x]) - np.float64(one[x]) - moved
    else:
        for x in range(change.size):
            at = x0 + x * step
            change[x] = np.float64(other[at]) - np.float64(one[at]) - moved


@inlined
def _summed(line: Sums) -> float:
    """Return the sum of a line; of four parts, which do not wait for one another."""
    a = b = c = d = 0.0
    end = line.size // 4 * 4
    for i in range(0, end, 4):
        a += line[i]
        b += line[i + 1]
        c += line[i + 2]
        d += line[i + 3]
    for i in range(end, line.size):
        a += line[i]
    return (a + b) + (c + d)
