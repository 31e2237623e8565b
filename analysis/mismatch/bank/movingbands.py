"""Bands of light that move on steadily: the spectrum of rows over rows and frames.

A lamp and a shutter that keep their rates move bands by the same part of a cycle from frame to
frame. Frames then add by amplitude: their power at a place and an advance, beside the noise of one,
is as many times that of a single frame as there are frames, where powers of frames, whatever their
phases, add to a mean that stands out less of its own scatter.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.bands import matched
from analysis.mismatch.bank.peaks import Peak, largest, line_top
from analysis.mismatch.bank.scalars import UNKNOWN, Number
from dsis.measures import Channel

Array = NDArray[np.float64]
LABEL, DETAIL, KIND = "row_spectrum_peak of light moving on", "light moving on", "rows moving on"
_LEAST = 3  # frames: of two every change is an advance
_FINE = 2  # advances tried, for each frame


class MovingBands:
    """Power of rows over all lit exposures, by advance a frame and half bins of cycles.

    Exposures have phases of their own, and one advance.

    Parameters
    ----------
    rows
        Of the sensor.
    sites
        First row and column of each channel.
    last
        Number of the last frame of any exposure.
    """

    def __init__(self, rows: int, sites: Mapping[str, tuple[int, int]], last: int) -> None:
        self.rows, self.sites = rows, sites
        count = _FINE * (last + 1)
        self.advances = np.arange(count) / count
        self.power = np.zeros((count, rows + 1))
        self.total = self.squares = self.frames = 0.0

    def add(
        self,
        channels: Mapping[str, Channel],
        variance_dn2: Mapping[str, float],
        signal_dn: Mapping[str, float],
        numbers: Sequence[int],
    ) -> None:
        """Take one exposure; the variance and signal that are expected weigh its rows."""
        frames = len(numbers)
        shapes = {name: (max(signal_dn[name], 0.0),) for name in channels}
        found = matched(channels, variance_dn2, shapes, self.sites, self.rows)
        if frames < _LEAST or found is None:
            return
        (series,), (noise,), (told,) = found
        if not noise > 0:
            return
        turns = np.exp(-2j * np.pi * np.outer(self.advances, np.asarray(numbers, np.float64)))
        moved = turns @ np.fft.rfft(series, 2 * self.rows, axis=1)
        self.power += told * np.abs(moved) ** 2 / (noise * (frames - 1))
        self.total += told
        self.squares += told**2
        self.frames += told * (frames - 1)

    def number(self) -> Number:
        """Return the normal score of the largest power, from one cycle a frame on."""
        if not self.total:
            return UNKNOWN
        degrees = max(round(self.total**2 / self.squares), 1)
        return largest((self.power / self.total)[:, 2:-1], degrees, blocks=((1, 1),))

    def peak(self) -> Peak | None:
        """Return where it is largest: cycles per row of a plane, power as one frame shows it."""
        if not self.total:
            return None
        power = self.power / self.total
        cycles, off, most = line_top(power[int(power[:, 2:].max(1).argmax())])
        step = 1 if len(self.sites) == 1 else 2
        alone = 1 + (most - 1) * self.total / self.frames / len(self.sites)
        return Peak(0.0, step * cycles / self.rows, alone, off)
