"""Patterns of few pixels that change from frame to frame, folded into cells of eight by eight.

What a sensor repeats over two, four or eight pixels or lines, as channels that take turns do, has
frequencies that are multiples of an eighth of a cycle per pixel: so few that a line there stands
out where among all frequencies it would be one of many. Cells know them exactly, whatever the size
of a sensor; what is beyond whole cells is left out. The axes hold what rows and columns have in
common, on a mosaic those of each colour. Few pixels that move farther than all others ever do count
as moving so far.
"""

from collections.abc import Iterable, Iterator
from functools import lru_cache
from math import inf

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.lines import any_of, log_chance
from analysis.mismatch.bank.peaks import Peak
from analysis.mismatch.bank.scalars import UNKNOWN, Number, score_of_log
from dsis.compiled import kernel

Array = NDArray[np.float64]
Image = NDArray[np.float32]
CELL = 8
FEW_PIXELS = "few pixels"
NUMBER, PLACE = f"spectral_peak of {FEW_PIXELS}", f"spectrum, {FEW_PIXELS}"
_LEAST = 4  # cells along each axis
_SAMPLE = 4096  # of which a quantile is taken
_MANY = 0.98  # of pixels: few are beyond
_FAR_OUT = 2.2  # times as far as that, five standard deviations, normal noise hardly moves


class Periods:
    """Cells (frame, row, column) of the frames of one exposure: means over what repeats them.

    Less those of the first frame.
    """

    def __init__(self) -> None:
        self.cells: list[Array] = []
        self.first: Image | None = None
        self.farthest = inf
        self.squares = [0.0, 0.0]

    def watching(self, frames: Iterable[NDArray[np.generic]]) -> Iterator[NDArray[np.generic]]:
        """Yield frames (row, column) as they come, and fold them."""
        for frame in frames:
            own = np.asarray(frame, np.float32)
            if self.first is None:
                self.first = own
                self.cells.append(np.zeros((CELL, CELL)))
            else:
                self._take(own - self.first)
            yield frame

    def _take(self, moved: Image) -> None:
        if len(self.cells) == 1:
            self.farthest = _farthest(moved)
        square = float(np.vdot(moved, moved))
        cells, drawn_in = _folded(moved, np.float32(self.farthest))
        self.squares[0] += square
        self.squares[1] += float(np.vdot(moved, moved)) if drawn_in else square
        self.cells.append(cells)

    @property
    def kept(self) -> float:
        """Which share of the squares is left of those that move farthest."""
        before, after = self.squares
        return after / before if before > 0 else 1.0

    def power(self) -> Array:
        """Return the power over time (row, column), summed over frames: of a mean of cells."""
        cells = np.array(self.cells)
        waves = np.fft.fft(np.fft.fft(cells - cells.sum(0) / len(cells), axis=2), axis=1)
        return np.asarray((np.abs(waves) ** 2).sum(0))


def _farthest(moved: Image) -> float:
    """Return how far all but few pixels ever move between two frames; inf where few move at all."""
    flat = np.abs(moved.reshape(-1)[:: max(moved.size // _SAMPLE, 1) | 1])
    place = (flat.size - 1) * _MANY
    below = int(place)
    above = min(below + 1, flat.size - 1)
    flat.partition((below, above))
    # As `numpy.quantile`, which takes longer for so few: from the nearer of two values.
    low, high, share = flat[below], flat[above], place - below
    far = float(high - (high - low) * (1 - share) if share >= 1 / 2 else low + (high - low) * share)
    return _FAR_OUT * far if far > 0 else inf


@kernel
def _folded(moved: Image, farthest: np.float32) -> tuple[Array, bool]:
    """Draw in what moves farther; return means over cells, and whether anything did."""
    rows, columns = moved.shape[0] // CELL, moved.shape[1] // CELL
    drawn_in = False
    for y in range(moved.shape[0]):
        line = moved[y]
        for x in range(line.size):
            if abs(line[x]) > farthest:
                line[x] = farthest if line[x] > 0 else -farthest
                drawn_in = True
    cells = np.zeros((CELL, CELL))
    for y in range(rows * CELL):
        into, own = cells[y % CELL], np.zeros(CELL)
        for first in range(0, columns * CELL, CELL):
            for x in range(CELL):
                own[x] += moved[y, first + x]
        into += own
    cells /= max(rows * columns, 1)
    return cells, drawn_in


class PeriodSums:
    """Their power over all exposures, white noise scaled to 1; amplitudes constant in DN.

    Parameters
    ----------
    shape
        Rows and columns of the sensor.
    step
        Of a channel's pixels: 1, or 2 on a mosaic.
    """

    def __init__(self, shape: tuple[int, int], step: int) -> None:
        self.shape, self.step = shape, step
        self.repeats = (shape[0] // CELL) * (shape[1] // CELL)
        self.power = np.zeros((CELL, CELL))
        self.weight = self.squares = 0.0

    def add(self, seen: Periods, variance_dn2: float, expected_dn2: float) -> None:
        """Take one exposure: the variance of its pixels, and that expected, which weighs it."""
        degrees = len(seen.cells) - 1
        if degrees < 1 or not variance_dn2 > 0 or min(self.shape) < _LEAST * CELL:
            return
        weight = degrees / expected_dn2
        white = variance_dn2 * seen.kept * degrees * CELL**2 / self.repeats
        self.power += weight * seen.power() / white
        self.weight += weight
        self.squares += weight**2 / degrees

    def number(self) -> Number:
        """Return the normal score of the largest power, of the least of so many chances."""
        places = _places(self.shape, self.step)
        if not self.weight:
            return UNKNOWN
        least = min(self._log_chance(*place) for place in places)
        return score_of_log(any_of(least, len(places))), 1.0

    def peak(self) -> Peak | None:
        """Return where that is: cycles per pixel of a plane, power as one plane shows it."""
        if not self.weight:
            return None
        y, x = min(_places(self.shape, self.step), key=lambda place: self._log_chance(*place))
        power = 1 + (float(self.power[y, x]) / self.weight - 1) / self.step**2
        fy, fx = (at / CELL - float(at > CELL // 2) for at in (y, x))
        return Peak(self.step * fx, self.step * fy, power)

    def _log_chance(self, y: int, x: int) -> float:
        """Return ln of the chance that white noise has as much power there."""
        degrees = self.weight**2 / self.squares
        real = all(at in (0, CELL // 2) for at in (y, x))
        return log_chance(float(self.power[y, x]) / self.weight, 1, 1, degrees / (1 + real))


@lru_cache(maxsize=8)
def _places(shape: tuple[int, int], step: int) -> tuple[tuple[int, int], ...]:
    """Return the frequencies, multiples of 1 / CELL along y and x, each but for its conjugate.

    What alternates along both axes has a number of its own where both are even.
    """
    apart = CELL // step  # planes of a mosaic see this as none at all
    found: set[tuple[int, int]] = set()
    for y in range(CELL):
        for x in range(CELL):
            if y % apart == 0 or x % apart == 0 or ((CELL - y) % CELL, (CELL - x) % CELL) in found:
                continue
            found.add((y, x))
    if shape[0] % 2 == 0 and shape[1] % 2 == 0:
        found -= {(CELL // 2, CELL // 2)}
    return tuple(sorted(found))
