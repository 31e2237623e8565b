"""The first pass over a frame: its change since the first frame, sums of lines, range of values."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dsis.compiled import ROWS_PER_BLOCK, inlined, kernel, over_rows
from dsis.measures.kernels import Frame, Sums

_BLOCK = ROWS_PER_BLOCK
_FAR = 2**40  # beyond every code
_MOST = 2**31 - 1


class Passed(NamedTuple):
    """What one pass over a frame found.

    Attributes
    ----------
    by_row, by_column
        Sums of the difference over columns (row, column parity), over rows (row parity, column).
    squares
        Sums of (difference - previous)^2 by phase.
    whole
        Whether all values are whole numbers.
    lowest, highest
        Of the whole numbers among the values.
    """

    by_row: Sums
    by_column: Sums
    squares: Sums
    whole: bool
    lowest: int
    highest: int


def first_pass(
    frame: Frame, first: Frame, previous: Frame, difference: Frame, threads: int
) -> Passed:
    """Write frame - first to `difference` and return its sums; see `Passed`."""
    rows, columns = frame.shape
    blocks = -(-rows // _BLOCK)
    by_row, by_column = np.empty((rows, 2)), np.zeros((blocks, 2, columns))
    squares, limits = np.empty((blocks, 2, 2)), np.zeros((blocks, 3), np.int64)
    limits[:, 1], limits[:, 2] = _FAR, -_FAR

    def block(start: int, stop: int) -> None:
        lines = np.zeros((3, columns))
        _first_pass(
            frame, first, previous, difference, start, stop, by_row, by_column, squares, limits,
            lines,
        )  # fmt: skip

    over_rows(block, rows, threads)
    # Blocks are added in their order, whoever made them.
    broken, lowest, highest = zip(*limits.tolist(), strict=True)
    columns_summed, squares_summed = by_column.sum(0), squares.sum(0)
    return Passed(
        by_row, columns_summed, squares_summed, not any(broken), min(lowest), max(highest)
    )


class AllPassed(NamedTuple):
    """What passes over all frames found: as `Passed`, by frame, the range of all together."""

    by_row: Sums
    by_column: Sums
    squares: Sums
    whole: NDArray[np.bool_]
    lowest: int
    highest: int


def passes(frames: Frame) -> tuple[Frame, AllPassed]:
    """Return the differences of all frames (frame, row, column) from the first, and their sums."""
    count, rows, columns = frames.shape
    blocks = -(-rows // _BLOCK)
    differences = np.empty_like(frames)
    differences[0] = 0
    by_row, by_column = np.zeros((count, rows, 2)), np.zeros((count, blocks, 2, columns))
    squares, limits = np.zeros((count, blocks, 2, 2)), np.zeros((count, blocks, 3), np.int64)
    limits[:, :, 1], limits[:, :, 2] = _FAR, -_FAR
    _passes(frames, differences, by_row, by_column, squares, limits)
    return differences, AllPassed(
        by_row,
        by_column.sum(1),
        squares.sum(1),
        limits[:, :, 0].max(1) == 0,
        int(limits[:, :, 1].min()),
        int(limits[:, :, 2].max()),
    )


def no_change(frame: Frame) -> Passed:
    """Return what a pass over the first frame finds, which differs from itself by nothing."""
    rows, columns = frame.shape
    limits = np.array([0, _FAR, -_FAR])
    _limits(frame, limits)
    broken, lowest, highest = limits.tolist()
    nothing = np.zeros((rows, 2)), np.zeros((2, columns)), np.zeros((2, 2))
    return Passed(*nothing, not broken, lowest, highest)


@kernel
def _limits(frame: Frame, limits: NDArray[np.int64]) -> None:
    for y in range(frame.shape[0]):
        _take_limits(frame[y], limits)


@kernel
def _passes(
    frames: Frame,
    differences: Frame,
    by_row: Sums,
    by_column: Sums,
    squares: Sums,
    limits: NDArray[np.int64],
) -> None:
    """Pass over all frames; all arrays are by frame."""
    count, rows, columns = frames.shape
    lines = np.zeros((3, columns))
    _limits(frames[0], limits[0, 0])
    for i in range(1, count):
        _first_pass(
            frames[i], frames[0], differences[i - 1], differences[i], 0, rows, by_row[i],
            by_column[i], squares[i], limits[i], lines,
        )  # fmt: skip


@kernel
def _first_pass(
    frame: Frame,
    base: Frame,
    previous: Frame,
    difference: Frame,
    first: int,
    last: int,
    by_row: Sums,
    by_column: Sums,
    squares: Sums,
    limits: NDArray[np.int64],
    lines: Sums,
) -> None:
    """Use `lines` (3, column), zeros at first: of a row and of the changes in rows of a parity."""
    columns = frame.shape[1]
    folded = lines[2]
    for y in range(first, last):
        line, out, start, before = frame[y], difference[y], base[y], previous[y]
        into, squared = by_column[y // _BLOCK, y & 1], lines[y & 1]
        for x in range(columns):
            out[x] = line[x] - start[x]
        for x in range(columns):
            into[x] += out[x]
            folded[x] = out[x]
        for x in range(columns):
            change = np.float64(out[x] - before[x])
            squared[x] += change * change
        _fold(folded, by_row[y])
        _take_limits(line, limits[y // _BLOCK])
        if (y + 1) % _BLOCK == 0 or y + 1 == last:
            for p in range(2):
                _fold(lines[p], squares[y // _BLOCK, p])
                for x in range(columns):
                    lines[p, x] = 0.0


@inlined
def _fold(line: Sums, out: Sums) -> None:
    """Write the sums of the even and of the odd entries; halves are added until few are left."""
    left = line.size
    while left > 16:
        half = (left + 3) // 4 * 2
        for i in range(left - half):
            line[i] += line[half + i]
        left = half
    even, odd = 0.0, 0.0
    for i in range(left // 2):
        even += line[2 * i]
        odd += line[2 * i + 1]
    if left & 1:
        even += line[left - 1]
    out[0], out[1] = even, odd


@inlined
def _take_limits(line: Frame, limits: NDArray[np.int64]) -> None:
    """Widen (not whole, lowest, highest) by a line; the range is that of the whole numbers."""
    odd, low, high = np.int32(0), np.int32(_MOST), np.int32(-_MOST - 1)
    for x in range(line.size):  # in 32 bits: twice as many at a time
        code = np.int32(line[x])
        odd |= np.int32(np.float32(code) != line[x])  # also where it is not finite
        low, high = min(low, code), max(high, code)
    limits[0] |= odd
    limits[1], limits[2] = min(limits[1], np.int64(low)), max(limits[2], np.int64(high))
