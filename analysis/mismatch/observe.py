"""One pass over the frames of a recording, or of a simulation of it: everything the bank needs."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from math import nan
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.bulk import Bulk
from analysis.mismatch.bank.coherent import SpectrumSums, half_bins
from analysis.mismatch.bank.common import common
from analysis.mismatch.bank.linemeans import AXES, Axis, LineMeans
from analysis.mismatch.bank.local import local_scalars, variances, widened
from analysis.mismatch.bank.motion import MotionSums, Shifts
from analysis.mismatch.bank.peaks import Peak
from analysis.mismatch.bank.sawtooth import Samples
from analysis.mismatch.bank.scalars import NAMES, UNKNOWN, Number, scalars
from analysis.mismatch.bank.surfaces import Leaning, leaning
from analysis.mismatch.layout import Layout, Place, Taken
from analysis.mismatch.overall import maps_of
from analysis.mismatch.scenes import Local
from analysis.mismatch.summed import ChannelSums, Looked, SensorSums, measure
from analysis.mismatch.touches import RECORDED, SPECTRA, SPIKES
from dsis.measures import Channel, Codes, Lattice, Measured, Middle
from dsis.recording.ahead import in_order

Array = NDArray[np.float64]

Frames = Callable[[str], Iterable[NDArray[np.generic]]]
Observing = Generator[None, None, "Observation"]
Watcher = Callable[[str, Measured], None]
Shown = tuple[Looked, Bulk | None]
"""What an exposure's frames show, and its noise without spikes where that is asked for."""
_Told = TypeVar("_Told")


@dataclass(frozen=True)
class Level:
    """Mean and pixel variance of one channel of one exposure.

    Attributes
    ----------
    level_dn, level_error_dn
        Above the nominal black, and its error from pixel noise alone.
    variance_dn2, dof
        Of a pixel over time, and its degrees of freedom.
    clipped_low, clipped_high
        Share of samples at the ends of the converter.
    pixels
        Pixels of the channel.
    bulk_dn2
        Its variance with single spikes left out.
    bulk_dof
        Degrees of freedom of that.
    far
        Share of differences of successive frames that were left out.
    """

    level_dn: float
    level_error_dn: float
    variance_dn2: float
    dof: float
    clipped_low: float
    clipped_high: float
    pixels: int
    bulk_dn2: float = nan
    bulk_dof: float = nan
    far: float = nan


@dataclass(frozen=True)
class Observation:
    """What one pass found.

    Attributes
    ----------
    levels
        By exposure and channel.
    scalars
        Transformed measures, by exposure and channel.
    maps
        Statistics of the maps over all exposures: by channel ("": what all have in common), map
        and name.
    pooled
        Statistics of spectra and persistent variances: by channel and name.
    peaks
        Where the spectra are largest: by channel and kind.
    images
        Kept on demand: maps of the fixed pattern (DN at the regressor's largest value, noise) by
        channel and name, and summed relative pixel variances under the name `variance`.
    common
        What the channels of a mosaic have in common, by exposure.
    local
        The same as `levels` of scenes: by exposure and channel, and in bins of signal.
    carried
        Kept on demand: samples and those read before, by axis, of each exposure.
    lines
        Kept on demand: rows and columns of uniform exposures.
    surfaces
        Kept on demand: how uniform exposures lean and bow, by exposure and channel.
    shifts
        Kept on demand: how far the frames of each scene lie from their mean.
    lattices
        Where the codes lie that occur, by exposure and channel, clipped ends left out.
    middles
        Kept on demand: codes in the middle of their histograms, by exposure and channel.
    gaps_dn
        Kept on demand: how far apart the codes lie that occur, by exposure and channel.
    """

    levels: Mapping[Place, Level]
    scalars: Mapping[Place, Mapping[str, Number]]
    maps: Mapping[tuple[str, str], Mapping[str, Number]]
    pooled: Mapping[str, Mapping[str, Number]]
    peaks: Mapping[tuple[str, str], Peak]
    images: Mapping[tuple[str, str], tuple[Array, float]] = field(default_factory=dict)
    common: Mapping[str, Mapping[str, Number]] = field(default_factory=dict)
    local: Mapping[Place, Level] = field(default_factory=dict)
    carried: Mapping[str, tuple[Samples, ...]] = field(default_factory=dict)
    lines: Mapping[tuple[str, Axis], LineMeans] = field(default_factory=dict)
    surfaces: Mapping[Place, Leaning] = field(default_factory=dict)
    shifts: Mapping[str, Shifts] = field(default_factory=dict)
    lattices: Mapping[Place, Lattice] = field(default_factory=dict)
    middles: Mapping[Place, Middle] = field(default_factory=dict)
    gaps_dn: Mapping[Place, float] = field(default_factory=dict)

    def level(self, place: Place) -> Level | None:
        """Return mean and variance at a place, of a scene or not; None: it is none."""
        return self.levels.get(place) or self.local.get(place)


@dataclass(frozen=True)
class Kept:
    """What is made of a recording beyond its numbers, and which of these.

    Attributes
    ----------
    images
        Whether to keep the maps, and of samples those before them.
    samples
        Whether to keep the latter, if anything.
    places
        Whether to look where spectra are largest: of simulations only numbers are asked for.
    made
        Those of `RECORDED` that are made: without one its numbers are unknown, all others the same.
    looked
        Looks at an exposure as it is told, or knows what that would show; None: looks.
    """

    images: bool = False
    samples: bool = True
    places: bool = True
    made: frozenset[str] = RECORDED
    looked: Callable[[Callable[[], Shown]], Shown] | None = None


def observe(
    layout: Layout,
    frames_of: Frames,
    watch: Watcher | None = None,
    *,
    keep: bool = False,
    samples: bool = True,
    places: bool = True,
    made: frozenset[str] = RECORDED,
    threads: int = 1,
) -> Observation:
    """Return the observation of a recording.

    Parameters
    ----------
    layout
        What to observe.
    frames_of
        Gives the frames (row, column) of an exposure, codes in DN, in the order of its numbers.
    watch
        Sees the measures of every exposure on their way.
    keep, samples, places, made
        See `Kept`.
    threads
        That look at exposures side by side, if `frames_of` may be asked so; the result is the same.
    """
    kept = Kept(keep, samples, places, made)
    return finished(observing(layout, frames_of, watch, kept, threads))


def finished(running: Observing) -> Observation:
    """Return the observation that `observing` ends with."""
    while True:
        try:
            next(running)
        except StopIteration as end:
            found: Observation = end.value
            return found


def observing(
    layout: Layout, frames_of: Frames, watch: Watcher | None, kept: Kept, threads: int = 1
) -> Observing:
    """Observe as `observe` does, and pause whenever an exposure of uniform light was looked at."""
    levels: dict[Place, Level] = {}
    found: dict[Place, Mapping[str, Number]] = {}
    lattices: dict[Place, Lattice] = {}
    middles: dict[Place, Middle] = {}
    gaps: dict[Place, float] = {}
    sums: dict[str, ChannelSums] = {}
    whole = SensorSums(layout, samples=kept.images and kept.samples, made=kept.made)
    lines: dict[tuple[str, Axis], LineMeans] = {}
    surfaces: dict[Place, Leaning] = {}

    def look(exposure: Taken) -> Shown:
        anew = partial(_shown, whole, exposure, frames_of)
        return anew() if kept.looked is None else kept.looked(anew)

    # What exposures show is summed in their order, whoever was first to look.
    for one, many in in_order(look, layout.uniform, threads if threads > 1 else 0):
        measured, frames = one.measured, one.frames
        still = {name for name in layout.channels if (one.exposure, name) in layout.still}
        whole.add(one, still=bool(still))
        lattices |= _of_codes(one.exposure, measured, lambda codes: codes.lattice)
        if kept.images:
            middles |= _of_codes(one.exposure, measured, lambda codes: codes.middle)
            gaps |= _of_codes(one.exposure, measured, lambda codes: codes.gap)
        if kept.images and not still:
            lines |= {(one.exposure, axis): whole.lines(one, axis) for axis in AXES}
        if watch is not None:
            watch(one.exposure, measured)
        fine = half_bins(list(measured.channels.values()), frames - 1)
        for own, (name, channel) in zip(fine, measured.channels.items(), strict=True):
            place = (one.exposure, name)
            levels[place] = _with_bulk(_level(channel, frames), name, many)
            if name not in sums:
                n, m = channel.mean_frame.shape
                sums[name] = ChannelSums(
                    layout.regressors(name), (n, m), waves=SPECTRA in kept.made
                )
            if name in still:
                found[place] = dict.fromkeys(NAMES, UNKNOWN)
                continue
            found[place] = scalars(channel, frames)
            variance, signal = layout.variance_dn2[place], layout.signal_dn[place]
            sums[name].add(one.exposure, channel, frames, variance, signal, own)
            if kept.images:
                surfaces[place] = leaning(channel, frames)
        yield
    local, shifts = _scenes(layout, frames_of, watch, found, whole.common, kept)
    maps, images, fixed = maps_of(layout, sums, whole.waves)
    pooled, peaks = _pooled(sums, whole, places=kept.places)
    return Observation(
        levels,
        found,
        maps,
        pooled,
        {**peaks, **fixed} if kept.places else {},
        images if kept.images else {},
        whole.common,
        local,
        whole.memory.samples,
        lines,
        surfaces,
        shifts,
        lattices,
        middles,
        gaps,
    )


def _shown(whole: SensorSums, exposure: Taken, frames_of: Frames) -> Shown:
    """Return what an exposure's frames show."""
    many = Bulk.of(whole.layout, exposure.name) if SPIKES in whole.made else None
    frames = frames_of(exposure.name)
    seen = frames if many is None else many.watching(frames)
    return whole.looked(exposure.name, len(exposure.numbers), seen), many


def _of_codes(
    exposure: str, measured: Measured, tell: Callable[[Codes], _Told | None]
) -> dict[Place, _Told]:
    """Return what the codes of each channel tell, where they do."""
    codes = {name: channel.codes for name, channel in measured.channels.items()}
    own = {(exposure, name): tell(one) for name, one in codes.items() if one is not None}
    return {place: told for place, told in own.items() if told is not None}


def _pooled(
    sums: Mapping[str, ChannelSums], whole: SensorSums, *, places: bool
) -> tuple[dict[str, Mapping[str, Number]], dict[tuple[str, str], Peak]]:
    """Return spectra and persistent variances, and where spectra are largest; "": a mosaic's."""
    spectra = {name: own.spectra for name, own in sums.items()}
    if len(spectra) > 1:  # what all channels of a mosaic show
        spectra[""] = SpectrumSums.merged(list(spectra.values()))
    persistent = {name: own.variances.numbers() for name, own in sums.items()}
    pooled = {name: {**persistent.get(name, {}), **own.numbers()} for name, own in spectra.items()}
    all_of_it = "" if whole.mosaic else whole.layout.channels[0]
    slow = spectra[all_of_it].slow_rows() if not whole.mosaic and all_of_it in spectra else {}
    pooled.setdefault(all_of_it, {}).update({**whole.numbers(), **slow})
    if not places:
        return dict(pooled), {}
    peaks = {(name, kind): peak for name, own in spectra.items() for kind, peak in own.peaks()}
    peaks |= {(all_of_it, kind): peak for kind, peak in whole.peaks().items()}
    return dict(pooled), peaks


def _scenes(
    layout: Layout,
    frames_of: Frames,
    watch: Watcher | None,
    found: dict[Place, Mapping[str, Number]],
    shared: dict[str, Mapping[str, Number]],
    kept: Kept,
) -> tuple[dict[Place, Level], dict[str, Shifts]]:
    """Add what scenes show to what was found; return their variances by signal, and movements.

    Movements are kept with images.
    """
    local: dict[Place, Level] = {}
    shifts: dict[str, Shifts] = {}
    for exposure in layout.pictures:
        scene = layout.scenes[exposure.name]
        motion = MotionSums(scene)
        seen = motion.watching(map(scene.steadied, frames_of(exposure.name)))
        measured = measure(layout, seen, made=kept.made)
        if watch is not None:
            watch(exposure.name, measured)
        frames, parts = len(exposure.numbers), scene.channels
        if len(measured.channels) > 1:
            signals = {name: layout.signal_dn[exposure.name, name] for name in measured.channels}
            alike = common(measured.channels, signals, frames, layout.sites)
            shared[exposure.name] = widened(alike, measured.channels, parts)
        shared[exposure.name] = {**shared.get(exposure.name, {}), **motion.numbers()}
        if kept.images:
            shifts[exposure.name] = motion.shifts()
        for name, channel in measured.channels.items():
            own = parts[name]
            found[exposure.name, name] = local_scalars(channel, frames, own)
            local[exposure.name, name] = _level(channel, frames)
            for label, level in _by_signal(channel, frames, own).items():
                local[exposure.name, f"{name} {label}"] = level
    return local, shifts


def _by_signal(channel: Channel, frames: int, own: Local) -> dict[str, Level]:
    """Return the variance in each bin of signal; its degrees of freedom allow for its range."""
    rows, columns = channel.mean_frame.shape
    share = (frames - 1) * (1 - 1 / rows) * (1 - 1 / columns)
    level, variance = own.by_range(channel.mean_frame), variances(channel, own)
    measured = own.by_range(channel.variance_map)
    found = {}
    for label, part in ((label, one.ranges) for label, one in own.bins.items()):
        mean, pixels = own.mean(variance, part), int(own.pixels[part].sum())
        uneven = own.mean(measured**2, part) / mean**2 if mean > 0 else 1.0
        at = own.mean(level, part)
        error = (max(mean, 0.0) / frames / pixels) ** 0.5
        found[label] = Level(at, error, mean, share * pixels / uneven, 0.0, 0.0, pixels)
    return found


def _with_bulk(level: Level, channel: str, many: Bulk | None) -> Level:
    """Return a level with its variance without single spikes, where that was asked for."""
    if many is None:
        return level
    return replace(
        level,
        bulk_dn2=many.variance_dn2(channel, level.variance_dn2),
        bulk_dof=many.dof(channel),
        far=many.far(channel),
    )


def _level(channel: Channel, frames: int) -> Level:
    rows, columns = channel.mean_frame.shape
    estimates = channel.estimates
    return Level(
        estimates["level"].value,
        estimates["level"].null_error,
        estimates["pixel_variance"].value,
        (frames - 1) * (rows - 1) * (columns - 1),
        channel.clipped_low,
        channel.clipped_high,
        rows * columns,
    )
