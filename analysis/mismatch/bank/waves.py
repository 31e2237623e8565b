"""Sinusoids over the whole sensor: temporal power at the frequencies of bins and halfway between.

A sinusoid that lies between bins loses up to 1 - (2 / pi)^4 = 84 % of its power in each of them;
half the difference of neighbouring bins' amplitudes has the power of one bin in white noise, and
loses 34 % at most of a sinusoid that lies there. Of a mosaic all colours are taken in phase, so
that channels add by amplitude, not by power, and a frequency has no aliases.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from analysis.mismatch.bank.between import Kept, Top, highest, log_chance_of
from analysis.mismatch.bank.coherent import LAGS
from analysis.mismatch.bank.lines import any_of, log_chance, without_lines
from analysis.mismatch.bank.peaks import Peak, frequency, white_level
from analysis.mismatch.bank.peaks import top as parabola
from analysis.mismatch.bank.scalars import UNKNOWN, Number, score_of_log
from dsis.compiled import inlined, kernel
from dsis.measures import Channel
from dsis.measures.median import median

Array = NDArray[np.float64]
Image = NDArray[np.float32]
Amplitudes = NDArray[np.complexfloating]
_SAMPLE = 8192  # values of which a median is taken
_TOGETHER = 2**17  # pixels of small frames that are transformed in one call
_PAIRED = {"rows": (("R", "Gr"), ("Gb", "B")), "columns": (("R", "Gb"), ("Gr", "B"))}
"""Channels that take turns along a line."""


class Waves:
    """Amplitudes of the frames of one exposure, less the first, summed on bins and between them.

    With `keep` they are kept besides, of every frame.
    """

    def __init__(self, shape: tuple[int, int], *, keep: bool = False) -> None:
        rows, columns = shape
        self.kept: list[Amplitudes] | None = [] if keep else None
        self.pixels, self.half = rows * columns, (rows, columns // 2 + 1)
        self.power: Array | None = None  # of two frames the second's amplitudes say it all
        self.total: Amplitudes
        self.frames = 0

    def watching(self, frames: Iterable[NDArray[np.generic]]) -> Iterator[NDArray[np.generic]]:
        """Yield frames (row, column) as they come, and take their spectra."""
        first: Image | None = None
        waiting: list[Image] = []
        for frame in frames:
            image = np.asarray(frame, np.float32)
            if first is None:
                first = image
            else:
                waiting.append(image - first)
            if len(waiting) * self.pixels > _TOGETHER:
                self._take_all(waiting)
            yield frame
        if waiting:
            self._take_all(waiting)

    def _take_all(self, changes: list[Image]) -> None:
        """Take the spectra of some frames less the first, and forget these."""
        alone = len(changes) == 1  # a large one is not copied
        images = changes[0][np.newaxis] if alone else np.stack(changes)
        for transform in scipy.fft.rfft2(images, overwrite_x=True):
            self.take(transform)
        changes.clear()

    def take(self, transform: Amplitudes) -> None:
        """Take the transform (row, column // 2 + 1) of a frame less the first."""
        self.frames = max(self.frames, 1) + 1
        if self.kept is not None:
            self.kept.append(transform)
        if self.frames == 2:
            self.total = transform
            return
        if self.power is None:
            self.power = np.zeros((2, 2, *self.half))
            add_power(self.total, 1.0, self.power)
            self.total = self.total.astype(np.complex128)
        self.total += transform
        add_power(transform, 1.0, self.power)

    def add_to(self, power: Array, weight: float) -> None:
        """Add the power over time, in units in which white noise has its variance in every bin.

        `power`: (half a bin down, half a bin right, row, column // 2 + 1). Needs two frames.
        """
        per_bin = self.per_bin(weight)
        if self.power is None:
            add_power(self.total, per_bin / 2, power)
        else:
            power += per_bin * self.power
            add_power(self.total, -per_bin / self.frames, power)

    def add_bins_to(self, power: Array, weight: float) -> None:
        """Add the power of the bins alone, (row, column // 2 + 1), in the same units."""
        per_bin = self.per_bin(weight)
        whole = self.total.real**2 + self.total.imag**2
        if self.power is None:
            power += per_bin / 2 * whole
        else:
            power += per_bin * (self.power[0, 0] - whole / self.frames)

    def per_bin(self, weight: float) -> float:
        """Return by what squares are multiplied: see `add_to`."""
        return weight / (self.pixels * (self.frames - 1))


@dataclass(frozen=True)
class Moving:
    """What moves from frame to frame: power of bins and halfway between them, in any unit.

    Attributes
    ----------
    power
        (half a bin down, half a bin right, row, column // 2 + 1).
    degrees
        Independent frames in it.
    """

    power: Array
    degrees: int

    @cached_property
    def white(self) -> dict[tuple[int, int], float]:
        """Power of a bin of white noise, by where bins lie: half a bin down, half a bin right."""
        halves = [(down, right) for down in (0, 1) for right in (0, 1)]
        return {half: white_level(some(self.power[half]), self.degrees) for half in halves}


class WaveSums:
    """Power of waves over all exposures, white noise scaled to 1.

    Of waves, amplitudes are constant in DN; of lags, in proportion to the noise.

    Parameters
    ----------
    shape
        Rows and columns of the sensor.
    step
        Of a channel's pixels: 1, or 2 on a mosaic, whose rows and columns are even then.
    taken
        Whether exposures have spectra; else all numbers are unknown.
    """

    def __init__(self, shape: tuple[int, int], step: int, *, taken: bool = True) -> None:
        self.shape, self.step, self.taken = shape, step, taken
        rows, columns = shape
        self.power = np.zeros((2, 2, rows, columns // 2 + 1))
        self.weight = self.squares = 0.0
        self.relative = np.zeros(self.power.shape[2:] if step == 2 else (0, 0))
        self.seen, self.uneven = 0, dict.fromkeys(_PAIRED, 0.0)
        self._moving: Moving | None = None  # every map asks for it
        self._kept: list[Kept] = []
        self._highest: Top | None = None

    def add(
        self, waves: Waves, channels: Mapping[str, Channel], variance_dn2: Mapping[str, float]
    ) -> None:
        """Take one exposure; the variance that is expected of each channel weighs it."""
        white, expected = of_sensor(channels, variance_dn2)
        if waves.frames < 2 or not white > 0:
            return
        seen = waves.frames - 1
        weight = seen / expected
        self._moving = self._highest = None
        if self.taken:
            waves.add_to(self.power, weight / white)
            if waves.kept:
                maps = [channel.variance_map for channel in channels.values()]
                own = Kept.of(waves.kept, waves.per_bin(weight / white), weight / white, maps)
                self._kept.append(own)
        self.weight += weight
        self.squares += weight**2 / seen
        if self.step == 2:
            each = {name: c.estimates["pixel_variance"].value for name, c in channels.items()}
            for axis, pairs in _PAIRED.items():
                alike = sum(each[a] * each[b] for a, b in pairs) / len(pairs)
                self.uneven[axis] += seen * alike / white**2
            self.seen += seen
            if self.taken:
                waves.add_bins_to(self.relative, seen / white)

    def number(self) -> Number:
        """Return the normal score of the largest power, on bins or between them.

        Of the least of so many chances, as of independent ones (Sidak, 1967): it is standard normal
        in white noise, and its upper tail, by which a line is told, no lighter than that. Where
        amplitudes of frames are kept, of the largest power at any frequency: of that the upper tail
        is normal.
        """
        seen = self._told()
        parts = [part for part in _by_place(self.power, seen) if part.size]
        if not (self.taken and self.weight and parts):
            return UNKNOWN
        degrees = self._degrees
        # Each by itself: between bins the middle of the sensor counts more than its edges, and
        # where the noise is larger there, all of them are higher.
        whites = [white_level(part, degrees) for part in parts]
        if not min(whites) > 0:
            return UNKNOWN
        top = self._top()
        if top is not None:
            bins = sum(part.size for part in parts) / len(parts)
            return score_of_log(log_chance_of(top.power / whites[0], bins, degrees)), 1.0
        least = min(
            log_chance(float(part.max()) / white, 1, part.size, degrees)
            for part, white in zip(parts, whites, strict=True)
        )
        return score_of_log(any_of(least, len(parts))), 1.0

    def _top(self) -> Top | None:
        """Return where the power at any frequency is largest; None: that is not known."""
        if self._highest is None and self._kept:
            fine = self._fine(self._told())
            if fine is not None:
                self._highest = highest(self._kept, fine, self.shape[1], self.step)
        return self._highest

    def moving(self) -> Moving | None:
        """Return the power itself; None where no frames were taken."""
        if not (self.taken and self.weight):
            return None
        self._moving = self._moving or Moving(self.power, self._degrees)
        return self._moving

    def odd_lags(self) -> dict[str, Number]:
        """Return correlations along lines of samples an odd number of pixels apart.

        On a mosaic these are of other colours, whose planes know nothing of one another; lags are
        in pixels of a plane, as theirs are. Nearest neighbours have numbers of their own. What
        rows, columns and frames have in common, of each colour, is no memory.
        """
        if self.step == 1 or not self.weight:
            return {}
        if not self.taken:
            return {name: UNKNOWN for axis in _PAIRED for _, name in self._odd(axis)}
        rows, columns = self.shape
        power = self.relative / self.seen
        held = np.zeros(power.shape, np.bool_)
        held[[0, rows // 2]] = True
        held[:, [0, columns // 2]] = True
        power = np.where(held, power[~held].mean(), power)
        covariance = np.fft.irfft2(without_lines(power, self.seen), s=self.shape)
        found: dict[str, Number] = {}
        for axis, line in (("rows", covariance[0]), ("columns", covariance[:, 0])):
            sd = float(np.sqrt(self.uneven[axis] / (rows * columns))) / self.seen
            for lag, name in self._odd(axis):
                found[name] = (float(line[lag] / line[0]), sd)
        return found

    def _odd(self, axis: str) -> list[tuple[int, str]]:
        """Return the odd lags along an axis, pixels of the mosaic, and the name of each."""
        size = self.shape[axis == "rows"]
        lags = range(3, min(2 * LAGS, size // 2 - 1) + 1, 2)
        return [(lag, f"line_correlation along {axis} {lag / self.step:g}") for lag in lags]

    @property
    def _degrees(self) -> int:
        """Independent frames that the sum is worth."""
        return max(round(self.weight**2 / self.squares), 1)

    def peak(self) -> Peak | None:
        """Return where the power is largest: cycles per pixel of a plane, power as one shows it."""
        fine = self._fine(looked_at(self.shape, self.step))
        if fine is None:
            return None
        rows, columns = self.shape
        y, x = (int(i) for i in np.unravel_index(int(fine.argmax()), fine.shape))
        top = self._top() if self._told()[y, x] else None
        if top is not None:
            along, across, power = top.down, top.across, top.power
        else:
            # At half a cycle per pixel both sides are alike: each is the other's conjugate.
            across = x / 2 + (parabola(np.pad(fine[y], 1), x + 1) / 2 if x < columns else 0.0)
            along = y / 2 + parabola(np.pad(fine[:, x], 1), y + 1) / 2
            power = float(fine[y, x])
        fx, fy = frequency(across, columns), frequency(along, rows)
        fy -= float(fy > 1 / 2)
        power = 1 + (power / self.weight - 1) / self.step**2
        return Peak(self.step * fx, self.step * fy, power)

    def _fine(self, seen: NDArray[np.bool_]) -> Array | None:
        """Return the power of halves of bins, noise between bins as loud as on them; None: none.

        0 where it is not looked for: (2 rows, columns + 2).
        """
        middles = [median(own) for own in self.power.reshape(4, -1)]
        if not self.weight or not min(middles) > 0:
            return None
        fine = np.zeros((2 * self.shape[0], 2 * self.power.shape[3]))
        for down in (0, 1):
            for right in (0, 1):
                own = self.power[down, right]
                fine[down::2, right::2] = own * (middles[0] / middles[2 * down + right])
        fine[~seen] = 0.0
        return fine

    def _told(self) -> NDArray[np.bool_]:
        """Return which half bins tell a line: not what alternates along both axes."""
        seen = looked_at(self.shape, self.step)
        rows, columns = self.shape
        if rows % 2 == 0 and columns % 2 == 0:  # has a number of its own
            seen[rows - 1 : rows + 2, columns - 1 : columns + 2] = False
        return seen


def _by_place(power: Array, seen: NDArray[np.bool_]) -> list[Array]:
    """Return the powers that are looked at, by where they lie in the bins."""
    return [power[down, right][seen[down::2, right::2]] for down in (0, 1) for right in (0, 1)]


def of_sensor(
    channels: Mapping[str, Channel], variance_dn2: Mapping[str, float]
) -> tuple[float, float]:
    """Return the variance of the pixels of all channels, DN^2: measured, and expected."""
    sizes = [c.mean_frame.size for c in channels.values()]
    own = [c.estimates["pixel_variance"].value for c in channels.values()]
    expected = [variance_dn2[name] for name in channels]
    first, second = (
        sum(v * n for v, n in zip(values, sizes, strict=True)) / sum(sizes)
        for values in (own, expected)
    )
    return first, second


def looked_at(shape: tuple[int, int], step: int) -> NDArray[np.bool_]:
    """Return which half bins (2 rows, columns + 2) of a sensor hold waves of their own.

    The axes hold what rows, columns and frames have in common, of each colour of a mosaic (`step`
    2): half a bin from them the same is seen.
    """
    rows, columns = shape
    found = np.ones((2 * rows, 2 * (columns // 2 + 1)), np.bool_)
    found[[0, 1, -1]] = False
    found[:, [0, 1]] = False
    found[:, columns + (columns + 1) % 2 :] = False  # beyond half a cycle per pixel
    if columns % 2 == 0:
        # At half a cycle each wave stands twice, as its own conjugate; on rows of bins only.
        found[1::2, columns] = False
        found[rows + 1 :, columns] = False
    if step == 2:
        found[rows - 1 : rows + 2] = False
        found[:, columns - 1 :] = False
    return found


def some(values: Array) -> Array:
    """Return values enough for a median, evenly from all."""
    flat = values.reshape(-1)
    return flat[:: max(flat.size // _SAMPLE, 1) | 1]


@kernel
def add_power(transform: NDArray[np.complexfloating], weight: float, power: Array) -> None:
    """Add the weighted power of bins, and of neighbours' differences: down, right, both."""
    rows, columns = transform.shape
    down, right, both = weight / 2, weight / 2, weight / 4
    lines = np.empty((6, columns))  # real and imaginary parts: of two rows, and their difference
    here, below, apart = lines[0:2], lines[2:4], lines[4:6]
    for x in range(columns):
        below[0, x], below[1, x] = transform[0, x].real, transform[0, x].imag
    for y in range(rows):
        here, below = below, here
        after = transform[(y + 1) % rows]
        for x in range(columns):
            below[0, x], below[1, x] = after[x].real, after[x].imag
        for x in range(columns):
            apart[0, x], apart[1, x] = here[0, x] - below[0, x], here[1, x] - below[1, x]
        _square(here[0], here[1], weight, power[0, 0, y])
        _square(apart[0], apart[1], down, power[1, 0, y])
        _square_next(here[0], here[1], right, power[0, 1, y])
        _square_next(apart[0], apart[1], both, power[1, 1, y])


@inlined
def _square(real: Array, imaginary: Array, weight: float, power: Array) -> None:
    for x in range(real.size):
        power[x] += weight * (real[x] * real[x] + imaginary[x] * imaginary[x])


@inlined
def _square_next(real: Array, imaginary: Array, weight: float, power: Array) -> None:
    """Add the weighted power of the differences of neighbours in a line."""
    for x in range(real.size - 1):
        re, im = real[x] - real[x + 1], imaginary[x] - imaginary[x + 1]
        power[x] += weight * (re * re + im * im)
