"""How bright a recording's exposures are: the mean of every colour filter site, above black."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dsis.cfa import Cfa
from dsis.compiled import kernel
from dsis.recording import RecordedExposure, Recording
from dsis.recording.ahead import in_order

Sites = NDArray[np.float64]
"""A number for each of rows 0, 1 and columns 0, 1: (2, 2), the four alike in a mono sensor."""

CLIPPED_SHARE = 1e-3
"""Share at the white level from which a mean is biased by more than 1e-3 of the noise."""


@dataclass(frozen=True)
class Levels:
    """Mean codes of darks and flats, and the share of pixels at the white level.

    Attributes
    ----------
    mean_dn, clipped
        By the exposure's name.
    """

    mean_dn: Mapping[str, Sites]
    clipped: Mapping[str, Sites]


def levels_of(recording: Recording, threads: int = 1) -> Levels:
    """Return the levels of a recording; reads every dark and every flat once."""
    exposures = [e for e in recording.exposures if e.kind != "scene"]
    found = {e.name: _level(recording, e, threads) for e in exposures}
    return Levels({n: mean for n, (mean, _) in found.items()},
                  {n: share for n, (_, share) in found.items()})  # fmt: skip


def black_dn(recording: Recording, levels: Levels, exposure_time_s: float) -> Sites:
    """Return the black level at an exposure time: dark current is part of it.

    Darks are interpolated linearly in exposure time (the nearest beyond the ends); a recording
    without darks has its nominal pedestal only.
    """
    darks = recording.of_kind("dark")
    if not darks:
        return np.full((2, 2), recording.sensor.black_level)
    times = sorted({e.exposure_time_s for e in darks})
    means = np.array([
        np.mean([levels.mean_dn[e.name] for e in darks if e.exposure_time_s == time], axis=0)
        for time in times
    ])  # fmt: skip
    return np.array([
        [np.interp(exposure_time_s, times, means[:, row, column]) for column in (0, 1)]
        for row in (0, 1)
    ])  # fmt: skip


def mean_frame(recording: Recording, exposure: RecordedExposure) -> NDArray[np.float32]:
    """Return the mean of all frames, codes (row, column); reads each once."""
    total = np.zeros((recording.rows, recording.columns), np.uint32)
    for codes in recording.frames(exposure, ahead=1):
        total += codes
    return (total / len(exposure.frames)).astype(np.float32)


def site_means(image: NDArray[np.generic]) -> Sites:
    """Return the mean over every second row and column, from each of rows and columns 0, 1."""
    # One row or column alone has no second parity: it stands for both.
    rows, columns = (range(2) if size > 1 else (0, 0) for size in image.shape)
    return np.array([[image[r::2, c::2].mean(dtype=np.float64) for c in columns] for r in rows])


def _level(recording: Recording, exposure: RecordedExposure, threads: int) -> tuple[Sites, Sites]:
    white = np.uint16(np.ceil(recording.sensor.white_level))

    def sums(index: int) -> NDArray[np.uint64]:
        return _site_sums(recording.frame(exposure, index), white)

    frames = len(exposure.frames)
    total = np.sum(list(in_order(sums, range(frames), threads)), axis=0) / frames
    pixels = np.outer(_halves(recording.rows), _halves(recording.columns))
    if recording.sensor.cfa is Cfa.MONO:
        total, pixels = np.full((2, 2, 2), total.sum((1, 2), keepdims=True)), pixels.sum()
    return total[0] / pixels, total[1] / pixels


def _halves(size: int) -> NDArray[np.float64]:
    """Return how many of `size` rows (columns) are even and odd; a missing half counts as one."""
    return np.array([(size + 1) // 2, max(size // 2, 1)], np.float64)


@kernel
def _site_sums(codes: NDArray[np.uint16], white: np.uint16) -> NDArray[np.uint64]:
    """Return sums of codes and counts of codes at `white`, by parity of row and column."""
    sums = np.zeros((2, 2, 2), np.uint64)
    rows, columns = codes.shape
    for row in range(rows):
        line = codes[row]
        for parity in range(2):
            total, clipped = np.uint64(0), np.uint64(0)
            for column in range(parity, columns, 2):
                total += np.uint64(line[column])
                clipped += np.uint64(line[column] >= white)
            sums[0, row % 2, parity] += total
            sums[1, row % 2, parity] += clipped
    return sums
