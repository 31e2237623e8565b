"""What a proof reads of a recording: training frames as sums, locked frames as they are."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import sqrt
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.prove.sites import site_means
from analysis.mismatch.wholecells import unseen
from dsis.cfa import Cfa
from dsis.grid import PixelGrid
from dsis.recording import RecordedExposure, Recording

Array = NDArray[np.float64]
Codes = NDArray[np.uint16]
Numbers = Mapping[str, Sequence[int]]
T = TypeVar("T")

MOST_TRAINING = 16
MOST_LOCKED = 24
MOST_EXPOSURES = 24  # with locked frames, and as many without
STACK = 6  # frames from which an exposure shows more than a pair does
MOST_CLIPPED = 0.05  # share of samples at an end of the converter: no law of noise is left there
MOST_SAMPLES = 2**24  # in all: a larger sensor is proven on a window at its centre
MOST_SEEN = 2**27  # by a classifier, whose features cost less than likelihoods


@dataclass(frozen=True)
class HeldExposure:
    """One exposure of a recording, in the window.

    Attributes
    ----------
    name, kind, exposure_time_s, light
        As recorded.
    training
        Numbers of the training frames used.
    mean_dn, variance_dn2
        Over them, of each pixel, DN of codes (row, column); the variance is zero below two frames.
    training_means_dn
        Mean code of each site in each training frame: (frame, site).
    counts
        How often each code occurs in them.
    numbers
        Of the locked frames, from 0.
    codes
        Locked frames: uint16 (frame, row, column).
    before
        The frame before each of them; None: there is none.
    """

    name: str
    kind: str
    exposure_time_s: float
    light: float | None
    training: tuple[int, ...]
    mean_dn: Array
    variance_dn2: Array
    training_means_dn: Array
    counts: NDArray[np.int64]
    numbers: tuple[int, ...]
    codes: Codes
    before: tuple[Codes | None, ...]

    @property
    def trained(self) -> int:
        """How many training frames there are."""
        return len(self.training)


@dataclass(frozen=True)
class Held:
    """The training and locked frames of a recording.

    Attributes
    ----------
    exposures
        With locked frames or without.
    grid
        The window that is looked at: the whole sensor unless it is large, or an odd mosaic.
    black_dn, white_code
        Nominal black level, largest code.
    left_out
        Exposures of which too many samples are clipped, and scenes that are locked altogether.
    """

    exposures: tuple[HeldExposure, ...]
    grid: PixelGrid
    cfa: Cfa
    black_dn: float
    white_code: int
    left_out: tuple[str, ...]

    @property
    def locked(self) -> tuple[HeldExposure, ...]:
        """The exposures with locked frames."""
        return tuple(e for e in self.exposures if e.numbers)

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of the window."""
        return self.grid.rows, self.grid.columns


def hold(
    recording: Recording, training: Numbers, locked: Numbers, most_samples: int | None = None
) -> Held:
    """Return the frames of a recording that a proof needs; each is read once or twice.

    `most_samples` in all, of a window at the centre; None: `MOST_SAMPLES`.
    """
    known = [e for e in recording.exposures if training.get(e.name) or locked.get(e.name)]
    proving = _chosen([e for e in known if locked.get(e.name)])
    others = _chosen([e for e in known if not locked.get(e.name)])
    taken = [e for e in known if e in proving or e in others]
    frames = sum(
        min(len(training.get(e.name, ())), MOST_TRAINING)
        + min(len(locked.get(e.name, ())), MOST_LOCKED)
        + 4
        for e in taken
    )
    grid = _window(recording, (most_samples or MOST_SAMPLES) // max(frames, 1))
    read = [
        _hold(
            recording,
            exposure,
            thinned(list(training.get(exposure.name, ())), MOST_TRAINING),
            thinned(list(locked.get(exposure.name, ())), MOST_LOCKED),
            grid,
        )
        for exposure in taken
    ]
    white = int(recording.sensor.white_level)
    left_out = tuple(
        e.name
        for e in read
        if _clipped(e, white) > MOST_CLIPPED or (e.kind == "scene" and not e.trained)
    )
    kept = tuple(e for e in read if e.name not in left_out)
    return Held(kept, grid, recording.sensor.cfa, recording.sensor.black_level, white, left_out)


def _chosen(exposures: list[RecordedExposure]) -> list[RecordedExposure]:
    """Return the exposures to use: stacks first, of the others some, evenly spaced."""
    stacks = thinned([e for e in exposures if len(e.frames) >= STACK], MOST_EXPOSURES)
    few = [e for e in exposures if len(e.frames) < STACK]
    return stacks + thinned(few, MOST_EXPOSURES - len(stacks))


def thinned(items: list[T], most: int) -> list[T]:
    """Return at most so many items, evenly spaced."""
    if len(items) <= most:
        return items
    if not most:
        return []
    return [items[i * len(items) // most] for i in range(most)]


def _window(recording: Recording, most_pixels: int) -> PixelGrid:
    rows, columns = recording.rows, recording.columns
    shrink = min(1.0, sqrt(most_pixels / (rows * columns)))
    high, wide = (max(int(n * shrink) // 2 * 2, 2) for n in (rows, columns))
    top, left = ((n - part) // 4 * 2 for n, part in ((rows, high), (columns, wide)))
    below, beside = unseen(recording)
    whole = rows + below, columns + beside
    return PixelGrid(high, wide, recording.sensor.cfa, top, left, *whole)


def _hold(
    recording: Recording,
    exposure: RecordedExposure,
    training: Sequence[int],
    locked: Sequence[int],
    grid: PixelGrid,
) -> HeldExposure:
    cut = (
        slice(grid.first_row, grid.first_row + grid.rows),
        slice(grid.first_column, grid.first_column + grid.columns),
    )

    def read(number: int) -> Codes:
        return np.ascontiguousarray(recording.frame(exposure, number)[cut])

    total, square = np.zeros((grid.rows, grid.columns)), np.zeros((grid.rows, grid.columns))
    counts = np.zeros(int(recording.sensor.white_level) + 1, np.int64)
    means = []
    first: Array | None = None
    for number in training:
        codes = read(number)
        first = codes.astype(np.float64) if first is None else first
        departure = codes - first  # from the first frame: squares stay small
        total += departure
        square += departure * departure
        counts += np.bincount(codes.reshape(-1), minlength=counts.size)
        means.append(site_means(codes, recording.sensor.cfa))
    n = len(training)
    mean = np.zeros(total.shape) if first is None else first + total / n
    variance = (square - total * total / n) / (n - 1) if n > 1 else np.zeros(total.shape)
    frames = [read(number) for number in locked]
    return HeldExposure(
        exposure.name,
        exposure.kind,
        exposure.exposure_time_s,
        exposure.light,
        tuple(training),
        mean,
        np.maximum(variance, 0.0),
        np.array(means),
        counts,
        tuple(locked),
        np.array(frames, np.uint16).reshape(len(frames), grid.rows, grid.columns),
        tuple(read(number - 1) if number else None for number in locked),
    )


def _clipped(exposure: HeldExposure, white: int) -> float:
    codes, size = exposure.codes, exposure.mean_dn.size * exposure.trained
    low = int(exposure.counts[0]) + int((codes == 0).sum())
    high = int(exposure.counts[-1]) + int((codes >= white).sum())
    return max(low, high) / max(size + codes.size, 1)
