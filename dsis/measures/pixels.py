"""Each pixel's moments over time from its sums over frames, and how the pixels scatter.

Two passes over the pixels: maps and means, then products of deviations from the means. Nothing of
the size of a frame is kept but the two maps that are asked for.
"""

from typing import NamedTuple

import numpy as np

from dsis.compiled import ROWS_PER_BLOCK, inlined, kernel, over_rows
from dsis.measures.kernels import FiveSums, Frame, Sums

_BLOCK = ROWS_PER_BLOCK
_MEANS, _PRODUCTS = 5, 10
Place = tuple[int, int, int]
"""First row, first column and step of a channel."""


class Scatter(NamedTuple):
    """Means over the pixels of a channel, of the mean powers of a residual over time.

    Attributes
    ----------
    any
        Whether any pixel shows noise.
    square, cube, fourth, neighbour
        Means of u^2, u^3, u^4 and u times the next frame's u.
    k4
        Mean of Fisher's k4 of each pixel; 0 with fewer than four frames, as is its variance.
    squares, squares_3, squares_4
        Second, third and fourth central moment of u^2.
    cubes, cube_square, fourths, fourth_square, neighbours, neighbour_square
        Variances, and covariances with u^2.
    k4_squares
        Variance of Fisher's k4.
    """

    any: bool
    square: float
    cube: float
    fourth: float
    neighbour: float
    k4: float
    squares: float
    squares_3: float
    squares_4: float
    cubes: float
    cube_square: float
    fourths: float
    fourth_square: float
    neighbours: float
    neighbour_square: float
    k4_squares: float


def pixel_moments(
    sums: FiveSums, last: Frame, frames: int, place: Place, shape: tuple[int, int], kept: float,
    threads: int,
) -> tuple[Sums, Sums, Scatter]:  # fmt: skip
    """Return variance map, neighbour map (row, column) and scatter of one channel.

    Parameters
    ----------
    sums
        Over frames, of u, u^2, u^3, u^4 and u times the previous u: (row, column) of the array.
        The first u is zero.
    last
        The last u.
    frames
        Number of frames T.
    place, shape
        Where the channel's pixels lie in the array, and how many rows and columns they are.
    kept
        Share of a pixel's variance that its residual has: squares are divided by it.
    threads
        Threads that may be used.
    """
    n, m = shape
    blocks, size, t = -(-n // _BLOCK), n * m, frames
    variance, neighbour = np.empty(shape), np.empty(shape)
    first, second = np.empty((blocks, _MEANS)), np.empty((blocks, _PRODUCTS))

    def maps(start: int, stop: int) -> None:
        _maps(sums, last, t, place, kept, variance, neighbour, start, stop, first)

    over_rows(maps, n, threads)
    means = first.sum(0) / size
    a = t**2 * (t + 1) / ((t - 1) * (t - 2) * (t - 3)) if t > 3 else 0.0
    b = 3 * (t - 1) / (t + 1)
    k4 = a * (means[2] - b * means[4])

    def products(start: int, stop: int) -> None:
        _products(sums, last, t, place, means, (a, b, k4), m, start, stop, second)

    over_rows(products, n, threads)
    p: list[float] = (second.sum(0) / size).tolist()
    square, cube, fourth, pairs, of_squares = means.tolist()
    some = of_squares > 0
    return variance, neighbour, Scatter(some, square, cube, fourth, pairs, k4, *p)


@kernel
def _maps(
    sums: FiveSums,
    last: Frame,
    frames: int,
    place: Place,
    kept: float,
    variance: Sums,
    neighbour: Sums,
    first: int,
    last_row: int,
    out: Sums,
) -> None:
    m = variance.shape[1]
    rows, total = np.empty((4, m)), np.empty((_MEANS, m))
    square, cube, fourth, pairs = rows[0], rows[1], rows[2], rows[3]
    for start in range(first, last_row, _BLOCK):
        total[:] = 0
        for y in range(start, min(start + _BLOCK, last_row)):
            _row(sums, last, frames, place, y, rows)
            into, beside = variance[y], neighbour[y]
            for x in range(m):
                into[x] = square[x] / kept
                beside[x] = pairs[x]
            for x in range(m):
                total[0, x] += square[x]
                total[1, x] += cube[x]
                total[2, x] += fourth[x]
                total[3, x] += pairs[x]
                total[4, x] += square[x] * square[x]
        _over_columns(total, out[start // _BLOCK])


@kernel
def _products(
    sums: FiveSums,
    last: Frame,
    frames: int,
    place: Place,
    means: Sums,
    k: tuple[float, float, float],
    m: int,
    first: int,
    last_row: int,
    out: Sums,
) -> None:
    rows, total = np.empty((4, m)), np.empty((_PRODUCTS, m))
    square, cube, fourth, pairs = rows[0], rows[1], rows[2], rows[3]
    a, b, k4 = k
    mean2, mean3, mean4, mean11 = means[0], means[1], means[2], means[3]
    for start in range(first, last_row, _BLOCK):
        total[:] = 0
        for y in range(start, min(start + _BLOCK, last_row)):
            _row(sums, last, frames, place, y, rows)
            for x in range(m):
                d = square[x] - mean2
                dd = d * d
                total[0, x] += dd
                total[1, x] += dd * d
                total[2, x] += dd * dd
                e = cube[x] - mean3
                total[3, x] += e * e
                total[4, x] += e * d
            for x in range(m):
                d = square[x] - mean2
                e = fourth[x] - mean4
                total[5, x] += e * e
                total[6, x] += e * d
                e = pairs[x] - mean11
                total[7, x] += e * e
                total[8, x] += e * d
                e = a * (fourth[x] - b * (square[x] * square[x])) - k4
                total[9, x] += e * e
        _over_columns(total, out[start // _BLOCK])


@inlined
def _row(sums: FiveSums, last: Frame, frames: int, place: Place, y: int, out: Sums) -> None:
    """Write mean square, cube, fourth power and product with the next frame of a row of pixels."""
    y0, x0, step = place
    line = y0 + y * step
    s1, s2, s3 = sums[0][line, x0::step], sums[1][line, x0::step], sums[2][line, x0::step]
    s4, s11, end = sums[3][line, x0::step], sums[4][line, x0::step], last[line, x0::step]
    pairs = frames - 1
    for x in range(out.shape[1]):
        m1, m2, m3 = s1[x] / frames, s2[x] / frames, s3[x] / frames
        square = m1 * m1
        out[0, x] = m2 - square
        out[1, x] = m3 - 3 * m1 * m2 + 2 * (square * m1)
        out[2, x] = s4[x] / frames - 4 * m1 * m3 + 6 * square * m2 - 3 * (square * square)
        ends = 2 * frames * m1 - end[x]
        out[3, x] = (frames * (s11[x] / frames) - m1 * ends + pairs * square) / pairs


@inlined
def _over_columns(total: Sums, out: Sums) -> None:
    for k in range(total.shape[0]):
        whole = 0.0
        for x in range(total.shape[1]):
            whole += total[k, x]
        out[k] = whole
