"""Each pixel's moments over time from its sums over frames, and how the pixels scatter.

Two passes over the pixels, the same work about zero and then about the means it found. Nothing of
the size of a frame is kept but the two maps that are asked for.
"""

from typing import NamedTuple

import numpy as np

from dsis.compiled import ROWS_PER_BLOCK, kernel, over_rows
from dsis.measures.kernels import FiveSums, Frame, Sums

_BLOCK = ROWS_PER_BLOCK
_FIRST, _SECOND = 4, 10  # sums of powers, and of products of two
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
    size, t = n * m, frames
    variance, neighbour = np.empty(shape), np.empty(shape)
    by_block = np.empty((-(-n // _BLOCK), _FIRST + _SECOND))

    def summed(centre: tuple[float, ...]) -> Sums:
        numbers = np.array([t, kept, *centre])

        def block(start: int, stop: int) -> None:
            lines = np.empty((4 + _FIRST + _SECOND, m))
            _add_powers(
                *sums, last, *place, numbers, variance, neighbour, start, stop, lines, by_block
            )

        over_rows(block, n, threads)
        whole: Sums = by_block.sum(0) / size
        return whole

    square, cube, fourth, pairs, of_squares = summed((0.0,) * 7)[: _FIRST + 1].tolist()
    a = t**2 * (t + 1) / ((t - 1) * (t - 2) * (t - 3)) if t > 3 else 0.0
    b = 3 * (t - 1) / (t + 1)
    k4 = a * (fourth - b * of_squares)
    p = summed((square, cube, fourth, pairs, a, b, k4))[_FIRST:].tolist()
    some = of_squares > 0
    return variance, neighbour, Scatter(some, square, cube, fourth, pairs, k4, *p)


@kernel
def _add_powers(
    s1: Sums,
    s2: Sums,
    s3: Sums,
    s4: Sums,
    s11: Sums,
    end: Frame,
    y0: int,
    x0: int,
    step: int,
    numbers: Sums,
    variance: Sums,
    neighbour: Sums,
    first: int,
    last: int,
    lines: Sums,
    out: Sums,
) -> None:
    """Write the maps, and sums over blocks of rows (block, _FIRST + _SECOND), to `out`.

    `numbers`: frames, kept, means of square, cube, fourth and product, a, b, mean of k4. `lines`
    (4 + _FIRST + _SECOND, column) are what a row and its sums by column are kept in.
    """
    frames, kept, a, b, k4 = numbers[0], numbers[1], numbers[6], numbers[7], numbers[8]
    mean2, mean3, mean4, mean11 = numbers[2], numbers[3], numbers[4], numbers[5]
    square, cube, fourth, pairs, total = lines[0], lines[1], lines[2], lines[3], lines[4:]
    m = variance.shape[1]
    for y in range(first, last):
        line = y0 + y * step
        if y % _BLOCK == 0:
            total[:] = 0
        for x in range(m):
            i = x0 + x * step
            m1, m2, m3 = s1[line, i] / frames, s2[line, i] / frames, s3[line, i] / frames
            of_mean = m1 * m1
            square[x] = m2 - of_mean
            cube[x] = m3 - 3 * m1 * m2 + 2 * (of_mean * m1)
            m4 = s4[line, i] / frames
            fourth[x] = m4 - 4 * m1 * m3 + 6 * of_mean * m2 - 3 * (of_mean * of_mean)
            ends = 2 * frames * m1 - end[line, i]
            product = frames * (s11[line, i] / frames) - m1 * ends + (frames - 1) * of_mean
            pairs[x] = product / (frames - 1)
        for x in range(m):
            variance[y, x] = square[x] / kept
            neighbour[y, x] = pairs[x]
            d, e = square[x] - mean2, cube[x] - mean3
            dd = d * d
            total[0, x] += d
            total[1, x] += e
            total[4, x] += dd
            total[5, x] += dd * d
            total[6, x] += dd * dd
            total[7, x] += e * e
            total[8, x] += e * d
        for x in range(m):
            d, e, f = square[x] - mean2, fourth[x] - mean4, pairs[x] - mean11
            k = a * (fourth[x] - b * (square[x] * square[x])) - k4
            total[2, x] += e
            total[3, x] += f
            total[9, x] += e * e
            total[10, x] += e * d
            total[11, x] += f * f
            total[12, x] += f * d
            total[13, x] += k * k
        if (y + 1) % _BLOCK == 0 or y + 1 == last:
            for part in range(total.shape[0]):
                whole = 0.0
                for x in range(m):
                    whole += total[part, x]
                out[y // _BLOCK, part] = whole
