"""What is summed over every pixel of a frame, compiled.

Sums are kept by row, or by block of 64 rows, and added up in one order: the same bytes whatever the
number of threads. A 2 x 2 phase is (row parity, column parity) within the array.
"""

import numpy as np
from numpy.typing import NDArray

from dsis.compiled import inlined, kernel, over_rows

Frame = NDArray[np.float32]
Sums = NDArray[np.float64]
FiveSums = tuple[Sums, Sums, Sums, Sums, Sums]


def count_codes(frame: Frame, histogram: NDArray[np.int64], lowest: int) -> None:
    """Add whole codes, all within it, to `histogram` (row parity, column parity, code - lowest)."""
    _count_codes(frame, histogram, lowest)


def add_moments(
    difference: Frame,
    row_offset: Sums,
    column_offset: Sums,
    previous: Frame,
    centred: Frame,
    power_sums: FiveSums,
    threads: int,
) -> None:
    """Write u = difference - offsets to `centred`; add u, u^2, u^3, u^4, u previous to the sums.

    Offsets: (row, column parity) and (row parity, column). `power_sums` are (row, column) each.
    """

    def block(first: int, last: int) -> None:
        _add_moments(
            difference, row_offset, column_offset, previous, centred, *power_sums, first, last
        )

    over_rows(block, difference.shape[0], threads)


@kernel
def offsets(by_row: Sums, by_column: Sums, single: bool) -> tuple[Sums, Sums, Sums]:
    """Return what to subtract from each pixel, and the mean of each phase (2, 2).

    Row means (row, column parity), and column means less the mean (row parity, column); `single`:
    all phases are one channel. Plain loops: array expressions take many times as long to compile.
    """
    rows, columns = by_row.shape[0], by_column.shape[1]
    of_rows, of_columns, means = np.empty((rows, 2)), np.empty((2, columns)), np.zeros((2, 2))
    if single:
        _offsets_of_one(by_row, by_column, of_rows, of_columns, means)
        return of_rows, of_columns, means
    down, across = ((rows + 1) // 2, rows // 2), ((columns + 1) // 2, columns // 2)
    for y in range(rows):
        for p in range(2):
            of_rows[y, p] = by_row[y, p] / across[p]
            means[y & 1, p] += by_row[y, p]
    for p in range(2):
        for q in range(2):
            means[p, q] /= down[p] * across[q]
        for x in range(columns):
            of_columns[p, x] = by_column[p, x] / down[p] - means[p, x & 1]
    return of_rows, of_columns, means


@inlined
def _offsets_of_one(
    by_row: Sums, by_column: Sums, of_rows: Sums, of_columns: Sums, means: Sums
) -> None:
    """Write `offsets` where all phases are one channel."""
    rows, columns = by_row.shape[0], by_column.shape[1]
    total = 0.0
    for y in range(rows):
        total += by_row[y, 0]
        total += by_row[y, 1]
    for p in range(2):
        for q in range(2):
            means[p, q] = total / (rows * columns)
        for y in range(rows):
            of_rows[y, p] = (by_row[y, 0] + by_row[y, 1]) / columns
        for x in range(columns):
            of_columns[p, x] = (by_column[0, x] + by_column[1, x]) / rows - means[0, 0]


@kernel
def split(image: Frame, places: NDArray[np.int64], means: Sums, out: Frame) -> None:
    """Write planes less their means: (plane, row, column); `places`: first row, column and step."""
    _, n, m = out.shape
    for k in range(places.shape[0]):
        y0, x0, step = places[k, 0], places[k, 1], places[k, 2]
        mean = np.float32(means[y0, x0])
        for y in range(n):
            line, into = image[y0 + y * step], out[k, y]
            if step == 1:
                for x in range(m):
                    into[x] = line[x] - mean
            else:
                for x in range(m):
                    into[x] = line[x0 + 2 * x] - mean


@kernel
def _count_codes(frame: Frame, histogram: NDArray[np.int64], lowest: int) -> None:
    rows, columns = frame.shape
    for y in range(rows):
        line, even, odd = frame[y], histogram[y & 1, 0], histogram[y & 1, 1]
        for i in range(columns // 2):
            even[np.uintp(np.int32(line[2 * i]) - lowest)] += 1
            odd[np.uintp(np.int32(line[2 * i + 1]) - lowest)] += 1
        if columns & 1:
            even[np.uintp(np.int32(line[columns - 1]) - lowest)] += 1


@kernel
def _add_moments(
    difference: Frame,
    row_offset: Sums,
    column_offset: Sums,
    previous: Frame,
    centred: Frame,
    s1: Sums,
    s2: Sums,
    s3: Sums,
    s4: Sums,
    s11: Sums,
    first: int,
    last: int,
) -> None:
    columns = difference.shape[1]
    for y in range(first, last):
        line, before, out = difference[y], previous[y], centred[y]
        offset = column_offset[y & 1]
        a1, a2, a3, a4, a11 = s1[y], s2[y], s3[y], s4[y], s11[y]
        even, odd = row_offset[y, 0], row_offset[y, 1]
        for x in range(columns):
            out[x] = np.float32(line[x] - offset[x] - (odd if x & 1 else even))
        for x in range(columns):
            u = np.float64(out[x])
            square = u * u
            a1[x] += u
            a2[x] += square
            a3[x] += square * u
            a4[x] += square * square
            a11[x] += u * before[x]


@kernel
def add_power(transform: NDArray[np.complex64], power: Sums) -> None:
    """Add |transform|^2 to `power`: (plane, row, column) both."""
    planes, rows, columns = transform.shape
    for k in range(planes):
        for y in range(rows):
            line, into = transform[k, y], power[k, y]
            for x in range(columns):
                re, im = np.float64(line[x].real), np.float64(line[x].imag)
                into[x] += re * re + im * im


@kernel
def project(images: NDArray[np.floating], basis: Sums) -> Sums:
    """Return sums over rows of basis(row, degree) image(row, column): (plane, degree, column)."""
    planes, rows, columns = images.shape
    out = np.zeros((planes, basis.shape[1], columns))
    for k in range(planes):
        for y in range(rows):
            line = images[k, y]
            for degree in range(basis.shape[1]):
                weight, into = basis[y, degree], out[k, degree]
                for x in range(columns):
                    into[x] += weight * line[x]
    return out


@kernel
def mean_frame(
    base: Frame,
    sums: Sums,
    frames: int,
    place: tuple[int, int, int],
    row_means: Sums,
    column_means: Sums,
    shift: float,
    mean: Sums,
    change: Sums,
) -> tuple[Sums, Sums]:
    """Write the mean frame of a channel, and its change since the first frame less the mean's.

    Returns the means of rows and of columns of the first frame, shifted as the mean frame is.

    Parameters
    ----------
    base, sums
        The first frame, and the sums of u: (row, column) of the array.
    frames, place
        Number of frames; first row, first column and step of the channel.
    row_means, column_means
        Of d: (frame, row), (frame, column).
    shift
        Added to the mean frame.
    mean, change
        Are written: (row, column).
    """
    y0, x0, step = place
    n, m = mean.shape
    rows, columns = np.zeros(n), np.zeros(m)
    _over_frames(row_means, frames, rows)
    _over_frames(column_means, frames, columns)
    level = 0.0
    for y in range(n):
        level += rows[y]
    level /= n
    for y in range(n):
        rows[y] -= level
    for x in range(m):
        columns[x] -= level
    by_row, by_column = np.zeros(n), np.zeros(m)
    for y in range(n):
        line, total = base[y0 + y * step, x0::step], sums[y0 + y * step, x0::step]
        into, over = mean[y], change[y]
        for x in range(m):
            over[x] = total[x] / frames + rows[y] + columns[x]
            into[x] = line[x] + (over[x] + level) + shift
            by_column[x] += line[x]
            by_row[y] += line[x]
    for y in range(n):
        by_row[y] = by_row[y] / m + shift
    for x in range(m):
        by_column[x] = by_column[x] / n + shift
    return by_row, by_column


@inlined
def _over_frames(series: Sums, frames: int, out: Sums) -> None:
    """Write the mean over the first frames of a series (frame, line) to `out`, zeros before."""
    for t in range(frames):
        for i in range(out.size):
            out[i] += series[t, i]
    for i in range(out.size):
        out[i] /= frames


@kernel
def temporal_power(
    power: Sums, transform: NDArray[np.complex128], columns: int, frames: int
) -> Sums:
    """Return power summed over frames less that of the mean, per pixel and free frame.

    Power (row, column) of images of `columns` columns; nothing is below zero.
    """
    rows, bins = power.shape
    out = np.empty((rows, bins))
    share = rows * columns * (frames - 1)
    for y in range(rows):
        for x in range(bins):
            still = transform[y, x].real ** 2 + transform[y, x].imag ** 2
            left = power[y, x] - frames * still
            out[y, x] = (left if left > 0 else 0.0) / share
    return out
