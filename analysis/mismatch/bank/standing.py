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
from functools import cached_property, lru_cache
from math import log

import numpy as np
import scipy.fft
from numpy.typing import NDArray
from scipy.special import betainc, betaln, gammainccinv

from analysis.mismatch.bank.binned import (
    MEAN_LOG,
    above,
    beside_rings,
    beyond_white,
    blocks,
    highest_corner,
    in_rings,
    nearby,
    of_still,
)
from analysis.mismatch.bank.lines import any_of
from analysis.mismatch.bank.peaks import Peak, frequency
from analysis.mismatch.bank.robust import typical_square
from analysis.mismatch.bank.scalars import UNKNOWN, Number, score_of_log
from analysis.mismatch.bank.waves import Moving, WaveSums, add_power, looked_at, some
from dsis.measures.median import median

Array = NDArray[np.float64]
Places = NDArray[np.int_]
Mask = NDArray[np.bool_]
NAME = "fixed_spectral_peak"
_BLOCK = 9  # bins, three along each axis, over which a bent wave spreads
_LOWEST = 4.0  # bins from frequency 0: what is smooth is there, and has numbers of its own
_SPREAD = np.pi**2 / 6  # variance of the logarithm of an exponential variate
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
    size = (sum(sharpness[name] ** 2 for name in planes) / len(planes)) ** 0.5
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
    white, most = moving.white, _most_of_white(moving.degrees)
    found: list[Found] = []
    for down, right in sensor.sizes:
        within, scale = sensor.within[down, right], float(scales[down, right])
        count = sensor.sizes[down, right]
        y, x = _screened(power[down, right], level, within, -log(_share(count)) * scale)
        here = highest_corner(level, (y, x), down, right)
        worth, around = sensor.around(apart, y, x)
        moves = beyond_white(moving.power[down, right], white[down, right], most, (y, x))
        sure = np.where(moves > 0, np.minimum(worth, moving.degrees), worth)
        ratio = power[down, right][y, x] / (here * around * scale + moves)
        found += _least(-sure * np.log1p(ratio / sure), y + down / 2, x + right / 2, count)
    within = sensor.within[0, 0]
    count = sensor.sizes[0, 0]
    limit = float(gammainccinv(_BLOCK, _share(count)))
    y, x = _screened(blocks(power[0, 0], level, within), np.ones(level.shape), within, limit)
    worth, around = sensor.around(apart, y, x)
    moved = (moving.power[0, 0], white[0, 0], most)
    total = of_still(power[0, 0], level, within, moved, (y, x), around)
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
        count = above(power, level, within, limit, found)
        if count <= _MOST:
            return found[0, :count], found[1, :count]
        limit *= _STRICTER


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

    @cached_property
    def known(self) -> Places:
        """Rings that hold bins, or have such neighbours."""
        return np.flatnonzero(self.counts)

    def levels(self, power: Array) -> tuple[Array, Array]:
        """Return what rings tell of the level of each bin, and how far ln of its power is off."""
        level, apart = np.empty(power.shape), np.empty(power.shape)
        sums = np.zeros(self.counts.size)
        in_rings(power, self.within[0, 0], self.ring, sums, apart)
        means = _three(sums) / np.maximum(self.counts, 1.0) - MEAN_LOG
        means = np.interp(np.arange(means.size), self.known, means[self.known])
        beside_rings(means, self.ring, level, apart)
        return level, apart

    def around(self, apart: Array, y: Places, x: Places) -> tuple[Array, Array]:
        """Return how many exponential variates tell the level of bins as well, and a factor on it.

        Most patterns are alike in all directions: the factor, of bins around, allows for others.
        """
        number, total = np.empty(y.size), np.empty(y.size)
        nearby(apart, self.within[0, 0], self.shape[1], (y, x), (number, total))
        number = np.maximum(number, 1.0)
        in_ring = np.maximum(self.counts[np.rint(self.ring[y, x]).astype(np.int_)], 1.0)
        return 1 / (_SPREAD * (1 / in_ring + 1 / number)), np.exp(total / number)


def _three(values: Array) -> Array:
    """Return sums of a ring and its neighbours."""
    found = values.copy()
    found[1:] += values[:-1]
    found[:-1] += values[1:]
    return found
