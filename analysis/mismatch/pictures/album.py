"""What pictures need of every exposure, kept on the way in bounded memory."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.coherent import SpectrumSums
from analysis.mismatch.layout import Layout, Place
from dsis.measures import Channel, Measured

Array = NDArray[np.float64]
_AROUND = 96  # codes kept on either side of the median


@dataclass(frozen=True, eq=False)
class Lines:
    """Temporal power of row means and of column means, white noise at 1; frames it is worth."""

    rows: Array
    columns: Array
    degrees: float


@dataclass(frozen=True, eq=False)
class Counts:
    """Counts of codes from `lowest` on, those around the median."""

    lowest: int
    counts: Array

    def at(self, lowest: int, size: int) -> Array:
        """Return the counts of `size` codes from another `lowest` on, 0 where none was kept."""
        found = np.zeros(size)
        first, last = max(lowest, self.lowest), min(lowest + size, self.lowest + self.counts.size)
        if last > first:
            found[first - lowest : last - lowest] = self.counts[
                first - self.lowest : last - self.lowest
            ]
        return found


@dataclass
class Album:
    """A watcher of `observe`: spectra summed over exposures, line spectra, frame means, codes.

    Attributes
    ----------
    layout
        What is observed.
    spectra
        Sums over all exposures, by channel.
    lines, means, codes
        By exposure and channel.
    """

    layout: Layout
    spectra: dict[str, SpectrumSums] = field(default_factory=dict)
    lines: dict[Place, Lines] = field(default_factory=dict)
    means: dict[Place, Array] = field(default_factory=dict)
    codes: dict[Place, Counts] = field(default_factory=dict)

    def __call__(self, exposure: str, measured: Measured) -> None:
        """Keep what pictures need of the measures of one exposure."""
        for name, channel in measured.channels.items():
            self._keep((exposure, name), channel, measured.frames)

    def _keep(self, place: Place, channel: Channel, frames: int) -> None:
        rows, columns = channel.mean_frame.shape
        pixel = channel.estimates["pixel_variance"].value
        sums = self.spectra.setdefault(place[1], SpectrumSums((rows, columns)))
        if place[0] not in self.layout.scenes:
            sums.add(channel, frames, self.layout.variance_dn2[place], self.layout.signal_dn[place])
        self.means[place] = channel.frame_means
        if pixel > 0:
            self.lines[place] = Lines(
                channel.row_spectrum / pixel, channel.column_spectrum / pixel, frames - 1
            )
        if channel.codes is not None:
            counts = channel.codes.counts
            median = int(np.searchsorted(np.cumsum(counts), counts.sum() / 2))
            first = max(median - _AROUND, 0)
            kept = counts[first : median + _AROUND + 1].astype(np.float64)
            self.codes[place] = Counts(channel.codes.lowest + first, kept)


def wander_dn(albums: Sequence[Album], place: Place) -> float | None:
    """Return the standard deviation of frame means, DN; None: too few frames."""
    means = [album.means[place] for album in albums]
    if not means or means[0].size < 2:
        return None
    return float(np.sqrt(np.mean([m.var(ddof=1) for m in means])))
