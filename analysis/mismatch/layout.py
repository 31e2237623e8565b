"""What of a recording is observed: exposures, frames, expected signals and variances."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache, cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.maps import Regressors
from analysis.mismatch.scenes import SCENE, Local, Scene
from dsis.cfa import Cfa, pattern
from dsis.effects import Image
from dsis.grid import PixelGrid

_grid = lru_cache(maxsize=8)(PixelGrid)  # fields are found sooner by the very same grid
_LARGE = 2.5e7  # samples
_FEW_LINES = 16
MANY_PIXELS = 2e5  # of a frame, of which more than neighbours would take long
_OF_FULL = 1e-9  # of the weight of a flat whose pixels are full: it says nothing of gains
Place = tuple[str, str]
"""Exposure and channel; of a scene also channel and bin of signal."""


@dataclass(frozen=True)
class Taken:
    """One exposure as the bank takes it.

    Attributes
    ----------
    name, kind
        Of the exposure.
    exposure_time_s
        Exposure time, s.
    light
        Light per frame; None: unknown.
    numbers
        Numbers of the frames that are used, from 0.
    """

    name: str
    kind: str
    exposure_time_s: float
    light: float | None
    numbers: tuple[int, ...]


@dataclass(frozen=True)
class Layout:
    """What is observed, and how sums over exposures are weighted.

    Attributes
    ----------
    exposures
        In the order of the recording.
    rows, columns, cfa
        Of the frames.
    black_dn, white_dn
        Nominal black level and largest code: levels are counted from this black.
    signal_dn, variance_dn2
        Expected by the re-calibrated model, by exposure and channel: weights only.
    scenes
        Static scenes among the exposures; their signals and variances are as recorded.
    moving
        Exposures of kind scene that are left out, for the picture moves between frames.
    still
        Where codes move too seldom for noise to be judged: only levels are.
    full
        Where noise is far less than in flats of less light: pixels are full, and their gains do
        not show.
    unseen
        Rows and columns of the frames beyond the last ones that are looked at.
    left_out
        Why an exposure is, by its name; scenes that move have a list of their own.
    """

    exposures: tuple[Taken, ...]
    rows: int
    columns: int
    cfa: Cfa
    black_dn: float
    white_dn: float
    signal_dn: Mapping[Place, float]
    variance_dn2: Mapping[Place, float]
    scenes: Mapping[str, Scene] = field(default_factory=dict)
    moving: tuple[str, ...] = ()
    still: frozenset[Place] = frozenset()
    full: frozenset[Place] = frozenset()
    unseen: tuple[int, int] = (0, 0)
    left_out: Mapping[str, str] = field(default_factory=dict)

    @property
    def grid(self) -> PixelGrid:
        """The whole frames, with what is not looked at: charge crosses the edge of that."""
        return _grid(self.rows + self.unseen[0], self.columns + self.unseen[1], self.cfa)

    def seen(self, frame: Image) -> Image:
        """Return what is looked at of a whole frame (row, column)."""
        return np.ascontiguousarray(frame[: self.rows, : self.columns])

    def seen_cycles(self, cycles_per_frame: float) -> float:
        """Return cycles in the rows that are looked at of cycles in those of a whole frame."""
        return cycles_per_frame * self.rows / (self.rows + self.unseen[0])

    @property
    def samples(self) -> int:
        """How many there are, of all frames."""
        return sum(len(e.numbers) for e in self.exposures) * self.rows * self.columns

    @property
    def large(self) -> bool:
        """Whether there are so many samples that few simulations must do, and tell enough."""
        return self.samples > _LARGE

    @property
    def keeps_amplitudes(self) -> bool:
        """Whether amplitudes of all frames are kept, 4 bytes a sample: of few, of many bins."""
        rows, columns = self.rows, self.columns
        return min(rows, columns) >= _FEW_LINES and rows * columns <= MANY_PIXELS and not self.large

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the channels."""
        return ("MONO",) if self.cfa is Cfa.MONO else ("R", "Gr", "Gb", "B")

    @property
    def sites(self) -> dict[str, tuple[int, int]]:
        """First row and column of each channel."""
        return sites(self.cfa)

    def from_edge(self, channel: str, edge: str) -> NDArray[np.float64]:
        """Return how far a channel's lines are from an edge, pixels: (line,), the first one first.

        `edge` is "left", "right", "top" or "bottom".
        """
        axis = int(edge in ("left", "right"))
        size = (self.rows, self.columns)[axis]
        line = np.arange(self.sites[channel][axis], size, 1 + (len(self.sites) > 1))
        last = size + self.unseen[axis] - 1
        distance = line if edge in ("left", "top") else last - line
        return distance.astype(np.float64)

    @property
    def uniform(self) -> tuple[Taken, ...]:
        """Darks and flats."""
        return tuple(e for e in self.exposures if e.kind != SCENE)

    @property
    def pictures(self) -> tuple[Taken, ...]:
        """Static scenes."""
        return tuple(e for e in self.exposures if e.name in self.scenes)

    def part(self, place: Place) -> tuple[Local, slice]:
        """Return the pixels of a place of a scene: a channel's, and those of a bin of signal."""
        channel, _, label = place[1].partition(" ")
        local = self.scenes[place[0]].channels[channel]
        return local, local.bins[label].ranges if label else slice(None)

    def range_dn(self, place: Place) -> tuple[float, float]:
        """Return the lowest and the highest signal of a place of a scene from 0 on, DN above black.

        A place of all channels together has those of all its channels.
        """
        channels = self.scenes[place[0]].channels
        name, _, label = place[1].partition(" ")
        parts = [channels[name]] if name in channels else channels.values()
        own = [bin_ for part in parts for key, bin_ in part.bins.items() if label in ("", key)]
        return max(min(b.low_dn for b in own), 0.0), max(b.high_dn for b in own)

    def regressors(self, channel: str) -> Regressors:
        """Return what the mean frames of a channel are regressed on."""
        if channel not in self._regressors:
            self._regressors[channel] = self._regressors_of(channel)
        return self._regressors[channel]

    @cached_property
    def _regressors(self) -> dict[str, Regressors]:
        """Those that were asked for: every simulation asks again."""
        return {}

    def _regressors_of(self, channel: str) -> Regressors:
        names = [e.name for e in self.uniform if (e.name, channel) not in self.still]
        return Regressors.of(
            names,
            {name: self.signal_dn[name, channel] for name in names},
            {e.name: e.exposure_time_s for e in self.uniform},
            {e.name: self._weight(e, channel) for e in self.uniform},
        )

    def _weight(self, exposure: Taken, channel: str) -> float:
        """Return the inverse variance of a pixel of a mean frame, DN^-2."""
        place = exposure.name, channel
        worth = _OF_FULL if place in self.full else 1.0
        return worth * len(exposure.numbers) / self.variance_dn2[place]


def sites(cfa: Cfa) -> dict[str, tuple[int, int]]:
    """Return the first row and column of each channel, in the order R, Gr, Gb, B."""
    return dict(_sites(cfa))


@cache
def _sites(cfa: Cfa) -> dict[str, tuple[int, int]]:
    if cfa is Cfa.MONO:
        return {"MONO": (0, 0)}
    colours = pattern(cfa)
    found = {}
    for y in (0, 1):
        for x in (0, 1):
            name = "RGB"[colours[y, x]]
            if name == "G":
                name += "r" if 0 in colours[y] else "b"
            found[name] = (y, x)
    return {name: found[name] for name in ("R", "Gr", "Gb", "B")}
