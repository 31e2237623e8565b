"""Sums over the frames of one exposure: every frame is read once and forgotten.

Each frame enters less the first one, d = v - v_0, which keeps float sums exact to rounding. Within
each channel the means of rows, columns and frame are taken off, u = d - r - c + f: subtracting the
pixel's mean over time commutes with that, so the moments of the temporal residual follow from sums
of u, u^2, u^3, u^4 without a second pass.
"""

from collections.abc import Iterable
from typing import Any

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from dsis.cfa import Cfa
from dsis.measures import kernels
from dsis.measures.assembly import measured
from dsis.measures.codes import CODES, LOWEST_CODE
from dsis.measures.kernels import Sums
from dsis.measures.measured import Measured
from dsis.measures.plane import Region, planes

LAGS = 4


class Accumulator:
    """Measures one exposure from its frames, given one at a time.

    Memory: five float64 and five float32 arrays of the size of a frame, two means per row and
    column of each frame, one code histogram.

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
    ) -> None:
        self.frame_shape = (rows, columns)
        self.cfa, self.black_level, self.threads = cfa, black_level, threads
        self.white_level, self.lowest_code = white_level, lowest_code
        self.region = _whole(region or (slice(None), slice(None)), rows, columns)
        self.shape = tuple(part.stop - part.start for part in self.region)
        self.planes = planes(cfa, self.region)
        if lags < 2:
            message = f"lags is {lags}, must be at least 2: the scalar measures need lag 2"
            raise ValueError(message)
        self.lags = np.array(
            [(y, x) for y in range(lags + 1) for x in range(-lags, lags + 1) if y > 0 or x >= 0]
        )
        self.frames = 0
        s1, s2, s3, s4, s11 = (np.zeros(self.shape) for _ in range(5))
        self.moments = (s1, s2, s3, s4, s11)
        self.first: NDArray[np.float32]  # set by the first frame, as are the next three
        self.before: NDArray[np.float32]
        self.centred: NDArray[np.float32]
        self.centred_before: NDArray[np.float32]
        self.lag_sums = np.zeros((len(self.lags), 2, 2))
        self.histogram = np.zeros((2, 2, CODES), np.int64)
        self.code_range = (CODES, -1)  # first and last entry of the histogram in use
        self.whole_codes = True

    def add(self, frame: NDArray[Any]) -> None:
        """Take the next frame, in the order recorded: uint16 or float32 (row, column), DN.

        Held as float32: codes are exact up to 2^24. Raises ValueError where the size differs or a
        value is not finite; the sums are then as they were.
        """
        if frame.shape != self.frame_shape:
            message = f"frame {self.frames} is {frame.shape}, must be {self.frame_shape}"
            raise ValueError(message)
        codes = np.ascontiguousarray(frame[self.region], np.float32)
        if not np.isfinite(codes).all():
            message = f"frame {self.frames} holds values that are not finite (NaN or infinite)"
            raise ValueError(message)
        if self.frames == 0:
            self._begin(codes)
        difference = codes - self.first
        by_row, by_column = kernels.line_sums(difference, self.threads)
        self._count_codes(codes)
        row_offset, column_offset = self._take_means(by_row, by_column)
        if self.frames % 2:
            self._take_pair(kernels.pair_squares(difference, self.before, self.threads))
        self._take_surfaces(difference)
        if self.frames:
            self._take_noise(difference, row_offset, column_offset)
        self.before = difference
        self.frames += 1

    def result(self) -> Measured:
        """Return the measures of the frames so far; raises ValueError with fewer than two."""
        if self.frames < 2:
            message = f"has {self.frames} frame(s), must have at least 2 to show any noise"
            raise ValueError(message)
        return measured(self)

    def _count_codes(self, codes: NDArray[np.float32]) -> None:
        if not self.whole_codes:
            return
        self.whole_codes = kernels.count_codes(codes, self.histogram, LOWEST_CODE)
        if self.whole_codes:
            low, high = int(codes.min()) - LOWEST_CODE, int(codes.max()) - LOWEST_CODE
            self.code_range = (min(low, self.code_range[0]), max(high, self.code_range[1]))

    def _begin(self, codes: NDArray[np.float32]) -> None:
        self.first = codes.copy()
        self.before = np.zeros_like(codes)
        self.centred, self.centred_before = np.zeros_like(codes), np.zeros_like(codes)

    def _take_means(self, by_row: Sums, by_column: Sums) -> tuple[Sums, Sums]:
        """Keep the means of every plane; return what to subtract from each pixel."""
        row_offset, column_offset = np.empty_like(by_row), np.empty_like(by_column)
        for plane in self.planes:
            rows, columns = plane.pixels
            across, down = list({p for _, p in plane.phases}), list({p for p, _ in plane.phases})
            n, m = plane.shape
            row_means = by_row[rows][:, across].sum(1) / m
            column_means = by_column[down, columns].sum(0) / n
            mean = float(row_means.mean())
            plane.row_means.append(row_means)
            plane.column_means.append(column_means)
            plane.frame_means.append(mean)
            for p in across:
                row_offset[rows, p] = row_means
            for p in down:
                column_offset[p, columns] = column_means - mean
        return row_offset, column_offset

    def _take_pair(self, squares: Sums) -> None:
        for plane in self.planes:
            total = sum(squares[y::2, x].sum() for y, x in plane.phases)
            plane.pair_squares.append(float(total) / (plane.shape[0] * plane.shape[1]))
            plane.pair_means.append(plane.frame_means[-1] - plane.frame_means[-2])

    def _take_noise(
        self, difference: NDArray[np.float32], row_offset: Sums, column_offset: Sums
    ) -> None:
        self.centred, self.centred_before = self.centred_before, self.centred
        kernels.add_moments(
            difference,
            row_offset,
            column_offset,
            self.centred_before,
            self.centred,
            self.moments,
            self.threads,
        )
        self.lag_sums += kernels.lag_products(self.centred, self.lags, self.threads)

    def _take_surfaces(self, difference: NDArray[np.float32]) -> None:
        for plane in self.planes:
            image = difference[plane.pixels] - np.float32(plane.frame_means[-1])
            kernels.add_power(scipy.fft.rfft2(image), plane.power)
            plane.surfaces.append(plane.smooth.coefficients(image))


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
