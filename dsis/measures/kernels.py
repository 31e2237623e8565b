"""What is summed over every pixel of a frame, compiled.

Sums are kept by row, or by block of 64 rows, and added up in one order: the same bytes whatever the
number of threads. A 2 x 2 phase is (row parity, column parity) within the array.
"""

import numpy as np
from numpy.typing import NDArray

from dsis.compiled import ROWS_PER_BLOCK, kernel, over_rows

Frame = NDArray[np.float32]
Sums = NDArray[np.float64]
FiveSums = tuple[Sums, Sums, Sums, Sums, Sums]

_BLOCK = ROWS_PER_BLOCK


def count_codes(frame: Frame, histogram: NDArray[np.int64], lowest: int) -> bool:
    """Add the frame's codes to `histogram` (row parity, column parity, code - lowest).

    Returns False, with the histogram in an undefined state, where a value is no whole code or lies
    outside the histogram.
    """
    return bool(_count_codes(frame, histogram, lowest))


def line_sums(difference: Frame, threads: int) -> tuple[Sums, Sums]:
    """Return sums over columns (row, column parity) and over rows (row parity, column)."""
    rows, columns = difference.shape
    by_row = np.zeros((rows, 2))
    by_column = np.zeros((-(-rows // _BLOCK), 2, columns))

    def block(first: int, last: int) -> None:
        _line_sums(difference, first, last, by_row, by_column)

    over_rows(block, rows, threads)
    return by_row, by_column.sum(0)


def pair_squares(difference: Frame, previous: Frame, threads: int) -> Sums:
    """Return sums of (difference - previous)^2 over columns: (row, column parity)."""
    by_row = np.zeros((difference.shape[0], 2))

    def block(first: int, last: int) -> None:
        _pair_squares(difference, previous, first, last, by_row)

    over_rows(block, difference.shape[0], threads)
    return by_row


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


def lag_products(image: Frame, lags: NDArray[np.int64], threads: int) -> Sums:
    """Return sums of image(y, x) image(y + dy, x + dx): (lag, row parity, column parity) of (y, x).

    Lags (lag, 2): dy >= 0, dx of any sign; pairs that leave the image are left out.
    """
    rows = image.shape[0]
    sums = np.zeros((-(-rows // _BLOCK), len(lags), 2, 2))

    def block(first: int, last: int) -> None:
        _lag_products(image, lags, first, last, sums)

    over_rows(block, rows, threads)
    total: Sums = sums.sum(0)
    return total


@kernel
def _count_codes(frame: Frame, histogram: NDArray[np.int64], lowest: int) -> bool:
    rows, columns = frame.shape
    size = histogram.shape[2]
    for y in range(rows):
        for x in range(columns):
            value = frame[y, x]
            code = np.int64(value)
            i = code - lowest
            if np.float32(code) != value or i < 0 or i >= size:
                return False
            histogram[y & 1, x & 1, i] += 1
    return True


@kernel
def _line_sums(difference: Frame, first: int, last: int, by_row: Sums, by_column: Sums) -> None:
    columns = difference.shape[1]
    for y in range(first, last):
        line, into = difference[y], by_column[y // _BLOCK, y & 1]
        even, odd = 0.0, 0.0
        for x in range(columns):
            into[x] += line[x]
        for i in range(columns // 2):
            even += line[2 * i]
            odd += line[2 * i + 1]
        if columns & 1:
            even += line[columns - 1]
        by_row[y, 0], by_row[y, 1] = even, odd


@kernel
def _pair_squares(difference: Frame, previous: Frame, first: int, last: int, by_row: Sums) -> None:
    columns = difference.shape[1]
    for y in range(first, last):
        sums = np.zeros(2)
        for x in range(columns):
            change = np.float64(difference[y, x] - previous[y, x])
            sums[x & 1] += change * change
        by_row[y, 0], by_row[y, 1] = sums[0], sums[1]


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
def _lag_products(image: Frame, lags: NDArray[np.int64], first: int, last: int, sums: Sums) -> None:
    rows, columns = image.shape
    # Sums by column vectorise; float32 holds 32 products of one sign to 1e-6.
    by_column = np.empty((2, columns), np.float32)
    for start in range(first, last, _BLOCK):
        for lag in range(lags.shape[0]):
            dy, dx = lags[lag, 0], lags[lag, 1]
            low, high = max(0, -dx), min(columns, columns - dx)
            by_column[:] = 0
            for y in range(start, min(start + _BLOCK, last, rows - dy)):
                here = image[y][low:high]
                there = image[y + dy][low + dx : high + dx]
                into = by_column[y & 1][low:high]
                for i in range(into.size):
                    into[i] += here[i] * there[i]
            for x in range(low, high):
                sums[start // _BLOCK, lag, 0, x & 1] += by_column[0, x]
                sums[start // _BLOCK, lag, 1, x & 1] += by_column[1, x]


@kernel
def add_power(transform: NDArray[np.complex64], power: Sums) -> None:
    """Add |transform|^2 to `power`."""
    rows, columns = transform.shape
    for y in range(rows):
        line, into = transform[y], power[y]
        for x in range(columns):
            re, im = np.float64(line[x].real), np.float64(line[x].imag)
            into[x] += re * re + im * im


@kernel
def project(image: NDArray[np.floating], basis: Sums) -> Sums:
    """Return sums over rows of basis(row, degree) image(row, column): (degree, column)."""
    rows, columns = image.shape
    out = np.zeros((basis.shape[1], columns))
    for y in range(rows):
        line = image[y]
        for degree in range(basis.shape[1]):
            weight, into = basis[y, degree], out[degree]
            for x in range(columns):
                into[x] += weight * line[x]
    return out
