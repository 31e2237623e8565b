"""What an image, or its lines, hold beyond coarser parts of the pattern."""

import numpy as np
from numpy.typing import NDArray

from dsis.compiled import inlined, kernel, over_rows

Array = NDArray[np.float64]


def pixel_residuals(
    image: Array, weights: Array, across: Array, threads: int = 1
) -> tuple[Array, Array, Array, float, float]:
    """Return what an image (row, column) holds beyond row means, column means and a surface.

    The surface is the sum over degrees of weights (row, degree) times across (degree, column); the
    first degree, the constant, is left out. Returns row means, column means, the pixels (row,
    column), the sum of their squares, and the variance of their squares.
    """
    n, m = image.shape
    by_row, by_column, mean = _line_means(image)
    pixels, by_line = np.empty((n, m)), np.empty((2, n))

    def residual(first: int, last: int) -> None:
        _residual(image, by_row, by_column, mean, weights, across, pixels, by_line[0], first, last)

    over_rows(residual, n, threads)
    squares = float(by_line[0].sum())

    def scatter(first: int, last: int) -> None:
        _scatter(pixels, squares / pixels.size, by_line[1], first, last)

    over_rows(scatter, n, threads)
    return by_row, by_column, pixels, squares, float(by_line[1].sum()) / pixels.size


@kernel
def _line_means(image: Array) -> tuple[Array, Array, float]:
    """Return the means of rows, of columns, and of all pixels."""
    n, m = image.shape
    by_row, by_column = np.empty(n), np.zeros(m)
    mean = 0.0
    for y in range(n):
        line, total = image[y], 0.0
        for x in range(m):
            total += line[x]
        for x in range(m):
            by_column[x] += line[x]
        by_row[y] = total / m
        mean += by_row[y]
    for x in range(m):
        by_column[x] /= n
    return by_row, by_column, mean / n


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
        for degree in range(1, across.shape[0]):
            weight, shape = weights[y, degree], across[degree]
            for x in range(out.size):
                out[x] -= weight * shape[x]
        total = 0.0
        for x in range(out.size):
            total += out[x] * out[x]
        squares[y] = total


@kernel
def _scatter(pixels: Array, mean: float, out: Array, first: int, last: int) -> None:
    """Write sums by row of (pixel^2 - mean)^2."""
    for y in range(first, last):
        line = pixels[y]
        total = 0.0
        for x in range(line.size):
            total += (line[x] * line[x] - mean) ** 2
        out[y] = total


@kernel
def line_residuals(means: Array, series: Array, basis: Array) -> tuple[float, float]:
    """Return sums of squares beyond a basis (line, degree), of means and of the wander of a series.

    Means (line); series (frame, line), about its mean over frames.
    """
    frames, lines = series.shape
    centre, line = np.zeros(lines), np.empty(lines)
    for t in range(frames):
        for i in range(lines):
            centre[i] += series[t, i]
    for i in range(lines):
        line[i] = means[i]
    spatial = _outside(line, basis)
    temporal = 0.0
    for t in range(frames):
        for i in range(lines):
            line[i] = series[t, i] - centre[i] / frames
        temporal += _outside(line, basis)
    return spatial, temporal


@inlined
def _outside(line: Array, basis: Array) -> float:
    """Return the sum of squares of a line less its projection, which is taken off in place."""
    inside = np.zeros(basis.shape[1])
    for i in range(line.size):
        for degree in range(basis.shape[1]):
            inside[degree] += basis[i, degree] * line[i]
    total = 0.0
    for i in range(line.size):
        for degree in range(basis.shape[1]):
            line[i] -= basis[i, degree] * inside[degree]
        total += line[i] * line[i]
    return total
