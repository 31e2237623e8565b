"""Waves that stand still: the power of a map of the fixed pattern, beside what is around each bin.

A display or a grid before the sensor (Moire), or the sensor itself, leaves a sinusoid in the mean
frame. Fixed patterns are not white: what is smooth raises low frequencies, so a bin is compared
with what is around it. Logarithms of the power of Gaussian patterns have a known mean and spread,
and a wave counts little in them; those of n bins tell a level as well as n / 1.64 exponential
variates do by their mean, so that a bin over its level is Fisher's F of 2 and twice as many degrees
of freedom.

A wave of free phase or sign leaves a part in the mean of few frames: where a bin moves from frame
to frame beyond chance, its mean frame moves as well, by what is known.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from math import log

import numpy as np
import scipy.fft
from numpy.typing import NDArray
from scipy.special import betainc, betaln, gammainccinv

from analysis.mismatch.bank.lines import any_of
from analysis.mismatch.bank.peaks import Peak, frequency
from analysis.mismatch.bank.robust import typical_square
from analysis.mismatch.bank.scalars import UNKNOWN, Number, score_of_log
from analysis.mismatch.bank.waves import Moving, WaveSums, add_power, looked_at, some
from dsis.compiled import kernel
from dsis.measures.median import median

Array = NDArray[np.float64]
Places = NDArray[np.int_]
Mask = NDArray[np.bool_]
NAME = "fixed_spectral_peak"
_AROUND, _OWN = 7, 2  # bins to each side that say what is around, and those that do not
_BLOCK = 9  # bins, three along each axis, over which a bent wave spreads
_LOWEST = 4.0  # bins from frequency 0: what is smooth is there, and has numbers of its own
_SPREAD = np.pi**2 / 6  # variance of the logarithm of an exponential variate
_MEAN_LOG = -0.5772156649  # and its mean
_MOVES = 0.01  # chance that a bin of white noise is taken for one that moves more
_LEAST_LINES = 32  # of a sensor: fewer have no bins around that tell anything
_LOOKED_AT = 32  # bins of white noise that are looked at closely: the highest are among them
_MOST = 4096  # in all
_STRICTER = 1.3  # is the limit where there are more
_KINDS = 5  # of places: bins, three between them, and blocks
_FAR_OUT = 5.0  # standard deviations, beyond which pixels count as so far out
_HELD = 1e-290  # chances that a float holds


def standing(
    planes: Mapping[str, Array],
    sharpness: Mapping[str, float],
    sites: Mapping[str, tuple[int, int]],
    waves: WaveSums,
) -> tuple[Number, Peak | None]:
    """Return the normal score of the wave of a map that stands out most, and where it is.

    Of the least of so many chances, as of independent ones (Sidak, 1967): single bins, halfway
    between them, and sums of few neighbours. Of a mosaic all colours are taken in phase.
    Frequencies are in cycles per pixel of a plane; unknown where no frames were transformed.

    Parameters
    ----------
    planes
        By channel: the map beyond rows, columns and smooth surfaces, in units of its noise.
    sharpness
        By channel: what is common (an offset in DN, a relative gain) in units of that noise.
    sites
        First row and column of each channel.
    waves
        What moves from frame to frame.
    """
    moving = waves.moving()
    if moving is None or min(waves.shape) < _LEAST_LINES:
        return UNKNOWN, None
    size = float(np.mean([sharpness[name] ** 2 for name in planes])) ** 0.5
    image = np.zeros(waves.shape, np.float32)
    for name, own in planes.items():  # few pixels that stand far out are no wave, and hide none
        y, x = sites[name]
        limit = _FAR_OUT * typical_square(some(own)) ** 0.5
        share = sharpness[name] / size
        image[y :: waves.step, x :: waves.step] = share * np.clip(own, -limit, limit)
    return strongest(image, moving, waves.step)


def strongest(image: NDArray[np.floating], moving: Moving, step: int) -> tuple[Number, Peak | None]:
    """Return score and place of the strongest wave of a map on all pixels of a sensor.

    `step`: of a channel's pixels, 1, or 2 on a mosaic.
    """
    rows, columns = image.shape
    sensor = _Sensor.of(rows, columns, step)
    power = np.zeros((2, 2, rows, columns // 2 + 1))
    add_power(scipy.fft.rfft2(image), 1 / image.size, power)
    # The middle of the sensor counts more than its edges between bins: each by its own middle.
    middles = np.array([[median(some(own)) for own in pair] for pair in power])
    if not middles.min() > 0:
        return UNKNOWN, None
    scales = middles / middles[0, 0]
    level, apart = sensor.levels(power[0, 0])
    white = moving.white
    found: list[Found] = []
    for down, right in sensor.sizes:
        within, scale = sensor.within[down, right], float(scales[down, right])
        count = sensor.sizes[down, right]
        y, x = _screened(power[down, right], level, within, -log(_share(count)) * scale)
        here = np.max([level[v, u] for v, u in sensor.corners(y, x, down, right)], 0)
        worth, around = sensor.around(apart, y, x)
        moves = _moves(moving, white[down, right], (down, right), y, x)
        sure = np.where(moves > 0, np.minimum(worth, moving.degrees), worth)
        ratio = power[down, right][y, x] / (here * around * scale + moves)
        found += _least(-sure * np.log1p(ratio / sure), y + down / 2, x + right / 2, count)
    within = sensor.within[0, 0]
    count = sensor.sizes[0, 0]
    limit = float(gammainccinv(_BLOCK, _share(count)))
    y, x = _screened(_blocks(power[0, 0], level, within), np.ones(level.shape), within, limit)
    worth, around = sensor.around(apart, y, x)
    total, ratio = np.zeros(y.size), power[0, 0] / level
    for v, u in ((v, u) for v in (-1, 0, 1) for u in (-1, 0, 1)):
        below, beside = (y + v) % rows, np.minimum(x + u, level.shape[1] - 1)
        still = within[below, beside] & (_moves(moving, white[0, 0], (0, 0), below, beside) == 0)
        total += np.where(still, ratio[below, beside] / around, 1.0)
    found += _least(_log_above(_BLOCK, total, worth), y, x, count)
    if not found:
        return (score_of_log(0.0), 1.0), None
    chance, *place = min(found)
    fy, fx = (frequency(*own) for own in zip(place, image.shape, strict=True))
    at = int(place[0]), int(place[1])
    height = float(power[0, 0][at] / level[at])
    peak = Peak(step * fx, step * (fy - float(fy > 1 / 2)), height)
    return (score_of_log(any_of(chance, _KINDS)), 1.0), peak


Found = tuple[float, float, float]
"""ln of the chance of the largest among many, and its place in bins: down, across."""


def _least(
    chances: Array,
    down: NDArray[np.number],
    across: NDArray[np.number],
    count: int,
) -> list[Found]:
    if not chances.size:
        return []
    top = int(chances.argmin())
    return [(any_of(float(chances[top]), count), float(down[top]), float(across[top]))]


def _share(count: int) -> float:
    """Return the share of bins of white noise that are looked at closely."""
    return min(_LOOKED_AT / max(count, 1), 0.5)


def _screened(power: Array, level: Array, within: Mask, limit: float) -> tuple[Places, Places]:
    """Return the bins that stand out of a first level by so much: the largest of them at least."""
    found = np.empty((2, _MOST), np.int_)
    while True:
        count = _above(power, level, within, limit, found)
        if count <= _MOST:
            return found[0, :count], found[1, :count]
        limit *= _STRICTER


def _moves(moving: Moving, white: float, half: tuple[int, int], y: Places, x: Places) -> Array:
    """Return what bins move beyond white noise, in its units; 0 where chance moves them as much."""
    limit = _most_of_white(moving.degrees)
    own = moving.power[half][y, x] / max(white, 1e-300)
    return np.asarray(np.where(own > limit, own - 1, 0.0))


@lru_cache(maxsize=64)
def _most_of_white(degrees: int) -> float:
    """Return the power, of a mean of 1, that bins of white noise exceed by the chance `_MOVES`."""
    return float(gammainccinv(degrees, _MOVES)) / degrees


def _log_above(count: int, total: Array, worth: Array) -> Array:
    """Return ln of the chances that so many exponential variates sum up to more.

    Their mean is known as well as from `worth` others.
    """
    share = worth / (worth + total)
    chance = betainc(worth, count, share)
    found = np.log(np.maximum(chance, _HELD))
    far = ~(chance > _HELD)
    share, worth = share[far], worth[far]
    found[far] = worth * np.log(share) - np.log(worth) - betaln(worth, count)
    return np.asarray(found)


@dataclass(frozen=True, eq=False)
class _Sensor:
    """Bins of a sensor's spectrum.

    Attributes
    ----------
    shape
        Rows and columns.
    within
        Which bins are looked at: (half a bin down, half a bin right, row, column // 2 + 1).
    sizes
        How many.
    ring
        Distance from frequency 0, or of a mosaic from the nearest that all planes see as 0, in
        cycles along the shorter side; those about one such frequency come after those of another.
    counts
        Bins in each ring and its neighbours.
    """

    shape: tuple[int, int]
    within: Mask
    sizes: Mapping[tuple[int, int], int]
    ring: Array
    counts: Array

    @classmethod
    @lru_cache(maxsize=4)
    def of(cls, rows: int, columns: int, step: int) -> "_Sensor":
        """Return those of a sensor; `step`: 2 of a mosaic."""
        seen = looked_at((rows, columns), step)
        if rows % 2 == 0 and columns % 2 == 0:  # what alternates along both axes: has its own
            seen[rows - 1 : rows + 2, columns - 1 : columns + 2] = False
        v = np.arange(2 * rows)[:, np.newaxis] / (2 * rows) * step
        u = np.arange(seen.shape[1]) / (2 * columns) * step
        down, across = v - np.rint(v), u - np.rint(u)
        seen &= np.hypot(down * rows, across * columns) >= step * _LOWEST
        within = np.stack([[seen[y::2, x::2] for x in (0, 1)] for y in (0, 1)])
        shorter = min(rows, columns)
        ring = np.hypot(down, across) * (shorter / step)
        ring = ring + (np.rint(v) % step * step + np.rint(u) % step) * (shorter + 4)
        ring = np.ascontiguousarray(ring[::2, ::2])
        size = int(ring.max()) + 3
        counts = np.bincount(np.rint(ring[within[0, 0]]).astype(np.int_), minlength=size)
        sizes = {half: int(within[half].sum()) for half in ((0, 0), (0, 1), (1, 0), (1, 1))}
        return cls((rows, columns), within, sizes, ring, _three(counts.astype(np.float64)))

    def levels(self, power: Array) -> tuple[Array, Array]:
        """Return what rings tell of the level of each bin, and how far ln of its power is off."""
        level, apart = np.empty(power.shape), np.empty(power.shape)
        sums = np.zeros(self.counts.size)
        _in_rings(power, self.within[0, 0], self.ring, sums, apart)
        means = _three(sums) / np.maximum(self.counts, 1.0) - _MEAN_LOG
        known = np.flatnonzero(self.counts)
        means = np.interp(np.arange(means.size), known, means[known])
        _beside_rings(means, self.ring, level, apart)
        return level, apart

    def around(self, apart: Array, y: Places, x: Places) -> tuple[Array, Array]:
        """Return how many exponential variates tell the level of bins as well, and a factor on it.

        Most patterns are alike in all directions: the factor, of bins around, allows for others.
        """
        number, total = np.empty(y.size), np.empty(y.size)
        _nearby(apart, self.within[0, 0], self.shape[1], (y, x), (number, total))
        number = np.maximum(number, 1.0)
        in_ring = np.maximum(self.counts[np.rint(self.ring[y, x]).astype(np.int_)], 1.0)
        return 1 / (_SPREAD * (1 / in_ring + 1 / number)), np.exp(total / number)

    def corners(self, y: Places, x: Places, down: int, right: int) -> list[tuple[Places, Places]]:
        """Return the bins between which places lie."""
        rows, last = self.shape[0], self.ring.shape[1] - 1
        return [
            ((y + v) % rows, np.minimum(x + u, last))
            for v in range(down + 1)
            for u in range(right + 1)
        ]


def _three(values: Array) -> Array:
    """Return sums of a ring and its neighbours."""
    found = values.copy()
    found[1:] += values[:-1]
    found[:-1] += values[1:]
    return found


@kernel
def _in_rings(power: Array, within: Mask, ring: Array, sums: Array, logs: Array) -> None:
    """Add the logarithms of bins to their rings."""
    for y in range(power.shape[0]):
        for x in range(power.shape[1]):
            logs[y, x] = np.log(max(power[y, x], 1e-300))
            if within[y, x]:
                sums[int(ring[y, x] + 0.5)] += logs[y, x]


@kernel
def _beside_rings(means: Array, ring: Array, level: Array, logs: Array) -> None:
    """Take from logarithms what rings tell of their mean."""
    for y in range(ring.shape[0]):
        for x in range(ring.shape[1]):
            lower = int(ring[y, x])
            mean = means[lower] + (ring[y, x] - lower) * (means[lower + 1] - means[lower])
            level[y, x] = np.exp(mean)
            logs[y, x] -= mean + _MEAN_LOG


@kernel
def _above(power: Array, level: Array, within: Mask, limit: float, found: Places) -> int:
    """Write rows and columns of bins above a limit; return how many there are, written or not."""
    count = 0
    for y in range(power.shape[0]):
        for x in range(power.shape[1]):
            if within[y, x] and power[y, x] > limit * level[y, x]:
                if count < found.shape[1]:
                    found[0, count], found[1, count] = y, x
                count += 1
    return count


@kernel
def _blocks(power: Array, level: Array, within: Mask) -> Array:
    """Return sums over three bins along each axis, in units of their level; others count as 1."""
    rows, columns = power.shape
    found = np.zeros((rows, columns))
    line = np.ones(columns)
    for y in range(rows):
        for x in range(columns):
            line[x] = power[y, x] / level[y, x] if within[y, x] else 1.0
        for x in range(columns):
            three = line[x] + (line[x - 1] if x else 1.0)
            three += line[x + 1] if x + 1 < columns else 1.0
            found[(y - 1) % rows, x] += three
            found[y, x] += three
            found[(y + 1) % rows, x] += three
    return found


@kernel
def _nearby(
    apart: Array,
    within: Mask,
    columns: int,
    places: tuple[Places, Places],
    found: tuple[Array, Array],
) -> None:
    """Count the bins around places, and sum how far they are off; around the ends too."""
    rows, half = apart.shape
    for i in range(places[0].size):
        number, total = 0, 0.0
        for v in range(-_AROUND, _AROUND + 1):
            for u in range(-_AROUND, _AROUND + 1):
                if max(abs(v), abs(u)) <= _OWN:
                    continue
                y, x = places[0][i] + v, places[1][i] + u
                if x < 0 or x >= half:  # a bin's conjugate is at the opposite frequency
                    y, x = -y, -x if x < 0 else columns - x
                while y < 0:  # a division takes longer
                    y += rows
                while y >= rows:
                    y -= rows
                if 0 <= x < half and within[y, x]:
                    number += 1
                    total += apart[y, x]
        found[0][i], found[1][i] = number, total
