"""What an image, or its lines, hold beyond coarser parts of the pattern."""

import numpy as np
from numpy.typing import NDArray

from dsis.compiled import inlined, kernel, over_rows, pairwise_sum

Array = NDArray[np.float64]


def pixel_residuals(
    image: Array, weights: Array, across: Array, threads: int = 1
) -> tuple[Array, Array, Array, float, float]:
    """Return what an image (row, column) holds beyond row means, column means and a surface.

    The surface is the sum over degrees of weights (row, degree) times across (degree, column); the
    first degree, the constant, is left out. Returns row means, column means, the pixels (row,
    column), the sum of their squares, and the variance of their squares.
    """
    n = len(image)
    by_row, by_column, mean = _line_means(image)
    pixels, by_line = np.empty(image.shape), np.empty((2, n))

    def residual(first: int, last: int) -> None:
        _residual(image, by_row, by_column, mean, weights, across, pixels, by_line[0], first, last)

    over_rows(residual, n, threads)
    squares = pairwise_sum(by_line[0])

    def scatter(first: int, last: int) -> None:
        _scatter(pixels, squares / pixels.size, by_line[1], first, last)

    over_rows(scatter, n, threads)
    return by_row, by_column, pixels, squares, pairwise_sum(by_line[1]) / pixels.size


@kernel
def _line_means(image: Array) -> tuple[Array, Array, float]:
    """Return the means of rows and of columns, and the mean of them."""
    n, m = image.shape
    by_row, by_column = np.empty(n), np.zeros(m)
    for y in range(n):
        line = image[y]
        by_row[y] = pairwise_sum(line) / m
        for x in range(m):
            by_column[x] += line[x]
    for x in range(m):
        by_column[x] /= n
    return by_row, by_column, pairwise_sum(by_row) / n


@kernel
def _residual(
    image: Array,
    by_row: Array,
    by_column: Array,
    mean: float,
    weights: Array,
    across: Array,
    pixels: Array,
    squares: Array,
    first: int,
    last: int,
) -> None:
    """Write an image less rows, columns and sum of weights(row, d) across(d, column)."""
    for y in range(first, last):
        line, out = image[y], pixels[y]
        for x in range(out.size):
            out[x] = line[x] - by_row[y] - by_column[x] + mean
        degree = 1
        while degree + 3 <= across.shape[0]:  # three at a time: a line is written less often
            a, b, c = weights[y, degree], weights[y, degree + 1], weights[y, degree + 2]
            one, two, three = across[degree], across[degree + 1], across[degree + 2]
            for x in range(out.size):
                out[x] = out[x] - a * one[x] - b * two[x] - c * three[x]
            degree += 3
        while degree < across.shape[0]:
            weight, shape = weights[y, degree], across[degree]
            for x in range(out.size):
                out[x] -= weight * shape[x]
            degree += 1
        squares[y] = _squares(out, 0.0, 1)


@kernel
def _scatter(pixels: Array, mean: float, out: Array, first: int, last: int) -> None:
    """Write sums over lines of the squares' squares about their mean."""
    for y in range(first, last):
        out[y] = _squares(pixels[y], mean, 2)


@inlined
def _squares(line: Array, mean: float, power: int) -> float:
    """Return the sum of squares of a line, or of its squares about their mean.

    Of four parts, which do not wait for one another.
    """
    a = b = c = d = 0.0
    end = line.size // 4 * 4
    for i in range(0, end, 4):
        p, q, r, s = line[i], line[i + 1], line[i + 2], line[i + 3]
        if power > 1:
            p, q, r, s = p * p - mean, q * q - mean, r * r - mean, s * s - mean
        a += p * p
        b += q * q
        c += r * r
        d += s * s
    for i in range(end, line.size):
        p = line[i] * line[i] - mean if power > 1 else line[i]
        a += p * p
    return (a + b) + (c + d)


def line_residuals(means: Array, series: Array, basis: Array) -> tuple[Array, Array]:
    """Return sums of squares beyond a basis (line, degree), of means and of the wander of a series.

    Means (plane, line); series (plane, frame, line), about its mean over frames. Sums (plane,).
    """
    wander = series - series.sum(1, keepdims=True) / series.shape[1]
    return _outside(means[:, np.newaxis], basis), _outside(wander, basis)


def _outside(lines: Array, basis: Array) -> Array:
    """Return the sum of squares of lines (plane, any, line) less their projections."""
    left = (lines - lines @ basis @ basis.T).reshape(len(lines), -1)
    squares: Array = np.vecdot(left, left)
    return squares
