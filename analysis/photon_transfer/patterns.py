"""Fixed pattern of the sensor, pixel by pixel: sums over darks and flats in whole numbers."""

from collections.abc import Sequence
from threading import Lock
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.photon_transfer.levels import FittedLevel
from analysis.photon_transfer.recorded import Recorded, channel_names
from analysis.photon_transfer.sums import Ints
from dsis.simulate.maps import SensorMaps

LEAST_FRAMES = 4  # darks and flats each, below which a map would be noise
LEAST_GAIN = 1e-3  # a dead pixel's: maps hold gains above 0


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

    def maps(
        self, recording: Recorded, levels: Sequence[FittedLevel], dark_dn_per_s: float
    ) -> SensorMaps | None:
        """Return the maps; None with fewer than four darks or flats of use.

        offset = mean dark less its colour's mean; gain = (mean flat - mean dark) over its colour's
        mean: every flat counts by its level and frames, nearly by 1 / variance under shot noise.
        """
        of_use = [level.statistics for level in levels if level.statistics.exposure in self.names]
        names = channel_names(recording.sensor.cfa)
        frames, time_s, noise = {}, {}, {}
        for kind in ("dark", "flat"):
            own = [s for s in of_use if s.kind == kind]
            exposures = {s.exposure: s for s in own}.values()
            frames[kind] = sum(s.frames for s in exposures)
            if frames[kind] < LEAST_FRAMES:
                return None
            time_s[kind] = sum(s.frames * s.exposure_time_s for s in exposures) / frames[kind]
            channels = len({s.channel for s in own})
            # Of a mean over frames[kind] frames, the channels' mean square.
            noise[kind] = sum(s.frames * s.variance_dn2 for s in own) / channels / frames[kind] ** 2
        dark = self._total["dark"] / frames["dark"]
        light = self._total["flat"] / frames["flat"] - dark
        light -= dark_dn_per_s * (time_s["flat"] - time_s["dark"])
        signal = float(light.mean())
        for name in dict.fromkeys(np.ravel(names).tolist()):
            site = np.tile(np.array(names) == name, [-(-n // 2) for n in dark.shape])
            own_pixels = site[: dark.shape[0], : dark.shape[1]]
            dark[own_pixels] -= dark[own_pixels].mean()
            level = light[own_pixels].mean()
            if not level > 0:
                return None
            light[own_pixels] /= level
        return SensorMaps(
            dark.astype(np.float32),
            np.maximum(light, LEAST_GAIN).astype(np.float32),
            float(np.sqrt(noise["dark"])),
            float(np.sqrt(noise["dark"] + noise["flat"]) / signal),
        )
