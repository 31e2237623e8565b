"""Sums over the frames of one exposure: every frame is read once and forgotten.

Each frame enters less the first one, d = v - v_0, which keeps float sums exact to rounding. Within
each channel the means of rows, columns and frame are taken off, u = d - r - c + f: subtracting the
pixel's mean over time commutes with that, so the moments of the temporal residual follow from sums
of u, u^2, u^3, u^4 without a second pass.
"""

from collections.abc import Callable, Iterable, Sequence
from math import prod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dsis.cfa import Cfa
from dsis.measures import kernels
from dsis.measures.assembly import measured
from dsis.measures.at_once import take_all
from dsis.measures.codes import CodeCounts
from dsis.measures.first_pass import Passed, first_pass, no_change
from dsis.measures.kernels import FiveSums, Sums
from dsis.measures.lag_products import half_plane, lag_products
from dsis.measures.measured import Measured
from dsis.measures.plane import Region, Transforms, planes, sheets

LAGS = 4
AT_ONCE = 1 << 20  # samples: with what is made of them they take 20 MB


class Accumulator:
    """Measures one exposure from its frames, given one at a time.

    Memory: five float64 (with three frames and more) and six float32 arrays of the size of a
    frame, two sums per row and column of each frame, one code histogram.

    Parameters
    ----------
    rows, columns
        Size of the frames.
    cfa
        Colour filter array, by the rows and columns of the whole frame.
    black_level
        Nominal pedestal, DN: levels and mean frames are given above it.
    white_level
        Largest code, DN; None: no share of pixels clipped there is known.
    lowest_code
        Smallest code, DN; None: no share of pixels clipped there is known.
    region
        Rows and columns to measure (contiguous slices); None: the whole frame.
    lags
        Largest lag of the autocovariances, pixels of the mosaic.
    threads
        Threads that kernels may use; the result does not depend on it.
    spectra
        Sees the transforms of each frame but the first, less the first and its own mean, of the
        planes of one size: complex64 (plane, row, column // 2 + 1).
    power, neighbours
        Whether to take transforms of frames, and products of neighbouring pixels: most of the time
        goes there. Without them spectral_peak, and the correlations, are unknown.
    """

    def __init__(
        self,
        rows: int,
        columns: int,
        cfa: Cfa = Cfa.MONO,
        black_level: float = 0.0,
        white_level: float | None = None,
        *,
        lowest_code: float | None = 0.0,
        region: Region | None = None,
        lags: int = LAGS,
        threads: int = 1,
        spectra: Callable[[Transforms], None] | None = None,
        power: bool = True,
        neighbours: bool = True,
    ) -> None:
        self.spectra = spectra
        self.power, self.neighbours = power, neighbours
        self.frame_shape = (rows, columns)
        self.cfa, self.black_level, self.threads = cfa, black_level, threads
        self.white_level, self.lowest_code = white_level, lowest_code
        self.region = _whole(region or (slice(None), slice(None)), rows, columns)
        self.shape = tuple(part.stop - part.start for part in self.region)
        self.planes = planes(cfa, self.region)
        self.sheets = sheets(self.planes)
        if lags < 2:
            message = f"lags is {lags}, must be at least 2: the scalar measures need lag 2"
            raise ValueError(message)
        self.reach = lags
        self.frames = 0
        self.moments: FiveSums | None = None  # of two frames the second's residual says it all
        self.first: NDArray[np.float32]  # set by the first frame, as are the next four
        self.difference: NDArray[np.float32]
        self.before: NDArray[np.float32]
        self.centred: NDArray[np.float32]
        self.centred_before: NDArray[np.float32]
        self.row_sums: list[Sums] = []  # of each frame, as are the next three: `Passed`
        self.column_sums: list[Sums] = []
        self.means: list[Sums] = []  # of d by phase
        self.pair_squares: list[Sums] = []  # of each pair of frames
        self.lag_sums = np.zeros((len(half_plane(lags)), 2, 2))
        self.codes = CodeCounts()

    def add(self, frame: NDArray[Any]) -> None:
        """Take the next frame, in the order recorded: uint16 or float32 (row, column), DN.

        Held as float32: codes are exact up to 2^24. Raises ValueError where the size differs or a
        value is not finite; the sums are then as they were.
        """
        if frame.shape != self.frame_shape:
            message = f"frame {self.frames} is {frame.shape}, must be {self.frame_shape}"
            raise ValueError(message)
        codes = np.ascontiguousarray(frame[self.region], np.float32)
        if self.frames == 0:
            self._begin(codes)
            found = no_change(codes)
        else:
            found = first_pass(codes, self.first, self.before, self.difference, self.threads)
        if not (found.whole or np.isfinite(codes).all()):
            message = f"frame {self.frames} holds values that are not finite (NaN or infinite)"
            raise ValueError(message)
        self.codes.add(codes, whole=found.whole, low=found.lowest, high=found.highest)
        self._take_lines(found)
        self.before, self.difference = self.difference, self.before
        self.frames += 1

    def add_all(self, frames: Sequence[NDArray[Any]]) -> None:
        """Take frames as `add` does; together where they are small: that takes less time."""
        for number, frame in enumerate(frames, self.frames):
            if frame.shape != self.frame_shape:
                message = f"frame {number} is {frame.shape}, must be {self.frame_shape}"
                raise ValueError(message)
        if self.frames or len(frames) < 2 or len(frames) * prod(self.shape) > AT_ONCE:
            for frame in frames:
                self.add(frame)
            return
        codes = np.empty((len(frames), *self.shape), np.float32)
        for own, frame in zip(codes, frames, strict=True):
            own[:] = frame[self.region]
        take_all(self, codes)

    def result(self) -> Measured:
        """Return the measures of the frames so far; raises ValueError with fewer than two."""
        if self.frames < 2:
            message = f"has {self.frames} frame(s), must have at least 2 to show any noise"
            raise ValueError(message)
        return measured(self)

    def _begin(self, codes: NDArray[np.float32]) -> None:
        self.first = codes.copy()
        self.before, self.difference = np.zeros_like(codes), np.zeros_like(codes)
        self.centred, self.centred_before = np.zeros_like(codes), np.zeros_like(codes)

    def _take_lines(self, found: Passed) -> None:
        """Keep the sums of lines; take their means off, and add up what is left."""
        row_offset, column_offset, means = kernels.offsets(
            found.by_row, found.by_column, self.cfa is Cfa.MONO
        )
        self.row_sums.append(found.by_row)
        self.column_sums.append(found.by_column)
        self.means.append(means)
        if self.frames % 2:
            self.pair_squares.append(found.squares)
        for sheet in self.sheets:
            if self.frames:
                sheet.add(self.difference, means)
                if not self.power:
                    continue
                transforms = sheet.transformed(self.threads)
                if self.spectra is not None:
                    self.spectra(transforms)
            else:
                sheet.start()
        if self.frames:
            self._take_noise(row_offset, column_offset)

    def _take_noise(self, row_offset: Sums, column_offset: Sums) -> None:
        self.centred, self.centred_before = self.centred_before, self.centred
        if self.frames == 1:
            kernels.centre(self.difference, row_offset, column_offset, self.centred, self.threads)
        else:
            self.moments = self.moments or kernels.started(self.centred_before)
            kernels.add_moments(
                self.difference,
                row_offset,
                column_offset,
                self.centred_before,
                self.centred,
                self.moments,
                self.threads,
            )
        if self.neighbours:
            self.lag_sums += lag_products(self.centred, self.reach, self.threads)


def measure_exposure(
    frames: Iterable[NDArray[Any]],
    cfa: Cfa = Cfa.MONO,
    black_level: float = 0.0,
    white_level: float | None = None,
    *,
    lowest_code: float | None = 0.0,
    region: Region | None = None,
    lags: int = LAGS,
    threads: int = 1,
) -> Measured:
    """Return the measures of one exposure; `frames` (row, column) are read once, one at a time.

    Parameters as in `Accumulator`. Raises ValueError with fewer than two frames.
    """
    sums: Accumulator | None = None
    for frame in frames:
        if sums is None:
            rows, columns = frame.shape
            sums = Accumulator(
                rows,
                columns,
                cfa,
                black_level,
                white_level,
                lowest_code=lowest_code,
                region=region,
                lags=lags,
                threads=threads,
            )
        sums.add(frame)
    if sums is None:
        message = "has no frames, must have at least 2"
        raise ValueError(message)
    return sums.result()


def _whole(region: Region, rows: int, columns: int) -> Region:
    """Return the region with plain limits; raise ValueError where it has steps or no pixels."""
    parts = []
    for part, size in zip(region, (rows, columns), strict=True):
        first, last, step = part.indices(size)
        if step != 1 or last <= first:
            message = f"region {part} of {size} must be contiguous and hold pixels"
            raise ValueError(message)
        parts.append(slice(first, last))
    return parts[0], parts[1]
