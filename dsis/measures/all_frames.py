"""What is summed over every pixel of all frames, compiled: as `kernels` does frame by frame.

Arrays have the frames first. The same sums in the same order: the same bytes.
"""

import numpy as np
from numpy.typing import NDArray

from dsis.compiled import kernel, pairwise_sum
from dsis.measures.kernels import (
    FiveSums,
    Frame,
    Sums,
    add_moments_of_line,
    add_power,
    centre_line,
    split,
)


def offsets_of_all(by_row: Sums, by_column: Sums, single: bool) -> tuple[Sums, Sums, Sums]:
    """Return what `kernels.offsets` does of all frames, from and by (frame, ..)."""
    frames, rows, columns = by_row.shape[0], by_row.shape[1], by_column.shape[2]
    of_rows, of_columns = np.empty((frames, rows, 2)), np.empty((frames, 2, columns))
    means = np.empty((frames, 2, 2))
    offsets_of = _offsets_of_one if single else _offsets_of_four
    offsets_of(by_row, by_column, of_rows, of_columns, means)
    return of_rows, of_columns, means


@kernel
def _offsets_of_one(
    by_row: Sums, by_column: Sums, of_rows: Sums, of_columns: Sums, means: Sums
) -> None:
    rows, columns = by_row.shape[1], by_column.shape[2]
    by_line = np.empty(rows)
    for t in range(len(by_row)):
        for y in range(rows):
            by_line[y] = by_row[t, y, 0] + by_row[t, y, 1]
            of_rows[t, y, 0] = of_rows[t, y, 1] = by_line[y] / columns
        mean = pairwise_sum(by_line) / (rows * columns)
        means[t] = mean
        for x in range(columns):
            offset = (by_column[t, 0, x] + by_column[t, 1, x]) / rows - mean
            of_columns[t, 0, x] = of_columns[t, 1, x] = offset


@kernel
def _offsets_of_four(
    by_row: Sums, by_column: Sums, of_rows: Sums, of_columns: Sums, means: Sums
) -> None:
    rows, columns = by_row.shape[1], by_column.shape[2]
    for t in range(len(by_row)):
        means[t] = 0.0
        for y in range(rows):
            for p in range(2):
                means[t, y & 1, p] += by_row[t, y, p]
                of_rows[t, y, p] = by_row[t, y, p] / ((columns + 1 - p) // 2)
        for q in range(2):
            down = (rows + 1 - q) // 2
            for p in range(2):
                means[t, q, p] /= down * ((columns + 1 - p) // 2)
            for x in range(columns):
                of_columns[t, q, x] = by_column[t, q, x] / down - means[t, q, x & 1]


@kernel
def moments_of_all(
    differences: Frame, row_offsets: Sums, column_offsets: Sums
) -> tuple[Frame, FiveSums]:
    """Return u = difference - offsets of all frames, and the sums that `add_moments` adds up.

    The first u is zero. Rows one by one: their sums are at hand from frame to frame.
    """
    frames, rows, columns = differences.shape
    centred = np.empty_like(differences)
    s1, s2, s3, s4, s11 = _room(rows, columns)
    centred[0] = 0
    for y in range(rows):
        a1, a2, a3, a4, a11 = s1[y], s2[y], s3[y], s4[y], s11[y]
        for t in range(1, frames):
            line, before, out = differences[t, y], centred[t - 1, y], centred[t, y]
            offset = column_offsets[t, y & 1]
            even, odd = row_offsets[t, y, 0], row_offsets[t, y, 1]
            centre_line(line, offset, (even, odd), out)
            add_moments_of_line(out, before, a1, a2, a3, a4, a11)
    return centred, (s1, s2, s3, s4, s11)


@kernel
def _room(rows: int, columns: int) -> FiveSums:
    size = rows, columns
    return np.zeros(size), np.zeros(size), np.zeros(size), np.zeros(size), np.zeros(size)


@kernel
def split_all(images: Frame, places: NDArray[np.int64], means: Sums, out: Frame) -> None:
    """Write the planes of images (image, row, column) as `split` does."""
    for i in range(len(images)):
        split(images[i], places, means[i], out[i])


@kernel
def add_powers(transforms: NDArray[np.complexfloating], power: Sums) -> None:
    """Add the power of transforms (image, plane, row, column)."""
    for i in range(len(transforms)):
        add_power(transforms[i], power)
