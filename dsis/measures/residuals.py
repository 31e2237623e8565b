"""What an image, or its lines, hold beyond coarser parts of the pattern."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from dsis.compiled import kernel, over_rows

Array = NDArray[np.float64]
_PIXELS_IN_CACHE = 1 << 15


def pixel_residuals(
    image: Array, weights: Array, across: Array, threads: int = 1
) -> tuple[Array, Array, Array, float, float]:
    """Return what an image (row, column) holds beyond row means, column means and a surface.

    The surface is the sum over degrees of weights (row, degree) times across (degree, column); the
    first degree, the constant, is left out. Returns row means, column means, the pixels (row,
    column), the sum of their squares, and the variance of their squares.
    """
    n, m = image.shape
    by_row, by_column = image.sum(1) / m, image.sum(0) / n
    mean = by_row.sum() / n
    pixels, by_line = np.empty((n, m)), np.empty((2, n))

    def residual(first: int, last: int) -> None:
        _residual(image, by_row, by_column, mean, weights, across, pixels, by_line[0], first, last)

    over_rows(residual, n, threads)
    squares = float(by_line[0].sum())

    def scatter(first: int, last: int) -> None:
        for part in _in_cache(first, last, m):
            beyond = pixels[part] * pixels[part] - squares / pixels.size
            by_line[1, part] = np.einsum("yx,yx->y", beyond, beyond)

    over_rows(scatter, n, threads)
    return by_row, by_column, pixels, squares, float(by_line[1].sum()) / pixels.size


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


def _in_cache(first: int, last: int, columns: int) -> Iterator[slice]:
    """Yield runs of rows first..last-1 whose intermediate results stay in the cache."""
    rows = max(1, _PIXELS_IN_CACHE // columns)
    for top in range(first, last, rows):
        yield slice(top, min(top + rows, last))


def line_residuals(means: Array, series: Array, basis: Array) -> tuple[float, float]:
    """Return sums of squares beyond a basis (line, degree), of means and of the wander of a series.

    Means (line); series (frame, line), about its mean over frames.
    """
    return _outside(means[np.newaxis], basis), _outside(series - series.sum(0) / len(series), basis)


def _outside(lines: Array, basis: Array) -> float:
    """Return the sum of squares of lines (any, line) less their projections."""
    inside = np.einsum("tl,ld->td", lines, basis)
    left = lines - np.einsum("td,ld->tl", inside, basis)
    return float(np.einsum("tl,tl->", left, left))
