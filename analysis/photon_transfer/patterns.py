"""Fixed pattern of the sensor, pixel by pixel: sums over darks and flats in whole numbers."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from threading import Lock
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.photon_transfer.falloff import falloff
from analysis.photon_transfer.levels import FittedLevel
from analysis.photon_transfer.parts import LEAST_LINES, Noise, Pattern
from analysis.photon_transfer.recorded import Recorded, channel_names
from analysis.photon_transfer.statistics import LevelStatistics
from analysis.photon_transfer.sums import Floats, Ints
from dsis.effects import Image
from dsis.simulate.maps import SensorMaps

Sites = dict[str, tuple[slice, slice]]
LEAST_FRAMES = 4  # darks and flats each, below which a map would be noise
LEAST_GAIN = 1e-3  # maps hold gains above 0: a dead pixel's


@dataclass(frozen=True)
class FixedPatterns:
    """What darks and flats say of the sensor's fixed pattern.

    Attributes
    ----------
    dark, gain
        By channel: offsets (DN) and gains (relative to the channel's mean); empty where the
        recording does not tell.
    falloff
        Shading (share of the light lost in the corners) and its error; None where it is not seen.
    maps
        The best linear estimates, pixel by pixel; None with fewer than four darks or flats of use.
    dead
        Pixels with less than a thousandth of the mean gain.
    why
        Why `dark` is empty; empty where it is not.
    """

    dark: Mapping[str, Pattern]
    gain: Mapping[str, Pattern]
    falloff: tuple[float, float] | None
    maps: SensorMaps | None
    dead: int
    why: str = ""


class PatternSums:
    """Sums of all frames of a kind; threads may share it, for whole numbers know no order."""

    def __init__(self) -> None:
        self._total: dict[str, Ints] = {}
        self._timed: dict[str, Ints] = {}  # each times its exposure time in microseconds
        self.names: set[str] = set()
        self._lock = Lock()

    def add(self, exposure: Any, total: NDArray[np.integer]) -> None:
        """Add an exposure's sum over its frames, codes (row, column)."""
        with self._lock:
            kept = self._total.setdefault(str(exposure.kind), np.zeros(total.shape, np.int64))
            kept += total
            if str(exposure.kind) == "dark":
                timed = self._timed.setdefault("dark", np.zeros(total.shape, np.int64))
                timed += total.astype(np.int64) * _microseconds(exposure)
            self.names.add(str(exposure.name))

    def without(self, recording: Recorded, names: set[str]) -> None:
        """Take exposures off again that turned out to be of no use; their frames are re-read."""
        for exposure in recording.exposures:
            if exposure.name in self.names & names:
                for frame in recording.frames(exposure):
                    self._total[str(exposure.kind)] -= frame
                    if str(exposure.kind) == "dark":
                        self._timed["dark"] -= frame.astype(np.int64) * _microseconds(exposure)
        self.names -= names

    def patterns(
        self,
        recording: Recorded,
        levels: Sequence[FittedLevel],
        dark_dn_per_s: float,
        *,
        apart: bool = False,
    ) -> FixedPatterns:
        """Return the patterns of the frames summed so far.

        offset = mean dark less its channel's mean; gain = (mean flat - mean dark) over its
        channel's mean: every flat counts by its level and frames, nearly by 1 / variance under shot
        noise. Where dark currents are `apart`, each pixel's own line through the darks is taken in
        place of their mean: the offset is that of no exposure time, the flat's dark that of its.
        """
        of_darks = self._of_use(levels, "dark")
        darks = _Stack.of(of_darks)
        flats = _Stack.of(self._of_use(levels, "flat"))
        sites = _sites(recording)
        if darks is None:
            why = "no dark is of use in all channels"
            return FixedPatterns({}, {}, None, None, 0, why)
        lines = min(n // (1 + (len(sites) > 1)) for n in self._shape)
        if lines < LEAST_LINES:
            why = f"a channel has {lines} rows or columns, {LEAST_LINES} are needed"
            return FixedPatterns({}, {}, None, None, 0, why)
        dark = self._total["dark"] / darks.frames
        times = _Times.of(of_darks) if apart else None
        slope: Floats | float = dark_dn_per_s
        if times is not None:
            slope = self._slope(times)
            darks = replace(darks, time_s=0.0, noise=times.noise_at(0.0))
            dark -= slope * times.mean_s
        parts = {name: Pattern.of(dark[site], darks.noise[name]) for name, site in sites.items()}
        if flats is None or min(darks.frames, flats.frames) < LEAST_FRAMES:
            return FixedPatterns(parts, {}, None, None, 0)
        light = self._total["flat"] / flats.frames - dark
        light -= slope * (flats.time_s - darks.time_s)
        unlit = darks.noise if times is None else times.noise_at(flats.time_s)
        mean = {name: float(light[site].mean()) for name, site in sites.items()}
        if not min(mean.values()) > 0:
            return FixedPatterns(parts, {}, None, None, 0)
        planes = {name: light[site] / mean[name] for name, site in sites.items()}
        gains = {
            name: Pattern.of(plane, flats.noise[name].plus(unlit[name]).times(mean[name] ** -2))
            for name, plane in planes.items()
        }
        fall = falloff(
            [(planes[name], gains[name]) for name in sites], list(sites.values()), dark.shape
        )
        maps, dead = _maps(sites, parts, gains, dark.shape)
        if times is not None:
            maps = replace(maps, dark_current_dn_per_s=self._current_map(times, sites))
        return FixedPatterns(parts, gains, fall, maps, dead)

    def currents(self, recording: Recorded, levels: Sequence[FittedLevel]) -> "dict[str, Growth]":
        """Return by channel how fast each pixel's darks grow; empty: their times do not tell."""
        darks = _Times.of(self._of_use(levels, "dark"))
        if darks is None:
            return {}
        slope = self._slope(darks)
        return {
            name: Growth(slope[site], *darks.noise_of_slope(name))
            for name, site in _sites(recording).items()
        }

    def _current_map(self, darks: "_Times", sites: Sites) -> Image:
        """Return the best linear estimate of each pixel's dark current, DN/s, about its mean."""
        found = self._slope(darks)
        for name, site in sites.items():
            own, (noise, _) = found[site], darks.noise_of_slope(name)
            mean, variance = float(own.mean()), float(own.var())
            kept = max(1 - noise**2 / variance, 0.0) if variance > 0 else 0.0
            found[site] = np.maximum(mean + kept * (own - mean), 0.0)
        return found.astype(np.float32)

    def _of_use(self, levels: Sequence[FittedLevel], kind: str) -> list[LevelStatistics]:
        own = (level.statistics for level in levels if level.statistics.kind == kind)
        return [s for s in own if s.exposure in self.names]

    def _slope(self, darks: "_Times") -> Floats:
        return (self._timed["dark"] * 1e-6 - darks.mean_s * self._total["dark"]) / darks.square_s2

    @property
    def _shape(self) -> tuple[int, ...]:
        return next(iter(self._total.values())).shape


@dataclass(frozen=True)
class Growth:
    """How fast a channel's darks grow with exposure time.

    Attributes
    ----------
    dn_per_s
        Of each pixel, by least squares: (row, column).
    noise
        Of a pixel's, DN/s.
    shot
        The share of that noise's variance that has come with exposure time.
    """

    dn_per_s: Floats
    noise: float
    shot: float


@dataclass(frozen=True)
class _Times:
    """Darks of several exposure times, as straight lines through them weigh them.

    Attributes
    ----------
    darks
        Of each exposure and channel.
    frames, mean_s, square_s2
        Number of frames, their mean exposure time, its squared deviations summed.
    """

    darks: Sequence[LevelStatistics]
    frames: int
    mean_s: float
    square_s2: float

    @classmethod
    def of(cls, darks: Sequence[LevelStatistics]) -> "_Times | None":
        """Return the darks; None where all have the same exposure time."""
        each = {s.exposure: s for s in darks}.values()
        frames = sum(s.frames for s in each)
        if not frames or len({_seconds(s) for s in each}) < 2:
            return None
        mean = sum(s.frames * _seconds(s) for s in each) / frames
        square = sum(s.frames * (_seconds(s) - mean) ** 2 for s in each)
        return cls(darks, frames, mean, square)

    def noise_at(self, time_s: float) -> dict[str, Noise]:
        """Return the noise of each channel's lines at an exposure time."""
        found = {}
        for name in dict.fromkeys(s.channel for s in self.darks):
            own = [s for s in self.darks if s.channel == name]
            away = (time_s - self.mean_s) / self.square_s2
            weights = [
                s.frames * (1 / self.frames + away * (_seconds(s) - self.mean_s)) ** 2 for s in own
            ]
            row = sum(w * s.row_variance_dn2 for w, s in zip(weights, own, strict=True))
            column = sum(w * s.column_variance_dn2 for w, s in zip(weights, own, strict=True))
            all_of_it = [w * s.variance_dn2 for w, s in zip(weights, own, strict=True)]
            error = sum(v**2 / (s.frames - 1) for v, s in zip(all_of_it, own, strict=True))
            total = sum(all_of_it)
            found[name] = Noise(total - row - column, row, column, total**2 / error)
        return found

    def noise_of_slope(self, name: str) -> tuple[float, float]:
        """Return the noise of a pixel's slope, DN/s, and how much of its variance grows."""
        own = [s for s in self.darks if s.channel == name]
        weights = np.array([s.frames * (_seconds(s) - self.mean_s) ** 2 for s in own])
        pixel = np.array([s.variance_dn2 - s.row_variance_dn2 - s.column_variance_dn2 for s in own])
        total = float(weights @ np.maximum(pixel, 0.0))
        if total <= 0:
            return 0.0, 0.0
        shortest = own[int(np.argmin([s.exposure_time_s for s in own]))]
        rest = shortest.variance_dn2 - shortest.row_variance_dn2 - shortest.column_variance_dn2
        grown = float(weights @ np.maximum(pixel - rest, 0.0))
        return total**0.5 / self.square_s2, min(grown / total, 1.0)


def _seconds(own: LevelStatistics) -> float:
    """Return an exposure time as sums weigh it: in whole microseconds."""
    return _microseconds(own) * 1e-6


def _microseconds(exposure: Any) -> int:
    return round(float(exposure.exposure_time_s) * 1e6)


@dataclass(frozen=True)
class _Stack:
    """All frames of a kind: their number, mean exposure time, and noise of their mean."""

    frames: int
    time_s: float
    noise: Mapping[str, Noise]

    @classmethod
    def of(cls, found: Sequence[LevelStatistics]) -> "_Stack | None":
        if not found:
            return None
        exposures = {s.exposure: s for s in found}.values()
        frames = sum(s.frames for s in exposures)
        noise = {}
        for name in {s.channel for s in found}:
            own = [s for s in found if s.channel == name]
            row = sum(s.frames * s.row_variance_dn2 for s in own)
            column = sum(s.frames * s.column_variance_dn2 for s in own)
            pixel = sum(s.frames * s.variance_dn2 for s in own) - row - column
            error = sum((s.frames * s.variance_dn2) ** 2 / (s.frames - 1) for s in own)
            dof = (pixel + row + column) ** 2 / error
            noise[name] = Noise(pixel, row, column, dof).times(frames**-2)
        time_s = sum(s.frames * s.exposure_time_s for s in exposures) / frames
        return cls(frames, time_s, noise)


def _sites(recording: Recorded) -> Sites:
    """Return where each channel lies in a frame."""
    names = channel_names(recording.sensor.cfa)
    if names[0][0] == names[1][1]:
        return {names[0][0]: (slice(None), slice(None))}
    return {names[i][j]: (slice(i, None, 2), slice(j, None, 2)) for i in (0, 1) for j in (0, 1)}


def _maps(
    sites: Mapping[str, tuple[slice, slice]],
    dark: Mapping[str, Pattern],
    gain: Mapping[str, Pattern],
    shape: tuple[int, int],
) -> tuple[SensorMaps, int]:
    """Return the maps put together from their channels, and the number of dead pixels."""
    offsets, gains = np.empty(shape, np.float32), np.empty(shape, np.float32)
    for name, site in sites.items():
        offsets[site] = dark[name].estimate
        gains[site] = 1 + gain[name].estimate
    dead = int((gains < LEAST_GAIN).sum())
    left = [float(np.mean([p.left for p in by.values()])) for by in (dark, gain)]
    maps = SensorMaps(
        offsets,
        np.maximum(gains, np.float32(LEAST_GAIN)),
        float(np.sqrt(left[0])),
        float(np.sqrt(left[1])),
    )
    return maps, dead
