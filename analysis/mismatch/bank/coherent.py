"""What a channel shows over all exposures: spectra, lines of them, and lags along lines."""

from collections.abc import Sequence
from functools import cache, cached_property
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.linelags import line_lags
from analysis.mismatch.bank.lines import (
    clearest_bin,
    log_chance,
    of_colour,
    separate,
    without_lines,
)
from analysis.mismatch.bank.peaks import (
    LEAST_BINS,
    Peak,
    frequency,
    largest,
    largest_line,
    line_top,
    summed,
    white_level,
    within_bin,
)
from analysis.mismatch.bank.scalars import (
    UNKNOWN,
    Number,
    ratio_root,
    score_of_log,
)
from dsis.compiled import kernel
from dsis.measures import Channel

Array = NDArray[np.float64]
_ALONE = 2.0  # times as high a bin elsewhere is the peak, whatever a block sums up to
LAGS = 16  # along a line, pixels of the plane
RANKS = (2, 3, 4)  # of lines beside the strongest
PATCHES = (4, 8, 16)  # pixels of the plane, that share noise
_KEYS = ("", "signal")


ALTERNATING = "line_alternation"
_LEAST_LINES = 8


class SpectrumSums:
    """Temporal power over all exposures, white noise scaled to 1.

    Three weightings: amplitudes constant in DN, in proportion to the signal (of lines), and in
    proportion to the noise (for correlations).

    Parameters
    ----------
    shape
        Rows and columns of the channel.
    waves
        Whether frames have spectra; else there are only those of row and column means.
    """

    def __init__(self, shape: tuple[int, int], *, waves: bool = True) -> None:
        self.shape, self.waves = shape, waves
        n, m = shape
        self.power, self.relative = np.zeros((2, n, m // 2 + 1))
        self.rows = dict(zip(_KEYS, np.zeros((2, n // 2 + 1)), strict=True))
        self.columns = np.zeros(m // 2 + 1)
        # Of row means, on half bins: a sinusoid loses a fifth at most between two of them.
        self.fine = dict(zip(_KEYS, np.zeros((2, n + 1)), strict=True))
        self.seen = 0
        self.weight = {key: [0.0, 0.0] for key in _KEYS}

    def add(
        self,
        channel: Channel,
        frames: int,
        variance_dn2: float,
        signal_dn: float,
        fine: Array | None = None,
    ) -> None:
        """Take the spectra of one exposure; `fine` are its `half_bins`, if they are at hand."""
        pixel = channel.estimates["pixel_variance"].value
        if not pixel > 0:
            return
        seen = frames - 1
        weights = {"": seen / variance_dn2, "signal": seen * max(signal_dn, 0) ** 2 / variance_dn2}
        if self.waves:
            _add(self.power, weights[""], channel.power_spectrum, pixel)
            _add(self.relative, float(seen), channel.power_spectrum, pixel)
        self.seen += seen
        _add_line(self.columns, weights[""], channel.column_spectrum, pixel)
        if fine is None:
            fine = half_bins([channel], seen)[0]
        for key, weight in weights.items():
            _add_line(self.rows[key], weight, channel.row_spectrum, pixel)
            _add_line(self.fine[key], weight, fine, pixel)
            self.weight[key][0] += weight
            self.weight[key][1] += weight**2 / seen

    @classmethod
    def merged(cls, parts: Sequence["SpectrumSums"]) -> "SpectrumSums":
        """Return the sums of channels together: white noise of each is independent."""
        found = cls(parts[0].shape, waves=all(part.waves for part in parts))
        for part in parts:
            found.power += part.power
            found.relative += part.relative
            found.seen += part.seen
            found.columns += part.columns
            for key in found.rows:
                found.rows[key] += part.rows[key]
                found.fine[key] += part.fine[key]
                found.weight[key][0] += part.weight[key][0]
                found.weight[key][1] += part.weight[key][1]
        return found

    def degrees(self, key: str) -> float:
        """Return how many independent frames the mean is worth."""
        total, squares = self.weight[key]
        return total**2 / squares if squares else 0.0

    def numbers(self) -> dict[str, Number]:
        """Return peaks and lags."""
        found: dict[str, Number] = {}
        n, m = self.shape
        if self.weight[""][0]:
            degrees = max(round(self.degrees("")), 1)
            # The axes hold what rows, columns and frames have in common.
            edge = self.power[1 : (n + 1) // 2, m // 2 :] if m % 2 == 0 else None
            inner = self.power[1:, 1 : (m + 1) // 2]
            found["spectral_peak"] = largest(inner, degrees, edge)
            found |= self._further(degrees)
            columns = _line(self.columns, m)
            found["column_spectrum_peak"] = largest(columns, degrees)
            found["column_spectrum_peak of colour"] = of_colour(columns[0], degrees)
            found |= self._lags()
            found |= self._corners(degrees)
            found |= self._edges(degrees)
            found |= self._patches(degrees)
        for key, label in (("", "row_spectrum_peak"), ("signal", "row_spectrum_peak of light")):
            total = self.weight[key][0]
            if total:
                found[label] = largest_line(self.fine[key] / total, self.degrees(key))
        return found

    def peak(self) -> Peak | None:
        """Return where the spectrum off the axes is largest, between bins; None without noise."""
        if not self.weight[""][0]:
            return None
        power = self.power / self.weight[""][0]
        inner = power[1:, 1:]
        sums = summed(inner, (2, 2))
        y, x = np.unravel_index(int(sums.argmax()), sums.shape)
        block = inner[y : y + 2, x : x + 2]
        if inner.max() > _ALONE * block.max():
            y, x = np.unravel_index(int(inner.argmax()), inner.shape)
        else:
            down, across = np.unravel_index(int(block.argmax()), block.shape)
            y, x = y + down, x + across
        return self._at(power, int(y) + 1, int(x) + 1)

    def _at(self, power: Array, y: int, x: int) -> Peak:
        """Return the line about a bin off the axes, between bins."""
        n, m = self.shape
        inner = power[1:, 1:]
        fx = frequency(x + within_bin(inner[y - 1], x - 1), m)
        fy = frequency(y + within_bin(inner[:, x - 1], y - 1), n)
        fy -= float(fy > 1 / 2)
        return Peak(float(fx), float(fy), float(power[y, x]))

    def peaks(self) -> list[tuple[str, Peak]]:
        """Return where the spectra are largest, and separate lines by their rank."""
        found = (
            ("spectrum", self.peak()),
            ("rows", self.row_peak("")),
            ("rows of light", self.row_peak("signal")),
            ("columns", self.column_peak()),
            *((line_name(rank), peak) for rank, peak in enumerate(self.lines(), 1)),
        )
        return [(kind, peak) for kind, peak in found if peak is not None]

    def lines(self) -> list[Peak]:
        """Return the highest separate lines off the axes, checkerboards too."""
        power = self.power / (self.weight[""][0] or 1.0)
        return [self._at(power, y, x) for y, x, _ in self._separate]

    @cached_property
    def _separate(self) -> list[tuple[int, int, float]]:
        """Places and heights of the highest separate lines, when all exposures are in."""
        white = self._white()
        if not white > 0:
            return []
        return separate(self.power, self.shape[1], white, RANKS[-1] + 1)

    def _white(self) -> float:
        """Return the power of a bin of white noise: from the median, that lines do not raise."""
        return white_level(self.power[1:, 1:], max(round(self.degrees("")), 1))

    def slow_rows(self) -> dict[str, Number]:
        """Return the slow waves of row means, and how alike neighbours are."""
        total = self.weight[""][0]
        if not total:
            return {}
        power, degrees = self.fine[""] / total, self.degrees("")
        return {"slow_row_variance": slow_lines(power, degrees), **line_lags(power, degrees, "row")}

    def column_peak(self) -> Peak | None:
        """Return where the spectrum of column means is largest, between bins."""
        total, m = self.weight[""][0], self.shape[1]
        if not total or m < 4:
            return None
        across, power = clearest_line(_line(self.columns, m)[0] / total, self.degrees(""))
        return Peak(frequency(across, m), 0.0, power)

    def row_peak(self, key: str) -> Peak | None:
        """Return where the spectrum of row means is largest."""
        if not self.weight[key][0]:
            return None
        cycles, off, power = line_top(self.fine[key] / self.weight[key][0])
        return Peak(0.0, cycles / self.shape[0], power, off)

    def _further(self, degrees: int) -> dict[str, Number]:
        """Return the normal scores of the lines beside the highest, corners left out."""
        n, m = self.shape
        bins = (n - 1) * (m // 2)
        # What alternates along both axes is real: it has a number of its own.
        heights = [h for y, x, h in self._separate if (2 * y, 2 * x) != (n, m)]
        found: dict[str, Number] = {}
        for rank in RANKS:
            label = f"spectral_peak of {_rank(rank)}"
            found[label] = UNKNOWN
            if rank <= len(heights) and bins >= LEAST_BINS:
                chance = log_chance(heights[rank - 1], rank, bins, degrees)
                found[label] = (score_of_log(chance), 1.0)
        return found

    def _corners(self, degrees: int) -> dict[str, Number]:
        """Return the power of what alternates from pixel to pixel: real, one square a frame."""
        n, m = self.shape
        found: dict[str, Number] = {}
        if n % 2 or m % 2:
            return found
        total = self.weight[""][0]
        for name, power in (
            ("checkerboard", self.power[n // 2, m // 2]),
            ("rows", self.rows[""][n // 2]),
            ("columns", self.columns[m // 2]),
        ):
            found[f"alternation_variance of {name}"] = ratio_root(float(power) / total, degrees)
        if not self.waves:
            found["alternation_variance of checkerboard"] = UNKNOWN
        return found

    def _edges(self, degrees: int) -> dict[str, Number]:
        """Return the power of lines that alternate along themselves, each by as much as it likes.

        Even and odd columns that are read by two chains, each of which has a noise of its own in
        every row, say. What all of them share, and what alternates along both axes, is left out.
        """
        n, m = self.shape
        found: dict[str, Number] = {}
        for axis, (size, other) in (("rows", (n, m)), ("columns", (m, n))):
            label = f"{ALTERNATING} of {axis}"
            found[label] = UNKNOWN
            if other % 2 or size < _LEAST_LINES or not self.waves:
                continue
            if axis == "rows":
                power = np.delete(self.power[:, m // 2], [0, n // 2] if n % 2 == 0 else [0])
                waves = power.size  # each of them twice, as a bin and its conjugate
            else:
                power = self.power[n // 2, 1 : (m + 1) // 2]
                waves = 2 * power.size
            mean = float(power.mean()) / self.weight[""][0]
            found[label] = ratio_root(mean, degrees * waves)
        return found

    def _patches(self, degrees: int) -> dict[str, Number]:
        """Return the power of waves longer than two patches, of what neighbours have in common.

        Off the axes, which hold what rows, columns and frames have in common.
        """
        n, m = self.shape
        found: dict[str, Number] = {}
        for size in PATCHES:
            down, across = n // (2 * size), m // (2 * size)
            label = f"patch_variance of {size} pixels"
            found[label] = UNKNOWN
            if not self.waves or min(down, across) < 1:
                continue
            inner = np.concatenate([self.power[1 : down + 1], self.power[n - down :]])
            inner = np.ascontiguousarray(inner[:, 1 : across + 1])
            ratio = float(inner.sum()) / inner.size / self.weight[""][0]
            found[label] = ratio_root(ratio, 2 * degrees * inner.size)
        return found

    def _lags(self) -> dict[str, Number]:
        """Return correlations along lines: of a memory, alike at all signals.

        A memory's spectrum is smooth: sinusoids, which correlate at their period, are taken out,
        and so is what whole columns have in common. What rows have stays: it is much of the power
        of 1/f noise, whose samples are alike along rows.
        """
        n, m = self.shape
        names = {axis: _lag_names(axis, size) for axis, size in (("rows", m), ("columns", n))}
        if not self.waves:
            return {name: UNKNOWN for own in names.values() for name in own}
        inner = without_lines(_without_columns(self.relative), self.seen)
        covariance = np.fft.irfft2(inner, s=(n, m))
        sd = 1 / sqrt(n * m * self.seen)
        found: dict[str, Number] = {}
        for axis, line in (("rows", covariance[0]), ("columns", covariance[:, 0])):
            own = names[axis]
            values = (line[1 : len(own) + 1] / line[0]).tolist()
            found |= {name: (value, sd) for name, value in zip(own, values, strict=True)}
        return found


def _without_columns(power: Array) -> Array:
    """Return a spectrum without what whole columns have in common: as it is in the bins beside."""
    found = power.copy()
    if len(power) > 2:
        found[0] = (power[1] + power[-1]) / 2
    return found


@cache
def _lag_names(axis: str, size: int) -> tuple[str, ...]:
    """Return the names of the lags, from 1 on, along lines of so many pixels."""
    most = min(LAGS, size // 2 - 1)
    return tuple(f"line_correlation along {axis} {lag}" for lag in range(1, most + 1))


def line_name(rank: int) -> str:
    """Return under which name the place of a line is kept."""
    return f"spectrum, {_rank(rank)}"


def _rank(rank: int) -> str:
    return f"rank {rank}"


def _line(power: Array, samples: int) -> Array:
    """Return the bins of the spectrum of a line of samples that are complex, as (1, bin).

    The last one is real where their number is even.
    """
    return power[np.newaxis, 1 : (samples + 1) // 2]


def half_bins(channels: Sequence[Channel], seen: int) -> list[Array]:
    """Return the temporal power of row means as `row_spectrum`, at half bins too: (rows + 1,).

    That of each channel; those of one shape are transformed in one call.
    """
    if len({channel.mean_frame.shape for channel in channels}) > 1:
        return [half_bins([channel], seen)[0] for channel in channels]
    lines, across = channels[0].mean_frame.shape
    moving = np.array([channel.moving_rows for channel in channels])
    power = np.abs(np.fft.rfft(moving, 2 * lines, axis=2)) ** 2
    return list(power.sum(1) * (across / lines / max(seen, 1)))


@kernel
def _add(into: Array, weight: float, power: NDArray[np.floating], pixel: float) -> None:
    """Add a weighted spectrum in units of the variance of pixels: (row, bin)."""
    for y in range(into.shape[0]):
        _add_line(into[y], weight, power[y], pixel)


@kernel
def _add_line(into: Array, weight: float, power: NDArray[np.floating], pixel: float) -> None:
    """Add the same of a line: (bin,); shares are as exact as the spectrum is."""
    own, white = power.dtype.type(weight), power.dtype.type(pixel)
    for x in range(into.size):
        into[x] += own * power[x] / white


def clearest_line(power: Array, degrees: float) -> tuple[float, float]:
    """Return cycles a frame of what stands out most of a spectrum of lines, and its power.

    Of the bins of one cycle on: (bin,), white noise scaled to 1.
    """
    place = clearest_bin(power, degrees)
    return place + 1 + within_bin(power, place), float(power[place])


def slow_lines(power: Array, degrees: float) -> Number:
    """Return the cube root of the power of waves down the frame, one of k cycles by 1 / k.

    So pink noise is seen best: in white noise the mean of the bins is 1.
    """
    whole = power[2:-1:2]
    if not whole.size:
        return UNKNOWN
    weights = 1 / np.arange(1, whole.size + 1)
    ratio = float(weights @ whole) / weights.sum()
    return ratio_root(ratio, 2 * degrees * weights.sum() ** 2 / (weights @ weights))
