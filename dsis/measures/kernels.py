"""What is summed over every pixel of a frame, compiled.

Sums are kept by row, or by block of 64 rows, and added up in one order: the same bytes whatever the
number of threads. A 2 x 2 phase is (row parity, column parity) within the array.
"""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from dsis.compiled import inlined, kernel, over_rows, pairwise_sum

Frame = NDArray[np.float32]
Sums = NDArray[np.float64]
FiveSums = tuple[Sums, Sums, Sums, Sums, Sums]


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


def centre(
    difference: Frame, row_offset: Sums, column_offset: Sums, centred: Frame, threads: int
) -> None:
    """Write u = difference - offsets to `centred`, as `add_moments` does."""

    def block(first: int, last: int) -> None:
        _centre(difference, row_offset, column_offset, centred, first, last)

    over_rows(block, difference.shape[0], threads)


def started(centred: Frame) -> FiveSums:
    """Return the sums of u, u^2, u^3, u^4 and u previous over a zero and one frame u."""
    u = centred.astype(np.float64)
    square = u * u
    return u, square, square * u, square * square, np.zeros_like(u)


def offsets(by_row: Sums, by_column: Sums, single: bool) -> tuple[Sums, Sums, Sums]:
    """Return what to subtract from each pixel, and the mean of each phase (2, 2).

    Row means (row, column parity), and column means less the mean (row parity, column); `single`:
    all phases are one channel.
    """
    rows, columns = by_row.shape[0], by_column.shape[1]
    if single:
        by_line = by_row[:, 0] + by_row[:, 1]
        mean = by_line.sum() / (rows * columns)
        of_rows, of_columns, means = np.empty((rows, 2)), np.empty((2, columns)), np.empty((2, 2))
        of_rows[:] = (by_line / columns)[:, np.newaxis]
        of_columns[:] = (by_column[0] + by_column[1]) / rows - mean
        means[:] = mean
        return of_rows, of_columns, means
    down, across, pixels, parity = _of_parity(rows, columns)
    means = np.array([by_row[0::2].sum(0), by_row[1::2].sum(0)]) / pixels
    of_columns = by_column / down - means[:, parity]
    return by_row / across, of_columns, means


@lru_cache(maxsize=32)
def _of_parity(rows: int, columns: int) -> tuple[NDArray[np.int_], ...]:
    """Return how many rows (2, 1), columns (2,) and pixels (2, 2) are even and odd; of each column.

    Last its parity: (column,).
    """
    down, across = (np.array([(size + 1) // 2, size // 2]) for size in (rows, columns))
    return down[:, np.newaxis], across, np.outer(down, across), np.arange(columns) & 1


@kernel
def split(image: Frame, places: NDArray[np.int64], means: Sums, out: Frame) -> None:
    """Write planes less their means: (plane, row, column); `places`: first row, column and step."""
    for k in range(len(places)):
        y0, x0, step = places[k]
        mean = np.float32(means[y0, x0])
        for y in range(out.shape[1]):
            line, into = image[y0 + y * step], out[k, y]
            if step == 1:
                for x in range(into.size):
                    into[x] = line[x] - mean
            else:
                for x in range(into.size):
                    into[x] = line[x0 + 2 * x] - mean


@kernel
def count_codes(frames: Frame, histogram: NDArray[np.int64], lowest: int) -> None:
    """Add whole codes, all within it, to `histogram` (row parity, column parity, code - lowest)."""
    for i in range(len(frames)):  # `for frame in frames` would not know that they are contiguous
        _count_codes(frames[i], histogram, lowest)


@kernel
def _count_codes(frame: Frame, histogram: NDArray[np.int64], lowest: int) -> None:
    rows, columns = frame.shape
    first, second, third, fourth = (
        histogram[0, 0],
        histogram[0, 1],
        histogram[1, 0],
        histogram[1, 1],
    )
    # Two rows at a time: neighbours mostly have the same few codes, and a count waits for the last.
    for y in range(0, rows - 1, 2):
        line, after = frame[y], frame[y + 1]
        for i in range(columns // 2):
            first[np.uintp(np.int32(line[2 * i]) - lowest)] += 1
            second[np.uintp(np.int32(line[2 * i + 1]) - lowest)] += 1
            third[np.uintp(np.int32(after[2 * i]) - lowest)] += 1
            fourth[np.uintp(np.int32(after[2 * i + 1]) - lowest)] += 1
        if columns & 1:
            first[np.uintp(np.int32(line[columns - 1]) - lowest)] += 1
            third[np.uintp(np.int32(after[columns - 1]) - lowest)] += 1
    if rows & 1:
        for x in range(columns):
            histogram[0, x & 1, np.uintp(np.int32(frame[rows - 1, x]) - lowest)] += 1


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
    for y in range(first, last):
        line, before, out = difference[y], previous[y], centred[y]
        offset = column_offset[y & 1]
        a1, a2, a3, a4, a11 = s1[y], s2[y], s3[y], s4[y], s11[y]
        even, odd = row_offset[y, 0], row_offset[y, 1]
        centre_line(line, offset, (even, odd), out)
        add_moments_of_line(out, before, a1, a2, a3, a4, a11)


@kernel
def _centre(
    difference: Frame, row_offset: Sums, column_offset: Sums, centred: Frame, first: int, last: int
) -> None:
    for y in range(first, last):
        line, out, offset = difference[y], centred[y], column_offset[y & 1]
        even, odd = row_offset[y, 0], row_offset[y, 1]
        centre_line(line, offset, (even, odd), out)


@kernel
def centre_line(line: Sums, offset: Sums, of_row: tuple[float, float], out: Frame) -> None:
    """Write a line less the offsets of its columns, and of the row in even and odd columns."""
    even, odd = of_row
    for x in range(line.size):
        out[x] = np.float32(line[x] - offset[x] - (odd if x & 1 else even))


@kernel
def add_moments_of_line(
    line: Frame, before: Frame, s1: Sums, s2: Sums, s3: Sums, s4: Sums, s11: Sums
) -> None:
    """Add u, its square, cube and fourth power, and the product with u of the frame before."""
    for x in range(line.size):
        u = np.float64(line[x])
        square = u * u
        s1[x] += u
        s2[x] += square
        s3[x] += square * u
        s4[x] += square * square
        s11[x] += u * before[x]


@kernel
def add_power(transform: NDArray[np.complexfloating], power: Sums) -> None:
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
        y = 0
        while y + 4 <= rows:  # four at a time, in their order: sums are written less often
            one, two = images[k, y], images[k, y + 1]
            three, four = images[k, y + 2], images[k, y + 3]
            for degree in range(basis.shape[1]):
                a, b = basis[y, degree], basis[y + 1, degree]
                c, d = basis[y + 2, degree], basis[y + 3, degree]
                into = out[k, degree]
                for x in range(columns):
                    into[x] = (((into[x] + a * one[x]) + b * two[x]) + c * three[x]) + d * four[x]
            y += 4
        while y < rows:
            line = images[k, y]
            for degree in range(basis.shape[1]):
                weight, into = basis[y, degree], out[k, degree]
                for x in range(columns):
                    into[x] += weight * line[x]
            y += 1
    return out


def mean_frames(
    base: Frame,
    sums: Sums,
    frames: int,
    places: NDArray[np.int64],
    line_means: tuple[Sums, Sums],
    shift: float,
) -> tuple[Sums, Sums, Sums, Sums]:
    """Return the mean frames of channels, and their changes since the first frame less the mean's.

    Then the means of rows and of columns of the first frame, shifted as the mean frames are. All by
    plane: (plane, row, column) twice, (plane, row), (plane, column).

    Parameters
    ----------
    base, sums
        The first frame, and the sums of u: (row, column) of the array.
    frames, places
        Number of frames; first row, first column and step of each channel.
    line_means
        Of d, by rows and by columns: (plane, frame, row), (plane, frame, column).
    shift
        Added to the mean frames.
    """
    return _mean_frames(base, sums, frames, places, *line_means, shift)


@kernel
def _mean_frames(
    base: Frame,
    sums: Sums,
    frames: int,
    places: NDArray[np.int64],
    row_means: Sums,
    column_means: Sums,
    shift: float,
) -> tuple[Sums, Sums, Sums, Sums]:
    count, n, m = len(places), row_means.shape[2], column_means.shape[2]
    means, changes = np.empty((count, n, m)), np.empty((count, n, m))
    by_row, by_column = np.empty((count, n)), np.zeros((count, m))
    rows, columns, own = np.empty(n), np.empty(m), np.empty(m)
    for k in range(count):
        y0, x0, step = places[k]
        _mean_of(row_means[k], rows)
        _mean_of(column_means[k], columns)
        level = pairwise_sum(rows) / n
        for y in range(n):
            line, first = sums[y0 + y * step], base[y0 + y * step]
            mean, change = means[k, y], changes[k, y]
            beyond = rows[y] - level
            for x in range(m):
                own[x] = first[x0 + x * step]
                change[x] = line[x0 + x * step] / frames + beyond + (columns[x] - level)
                mean[x] = change[x] + level + own[x] + shift
                by_column[k, x] += own[x]
            by_row[k, y] = _of_four(own) / m + shift
        for x in range(m):
            by_column[k, x] = by_column[k, x] / n + shift
    return means, changes, by_row, by_column


@inlined
def _mean_of(lines: Sums, out: Sums) -> None:
    """Write the mean of lines (line, any)."""
    for x in range(out.size):
        out[x] = lines[0, x]
    for t in range(1, len(lines)):
        for x in range(out.size):
            out[x] += lines[t, x]
    for x in range(out.size):
        out[x] /= len(lines)


@inlined
def _of_four(line: Sums) -> float:
    """Return the sum of a line, of four parts, which do not wait for one another."""
    a = b = c = d = 0.0
    end = line.size // 4 * 4
    for x in range(0, end, 4):
        a += line[x]
        b += line[x + 1]
        c += line[x + 2]
        d += line[x + 3]
    for x in range(end, line.size):
        a += line[x]
    return (a + b) + (c + d)


@kernel
def temporal_powers(
    powers: Sums, transforms: NDArray[np.complexfloating], columns: int, frames: int
) -> NDArray[np.floating]:
    """Return powers summed over frames less those of the means, per pixel and free frame.

    Powers (plane, row, bin) of images of `columns` columns; nothing is below zero.
    """
    count, n, bins = powers.shape
    found = np.empty((count, n, bins), np.float32)
    times, size = np.float32(-frames), np.float32(n * columns * (frames - 1))
    for k in range(count):
        for y in range(n):
            line, own, out = powers[k, y], transforms[k, y], found[k, y]
            for x in range(bins):
                of_mean = own[x].real * own[x].real + own[x].imag * own[x].imag
                left = np.float32(np.float64(of_mean * times) + line[x])
                out[x] = (np.float32(0.0) if left < 0 else left) / size
    return found
