"""Each pixel's moments over time from its sums over frames, and how the pixels scatter.

Two passes over the pixels: sums of powers about zero, then of products about the means found.
Nothing of the size of a frame is kept but the two maps that are asked for.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dsis.compiled import ROWS_PER_BLOCK, inlined, kernel, over_rows
from dsis.measures.kernels import FiveSums, Frame, Sums

_BLOCK = ROWS_PER_BLOCK
_FIRST, _SECOND = 4, 10  # sums of powers, and of products of two
_OF_PAIRS, _ABOUT_MEANS = 2, 5  # the same where there are two frames
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
    sums: FiveSums, last: Frame, frames: int, places: NDArray[np.int64], shape: tuple[int, int],
    kept: float, threads: int,
) -> list[tuple[Sums, Sums, Scatter]]:  # fmt: skip
    """Return variance map, neighbour map (row, column) and scatter of channels of one size.

    Parameters
    ----------
    sums
        Over frames, of u, u^2, u^3, u^4 and u times the previous u: (row, column) of the array.
        The first u is zero.
    last
        The last u.
    frames
        Number of frames T.
    places, shape
        Where the pixels of each channel lie in the array, (channel, 3) as `Place`, and how many
        rows and columns they are.
    kept
        Share of a pixel's variance that its residual has: squares are divided by it.
    threads
        Threads that may be used.
    """
    (n, m), count, t = shape, len(places), frames
    variance, neighbour = np.empty((count, n, m)), np.empty((count, n, m))
    by_block = np.empty((count, -(-n // _BLOCK), _FIRST + _SECOND))
    numbers = np.zeros((count, 9))
    numbers[:, 0], numbers[:, 1] = t, kept

    def summed(*, about_zero: bool) -> Sums:
        def block(start: int, stop: int) -> None:
            _add_powers(
                *sums, last, places, numbers, about_zero, variance, neighbour, start, stop, by_block
            )

        over_rows(block, n, threads)
        whole: Sums = by_block.sum(1) / (n * m)
        return whole

    powers = summed(about_zero=True)
    a = t**2 * (t + 1) / ((t - 1) * (t - 2) * (t - 3)) if t > 3 else 0.0
    b = 3 * (t - 1) / (t + 1)
    numbers[:, 2:6], numbers[:, 6], numbers[:, 7] = powers[:, :_FIRST], a, b
    numbers[:, 8] = a * (powers[:, 2] - b * powers[:, 4])
    products = summed(about_zero=False)
    found = []
    for k, own in enumerate(powers.tolist()):
        square, cube, fourth, pairs, of_squares = own[: _FIRST + 1]
        k4, p = float(numbers[k, 8]), products[k, _FIRST:].tolist()
        scatter = Scatter(of_squares > 0, square, cube, fourth, pairs, k4, *p)
        found.append((variance[k], neighbour[k], scatter))
    return found


def pair_moments(
    last: Frame, place: Place, shape: tuple[int, int], kept: float, threads: int
) -> tuple[Sums, Sums, Scatter]:
    """Return the same as `pixel_moments` for two frames, from the second one's u alone.

    Residuals are u / 2 and -u / 2: u^2 / 4 is the mean square s, 0 the mean cube, s^2 the mean
    fourth power, -s the mean product.
    """
    n, m = shape
    variance, blocks = np.empty(shape), -(-n // _BLOCK)
    powers, products = np.empty((blocks, _OF_PAIRS)), np.empty((blocks, _ABOUT_MEANS))

    def of_powers(start: int, stop: int) -> None:
        lines = np.empty((1 + _OF_PAIRS, m))
        _add_pairs(last, *place, kept, variance, start, stop, lines, powers)

    over_rows(of_powers, n, threads)
    square, fourth = (powers.sum(0) / (n * m)).tolist()

    def of_products(start: int, stop: int) -> None:
        lines = np.empty((1 + _ABOUT_MEANS, m))
        _add_pair_products(last, *place, square, fourth, start, stop, lines, products)

    over_rows(of_products, n, threads)
    squares, squares_3, squares_4, fourths, both = (products.sum(0) / (n * m)).tolist()
    scatter = Scatter(
        fourth > 0,
        square,
        0.0,
        fourth,
        -square,
        0.0,
        squares,
        squares_3,
        squares_4,
        0.0,
        0.0,
        fourths,
        both,
        squares,
        -squares,
        0.0,
    )
    return variance, variance * -kept, scatter


@inlined
def _sum_powers(square: Sums, cube: Sums, fourth: Sums, pairs: Sums, total: Sums) -> None:
    """Add the powers of a row, and squares squared, to sums by column."""
    for x in range(square.size):
        total[0, x] += square[x]
        total[1, x] += cube[x]
        total[2, x] += fourth[x]
        total[3, x] += pairs[x]
        total[4, x] += square[x] * square[x]


@inlined
def _sum_products(
    square: Sums, cube: Sums, fourth: Sums, pairs: Sums, numbers: Sums, total: Sums
) -> None:
    """Add products of the powers of a row about their means to sums by column."""
    mean2, mean3, mean4, mean11 = numbers[2], numbers[3], numbers[4], numbers[5]
    a, b, k4 = numbers[6], numbers[7], numbers[8]
    for x in range(square.size):
        d, e = square[x] - mean2, cube[x] - mean3
        dd = d * d
        total[4, x] += dd
        total[5, x] += dd * d
        total[6, x] += dd * dd
        total[7, x] += e * e
        total[8, x] += e * d
    for x in range(square.size):
        d, e, f = square[x] - mean2, fourth[x] - mean4, pairs[x] - mean11
        k = a * (fourth[x] - b * (square[x] * square[x])) - k4
        total[9, x] += e * e
        total[10, x] += e * d
        total[11, x] += f * f
        total[12, x] += f * d
        total[13, x] += k * k


@kernel
def _add_powers(
    s1: Sums,
    s2: Sums,
    s3: Sums,
    s4: Sums,
    s11: Sums,
    end: Frame,
    places: NDArray[np.int64],
    numbers: Sums,
    about_zero: bool,
    variance: Sums,
    neighbour: Sums,
    first: int,
    last: int,
    out: Sums,
) -> None:
    """Write sums over blocks of rows of each channel, (channel, block, _FIRST + _SECOND) to `out`.

    About zero these are the sums of powers and of squares squared, and the maps (channel, row,
    column) are written, too; else those of products of two. `numbers` (channel, any): frames, kept,
    means of square, cube, fourth and product, a, b, mean of k4.
    """
    lines = np.empty((10 + _FIRST + _SECOND, variance.shape[2]))
    for k in range(len(places)):
        _add_powers_of(
            s1, s2, s3, s4, s11, end, places[k], numbers[k], about_zero, variance[k], neighbour[k],
            first, last, lines, out[k],
        )  # fmt: skip


@kernel
def _add_powers_of(
    s1: Sums,
    s2: Sums,
    s3: Sums,
    s4: Sums,
    s11: Sums,
    end: Frame,
    place: NDArray[np.int64],
    numbers: Sums,
    about_zero: bool,
    variance: Sums,
    neighbour: Sums,
    first: int,
    last: int,
    lines: Sums,
    out: Sums,
) -> None:
    """Do the same for one channel.

    `lines` (10 + _FIRST + _SECOND, column) are what a row, its powers and its sums by column are
    kept in: loops over them alone are vector instructions, whatever the step.
    """
    y0, x0, step = place
    frames, kept = numbers[0], numbers[1]
    square, cube, fourth, pairs, total = lines[0], lines[1], lines[2], lines[3], lines[10:]
    r1, r2, r3, r4, r11, r_end = lines[4], lines[5], lines[6], lines[7], lines[8], lines[9]
    m = variance.shape[1]
    for y in range(first, last):
        line = y0 + y * step
        if y % _BLOCK == 0:
            total[:] = 0
        for x in range(m):
            i = x0 + x * step
            r1[x], r2[x], r3[x] = s1[line, i], s2[line, i], s3[line, i]
            r4[x], r11[x], r_end[x] = s4[line, i], s11[line, i], end[line, i]
        for x in range(m):
            m1, m2, m3, m4 = r1[x] / frames, r2[x] / frames, r3[x] / frames, r4[x] / frames
            of_mean = m1 * m1
            square[x] = m2 - of_mean
            cube[x] = m3 - 3 * m1 * m2 + 2 * (of_mean * m1)
            fourth[x] = m4 - 4 * m1 * m3 + 6 * of_mean * m2 - 3 * (of_mean * of_mean)
            ends = 2 * frames * m1 - r_end[x]
            product = frames * (r11[x] / frames) - m1 * ends + (frames - 1) * of_mean
            pairs[x] = product / (frames - 1)
        if about_zero:
            for x in range(m):
                variance[y, x] = square[x] / kept
                neighbour[y, x] = pairs[x]
            _sum_powers(square, cube, fourth, pairs, total)
        else:
            _sum_products(square, cube, fourth, pairs, numbers, total)
        if (y + 1) % _BLOCK == 0 or y + 1 == last:
            _write_sums(total, out[y // _BLOCK])


@kernel
def _write_sums(total: Sums, out: Sums) -> None:
    """Write the sum of each row of `total` (part, column)."""
    for part in range(total.shape[0]):
        whole = 0.0
        for x in range(total.shape[1]):
            whole += total[part, x]
        out[part] = whole


@kernel
def _add_pairs(
    last: Frame,
    y0: int,
    x0: int,
    step: int,
    kept: float,
    variance: Sums,
    first: int,
    stop: int,
    lines: Sums,
    out: Sums,
) -> None:
    """Write sums over blocks of rows (block, `_OF_PAIRS`) to `out`, and the variance map.

    Of the mean square s and its square. `lines` are what a row and its sums by column are kept in.
    """
    square, total = lines[0], lines[1:]
    for y in range(first, stop):
        if y % _BLOCK == 0:
            total[:] = 0
        _mean_squares(last[y0 + y * step], x0, step, square)
        for x in range(square.size):
            s = square[x]
            variance[y, x] = s / kept
            total[0, x] += s
            total[1, x] += s * s
        if (y + 1) % _BLOCK == 0 or y + 1 == stop:
            _write_sums(total, out[y // _BLOCK])


@kernel
def _add_pair_products(
    last: Frame,
    y0: int,
    x0: int,
    step: int,
    mean2: float,
    mean4: float,
    first: int,
    stop: int,
    lines: Sums,
    out: Sums,
) -> None:
    """Write sums over blocks of rows (block, `_ABOUT_MEANS`) to `out`: d^2, d^3, d^4, f^2, f d.

    d and f are the mean square and its square about their means. `lines` as of `_add_pairs`.
    """
    square, total = lines[0], lines[1:]
    for y in range(first, stop):
        if y % _BLOCK == 0:
            total[:] = 0
        _mean_squares(last[y0 + y * step], x0, step, square)
        for x in range(square.size):
            d = square[x] - mean2
            f = square[x] * square[x] - mean4
            total[0, x] += d * d
            total[1, x] += d * d * d
            total[2, x] += d * d * (d * d)
            total[3, x] += f * f
            total[4, x] += f * d
        if (y + 1) % _BLOCK == 0 or y + 1 == stop:
            _write_sums(total, out[y // _BLOCK])


@inlined
def _mean_squares(line: Frame, x0: int, step: int, square: Sums) -> None:
    """Write the mean square of two residuals: u / 2 and -u / 2."""
    for x in range(square.size):
        u = np.float64(line[x0 + x * step])
        square[x] = u * u / 4
