"""Fixed pattern of the sensor, pixel by pixel: sums over darks and flats in whole numbers."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from threading import Lock
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.photon_transfer.falloff import falloff
from analysis.photon_transfer.levels import FittedLevel
from analysis.photon_transfer.parts import LEAST_LINES, Noise, Pattern
from analysis.photon_transfer.recorded import Recorded, channel_names
from analysis.photon_transfer.statistics import LevelStatistics
from analysis.photon_transfer.sums import Ints
from dsis.simulate.maps import SensorMaps

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
        self.names: set[str] = set()
        self._lock = Lock()

    def add(self, exposure: Any, total: NDArray[np.integer]) -> None:
        """Add an exposure's sum over its frames, codes (row, column)."""
        with self._lock:
            kept = self._total.setdefault(str(exposure.kind), np.zeros(total.shape, np.int64))
            kept += total
            self.names.add(str(exposure.name))

    def without(self, recording: Recorded, names: set[str]) -> None:
        """Take exposures off again that turned out to be of no use; their frames are re-read."""
        for exposure in recording.exposures:
            if exposure.name in self.names & names:
                for frame in recording.frames(exposure):
                    self._total[str(exposure.kind)] -= frame
        self.names -= names

    def patterns(
        self, recording: Recorded, levels: Sequence[FittedLevel], dark_dn_per_s: float
    ) -> FixedPatterns:
        """Return the patterns of the frames summed so far.

        offset = mean dark less its channel's mean; gain = (mean flat - mean dark) over its
        channel's mean: every flat counts by its level and frames, nearly by 1 / variance under shot
        noise.
        """
        of_use = [level.statistics for level in levels if level.statistics.exposure in self.names]
        darks = _Stack.of([s for s in of_use if s.kind == "dark"])
        flats = _Stack.of([s for s in of_use if s.kind == "flat"])
        sites = _sites(recording)
        if darks is None:
            why = "no dark is of use in all channels"
            return FixedPatterns({}, {}, None, None, 0, why)
        lines = min(n // (1 + (len(sites) > 1)) for n in self._shape)
        if lines < LEAST_LINES:
            why = f"a channel has {lines} rows or columns, {LEAST_LINES} are needed"
            return FixedPatterns({}, {}, None, None, 0, why)
        dark = self._total["dark"] / darks.frames
        parts = {name: Pattern.of(dark[site], darks.noise[name]) for name, site in sites.items()}
        if flats is None or min(darks.frames, flats.frames) < LEAST_FRAMES:
            return FixedPatterns(parts, {}, None, None, 0)
        light = self._total["flat"] / flats.frames - dark
        light -= dark_dn_per_s * (flats.time_s - darks.time_s)
        mean = {name: float(light[site].mean()) for name, site in sites.items()}
        if not min(mean.values()) > 0:
            return FixedPatterns(parts, {}, None, None, 0)
        planes = {name: light[site] / mean[name] for name, site in sites.items()}
        gains = {
            name: Pattern.of(
                plane, flats.noise[name].plus(darks.noise[name]).times(mean[name] ** -2)
            )
            for name, plane in planes.items()
        }
        fall = falloff(
            [(planes[name], gains[name]) for name in sites], list(sites.values()), dark.shape
        )
        maps, dead = _maps(sites, parts, gains, dark.shape)
        return FixedPatterns(parts, gains, fall, maps, dead)

    @property
    def _shape(self) -> tuple[int, ...]:
        return next(iter(self._total.values())).shape


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


def _sites(recording: Recorded) -> dict[str, tuple[slice, slice]]:
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
