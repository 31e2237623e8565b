"""Sums over the frames and exposures of a recording, from which an observation follows."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from itertools import chain, islice

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.bands import Bands
from analysis.mismatch.bank.carryover import CarryOver, CarryOverSums
from analysis.mismatch.bank.codephase import KIND as CODE_PLACE
from analysis.mismatch.bank.codephase import LABEL as CODE_PHASE
from analysis.mismatch.bank.codephase import CodePhases
from analysis.mismatch.bank.coherent import SpectrumSums
from analysis.mismatch.bank.common import common
from analysis.mismatch.bank.linemeans import Axis, LineMeans, line_means
from analysis.mismatch.bank.maps import PatternSums, Regressors
from analysis.mismatch.bank.movingbands import KIND as MOVING_PLACE
from analysis.mismatch.bank.movingbands import LABEL as MOVING
from analysis.mismatch.bank.movingbands import MovingBands
from analysis.mismatch.bank.peaks import Peak
from analysis.mismatch.bank.periods import NUMBER, PLACE, Periods, PeriodSums
from analysis.mismatch.bank.persistent import VarianceSums
from analysis.mismatch.bank.scalars import Number
from analysis.mismatch.bank.waves import Waves, WaveSums, of_sensor
from analysis.mismatch.layout import MANY_PIXELS, Layout
from analysis.mismatch.touches import ALL_SUMS, CARRY_OVER, NEIGHBOURS, SPECTRA
from dsis.measures import Accumulator, Channel, Measured
from dsis.measures.accumulator import AT_ONCE, LAGS
from dsis.measures.plane import Transforms

_FEW_LAGS = 2  # of neighbours: the bank asks for no farther ones
_SMALL_PIXELS = 2**15  # of frames that are looked at together


def measure(
    layout: Layout,
    frames: Iterable[NDArray[np.generic]],
    spectra: Callable[[Transforms], None] | None = None,
    made: frozenset[str] = ALL_SUMS,
) -> Measured:
    """Return the measures of one exposure's frames; `spectra` as an `Accumulator` has it.

    `made` are those of `ALL_SUMS` that are.
    """
    size, codes = (layout.rows, layout.columns), (layout.black_dn, layout.white_dn)
    lags = _FEW_LAGS if layout.rows * layout.columns > MANY_PIXELS else LAGS
    sums = Accumulator(
        *size,
        layout.cfa,
        *codes,
        lags=lags,
        spectra=spectra,
        power=SPECTRA in made,
        neighbours=NEIGHBOURS in made,
    )
    pixels, left = layout.rows * layout.columns, iter(frames)
    first = list(islice(left, AT_ONCE // pixels + 1)) if pixels <= _SMALL_PIXELS else []
    if first and len(first) <= AT_ONCE // pixels:
        sums.add_all(first)
    else:
        for frame in chain(first, left):
            sums.add(frame)
    return sums.result()


@dataclass(frozen=True)
class Looked:
    """What the frames of one exposure show, before it is added to what others show.

    Attributes
    ----------
    exposure, frames
        Its name, and how many frames.
    measured
        The measures.
    lines, after, cells
        Waves of the whole sensor, samples by the code before, and patterns of few pixels.
    """

    exposure: str
    frames: int
    measured: Measured
    lines: Waves
    after: CarryOver
    cells: Periods


class ChannelSums:
    """Sums over exposures of one channel."""

    def __init__(self, regressors: Regressors, shape: tuple[int, int], *, waves: bool) -> None:
        self.patterns = PatternSums(regressors, shape)
        self.variances = VarianceSums(shape)
        self.spectra = SpectrumSums(shape, waves=waves)

    def add(
        self,
        exposure: str,
        channel: Channel,
        frames: int,
        variance_dn2: float,
        signal_dn: float,
        fine: NDArray[np.float64],
    ) -> None:
        """Take one exposure; the variance and signal that are expected weigh it.

        `fine` are the channel's `half_bins`.
        """
        pixel = channel.estimates["pixel_variance"].value
        self.patterns.add(exposure, channel.mean_frame, pixel, frames)
        self.variances.add(channel.variance_map, (frames - 1) / variance_dn2)
        self.spectra.add(channel, frames, variance_dn2, signal_dn, fine)


class SensorSums:
    """Sums over exposures of what all channels of the sensor show together."""

    def __init__(self, layout: Layout, *, samples: bool, made: frozenset[str]) -> None:
        self.layout, self.samples, self.made = layout, samples, made
        self.mosaic = len(layout.sites) > 1
        self.shape = (layout.rows, layout.columns)
        self.common: dict[str, Mapping[str, Number]] = {}
        self.bands = Bands(layout.rows, layout.sites)
        self.columns = Bands(layout.columns, layout.sites, "column")
        self.numbers_of = {e.name: e.numbers for e in layout.uniform}
        last = max((max(own, default=0) for own in self.numbers_of.values()), default=0)
        self.moving = MovingBands(layout.rows, layout.sites, last)
        self.waves = WaveSums(self.shape, 1 + self.mosaic, taken=SPECTRA in made)
        self.periods = PeriodSums(self.shape, 1 + self.mosaic)
        self.memory, self.codes = CarryOverSums(), CodePhases()

    def looked(self, exposure: str, frames: int, seen: Iterable[NDArray[np.generic]]) -> "Looked":
        """Return what an exposure's frames show; nothing is summed yet."""
        lines = Waves(self.shape, keep=self.layout.keeps_amplitudes)
        after, cells = CarryOver(keep=self.samples), Periods()
        if SPECTRA not in self.made:
            lines.frames = frames
        else:
            seen = cells.watching(lines.watching(seen) if self.mosaic else seen)
        watched = after.watching(seen) if CARRY_OVER in self.made else seen
        # The transforms of a sensor without colours are at hand.
        take = None if self.mosaic else lambda one: lines.take(one[0])
        found = measure(self.layout, watched, take, self.made)
        return Looked(exposure, frames, found, lines, after, cells)

    def add(self, one: "Looked", *, still: bool) -> None:
        """Take what moves in an exposure's frames, unless it is `still`."""
        self.memory.add(one.after, still=still)
        if still:
            return
        found = one.measured.channels
        places = {name: (one.exposure, name) for name in found}
        expected = {name: self.layout.variance_dn2[place] for name, place in places.items()}
        self.waves.add(one.lines, found, expected)
        self.periods.add(one.cells, *of_sensor(found, expected))
        signals = {name: self.layout.signal_dn[place] for name, place in places.items()}
        self.moving.add(found, expected, signals, self.numbers_of[one.exposure])
        self.codes.add(found)
        self.columns.add(found, expected, signals, one.frames)
        if self.mosaic:
            sites = self.layout.sites
            self.common[one.exposure] = common(found, signals, one.frames, sites)
            self.bands.add(found, expected, signals, one.frames)

    def lines(self, one: "Looked", axis: Axis) -> LineMeans:
        """Return the rows or columns of what was looked at."""
        return line_means(one.measured.channels, self.layout.sites, self.shape, one.frames, axis)

    def numbers(self) -> dict[str, Number]:
        """Return spectra and memories of the whole sensor."""
        own = {**(self.bands.numbers() if self.mosaic else {}), **self.columns.numbers()}
        waves = {"spectral_peak": self.waves.number(), **self.waves.odd_lags()}
        waves |= {NUMBER: self.periods.number(), MOVING: self.moving.number()}
        waves[CODE_PHASE] = self.codes.number()
        return {**own, **self.memory.numbers(), **waves}

    def peaks(self) -> dict[str, Peak]:
        """Return where its spectra are largest, by kind."""
        own = {**(self.bands.peaks() if self.mosaic else {}), **self.columns.peaks()}
        whole = {"spectrum": self.waves.peak(), PLACE: self.periods.peak()}
        whole |= {MOVING_PLACE: self.moving.peak(), CODE_PLACE: self.codes.peak()}
        return {**own, **{kind: peak for kind, peak in whole.items() if peak is not None}}
