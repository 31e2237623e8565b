"""Running sums of one exposure in whole numbers: exact, whatever the order.

Columns keep their place and rows their parity, so that one pass serves every colour filter array.

`dsis.measures` has sums of its own, and the two stay apart: it follows every pixel through four
powers and a spectrum per frame, in floating point, which costs some thirty times as much; the pair
difference method needs none of it, and is exact for codes. Tests hold one against the other.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dsis.compiled import kernel

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]


@dataclass
class Sums:
    """Running sums of one exposure; columns keep their place, rows their parity."""

    reference: int
    total: NDArray[np.int32]  # (R, C): sum over frames of code - reference
    rows: list[Ints]  # per frame (R, 2): row sums by column parity
    columns: list[Ints]  # per frame (2, C): column sums by row parity
    squares: Ints  # (2, C)
    clipped: Ints  # (2, 2, C): low, high
    pairs: list[tuple[Ints, Ints, Floats]]  # per pair (2, C): d, d^2, d^4
    repeats: int = 0


def begin(frame: NDArray[np.uint16]) -> Sums:
    """Return the empty sums of an exposure whose first frame is `frame`."""
    rows, columns = frame.shape
    return Sums(
        # Near the data, so that the integers stay small.
        round(float(frame.mean())),
        np.zeros((rows, columns), np.int32),
        [],
        [],
        np.zeros((2, columns), np.int64),
        np.zeros((2, 2, columns), np.int64),
        [],
    )


@kernel
def add_frame(
    frame: NDArray[np.uint16],
    reference: int,
    white: int,
    total: NDArray[np.int32],
    row_sums: Ints,
    column_sums: Ints,
    squares: Ints,
    clipped: Ints,
) -> None:
    """Add a frame: sums by pixel, row and column, squares, and codes at either end."""
    rows, columns = frame.shape
    line = np.empty(columns, np.int32)
    ref, top = np.int32(reference), np.int32(white)
    for r in range(rows):
        p = r % 2
        source, kept = frame[r], total[r]
        sums, square, low, high = column_sums[p], squares[p], clipped[0, p], clipped[1, p]
        for c in range(np.uintp(columns)):
            code = np.int32(source[c])
            x = np.int32(code - ref)
            line[c] = x
            kept[c] += x
            sums[c] += x
            square[c] += np.int64(x) * np.int64(x)
        extremes = np.int32(0)
        for c in range(np.uintp(columns)):
            code = np.int32(source[c])
            extremes += np.int32(code == 0) + np.int32(code >= top)
        if extremes > 0:
            for c in range(columns):
                low[c] += source[c] == 0
                high[c] += source[c] >= top
        even = np.int64(0)
        odd = np.int64(0)
        for c in range(columns // 2):
            even += np.int64(line[2 * c])
            odd += np.int64(line[2 * c + 1])
        if columns % 2:
            even += np.int64(line[columns - 1])
        row_sums[r, 0], row_sums[r, 1] = even, odd


@kernel
def add_pair(
    frame: NDArray[np.uint16], previous: NDArray[np.uint16], d1: Ints, d2: Ints, d4: Floats
) -> None:
    """Add the difference of two frames: its sum, square and fourth power by column."""
    rows, columns = frame.shape
    for r in range(rows):
        p = r % 2
        a, b, s1, s2, s4 = frame[r], previous[r], d1[p], d2[p], d4[p]
        for c in range(np.uintp(columns)):
            d = np.int32(np.int32(a[c]) - np.int32(b[c]))
            square = np.float64(d) * np.float64(d)
            s1[c] += d
            s2[c] += np.int64(d) * np.int64(d)
            s4[c] += square * square


@kernel
def square_total(total: NDArray[np.int32], squares: Ints) -> None:
    """Add up the squares of the pixels' sums by row parity and column."""
    rows, columns = total.shape
    for r in range(rows):
        source, out = total[r], squares[r % 2]
        for c in range(np.uintp(columns)):
            out[c] += np.int64(source[c]) * np.int64(source[c])
