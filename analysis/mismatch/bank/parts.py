"""The parts of a map: pixels, lines and smooth surfaces, and the numbers of each."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import log, sqrt

import numpy as np
from numpy.typing import ArrayLike, NDArray

from analysis.mismatch.bank.edges import edges
from analysis.mismatch.bank.patches import patches
from analysis.mismatch.bank.scalars import Number, ratio_root
from analysis.mismatch.bank.seams import seams
from analysis.mismatch.bank.surfaces import slopes, surfaces
from dsis.compiled import kernel
from dsis.measures.fixed_pattern import Smooth
from dsis.measures.residuals import pixel_residuals

Array = NDArray[np.float64]
_FAR_OUT, _FEW = 5.0, 0.01  # standard deviations of single pixels, and their share at most
_CHANCE = 3.0  # standard errors of a mean square
_LEAST = 1e-30  # square of a pixel, in units of its noise: all may be alike
STANDING_OUT = (3.5, 5.0, 8.0)  # standard deviations of a map above its middle
OUTLYING = tuple(f"outlying_pixels of {limit:g}" for limit in STANDING_OUT)


@dataclass(frozen=True)
class Parts:
    """A map split by the hierarchy pixel -> row and column -> smooth surface.

    Attributes
    ----------
    pixels
        What is left of the map: (row, column).
    rows, columns
        Line means beyond smooth ones: (row), (column).
    square
        Mean square of the pixels per degree of freedom.
    coefficients
        Of smooth polynomials (row degree, column degree), in units of the map's noise.
    numbers
        The statistics.
    """

    pixels: Array
    rows: Array
    columns: Array
    square: float
    coefficients: Array
    numbers: Mapping[str, Number]


def parts(image: Array, noise: float) -> Parts:
    """Return the hierarchy of a map (row, column) whose noise per pixel is known."""
    n, m = image.shape
    smooth = Smooth.of(n, m)
    unit = (image - image.sum() / image.size) / noise
    coefficients = smooth.coefficients(unit)
    by_row, by_column, pixels, squares, scatter = pixel_residuals(
        unit, smooth.weights(coefficients), smooth.across
    )
    dof = (n - 1) * (m - 1) - smooth.kinds
    square = max(squares / dof, _LEAST)
    rows = by_row - smooth.along_rows @ (smooth.along_rows.T @ by_row)
    columns = by_column - smooth.along_columns @ (smooth.along_columns.T @ by_column)
    degree = smooth.degree
    row = m * float(rows @ rows) / (n - 1 - degree)
    column = n * float(columns @ columns) / (m - 1 - degree)
    mean_square, sd = max(squares / pixels.size, _LEAST), sqrt(square)
    *above, far = _above(pixels, sd, *STANDING_OUT, _FAR_OUT)
    lines = (
        sure_of_lines(row, square, n - 1 - degree),
        sure_of_lines(column, square, m - 1 - degree),
    )
    numbers = {
        "fixed_pixel_variance": ratio_root(square, dof),
        "fixed_row_variance": ratio_root(row / square, n - 1 - degree, dof),
        "fixed_column_variance": ratio_root(column / square, m - 1 - degree, dof),
        **surfaces(coefficients, (*lines, square), dof),
        **slopes(coefficients, (*lines, square), image.shape),
        **_correlations(pixels, mean_square),
        **patches(pixels, square),
        "outlying_pixels": _outlying(scatter + mean_square**2, square, pixels.size),
        **{name: (root_of(n), 1.0) for name, n in zip(OUTLYING, above, strict=True)},
        **seams(by_row, by_column, lines),
        **edges(*_of_many(pixels, sd, far, by_row, by_column), lines),
    }
    return Parts(pixels, rows, columns, square, coefficients, numbers)


def sure_of_lines(lines: float, pixels: float, dof: float) -> float:
    """Return the mean square of line means that is beyond chance, that of pixels at least.

    What is compared with it must not scatter as the mean square of few lines does: a clear tilt in
    units of a noise that is one tenth too large would be off by many standard errors.
    """
    return max(pixels, lines / (1 + _CHANCE * sqrt(2 / dof)))


def _of_many(
    pixels: Array, sd: float, far: int, by_row: Array, by_column: Array
) -> tuple[Array, Array]:
    """Return line means without what few pixels, so many, that stand far out add to them."""
    if not 0 < far < _FEW * pixels.size:
        return by_row, by_column
    y, x = np.nonzero(np.abs(pixels) > _FAR_OUT * sd)
    own = pixels[y, x]
    row = by_row - np.bincount(y, own, by_row.size) / by_column.size
    return row, by_column - np.bincount(x, own, by_column.size) / by_row.size


def _correlations(pixels: Array, square: float) -> dict[str, Number]:
    n, m = pixels.shape
    sd = 1 / sqrt(pixels.size)
    beside, below = _neighbours(pixels)
    return {
        "fixed_correlation_0_1": (float(beside) / (n * (m - 1)) / square, sd),
        "fixed_correlation_1_0": (float(below) / ((n - 1) * m) / square, sd),
    }


@kernel
def _neighbours(pixels: Array) -> tuple[float, float]:
    """Return the sums of products of neighbours in a row, and in a column."""
    rows, columns = pixels.shape
    beside, below = 0.0, 0.0
    for y in range(rows):
        line, total = pixels[y], 0.0
        for x in range(1, columns):
            total += line[x - 1] * line[x]
        beside += total
        if y:
            total, above = 0.0, pixels[y - 1]
            for x in range(columns):
                total += above[x] * line[x]
            below += total
    return beside, below


def _outlying(fourth: float, square: float, size: int) -> Number:
    """Return the excess kurtosis of a map: few pixels that stand far out."""
    return log(max(fourth / square**2, 0.1) / 3), sqrt(24 / size) / 3


@kernel
def _above(
    pixels: Array, sd: float, low: float, middle: float, high: float, either: float
) -> tuple[int, int, int, int]:
    """Return how many pixels lie above so many standard deviations, and farther to either side."""
    by_low = by_middle = by_high = far = 0
    for value in pixels.reshape(-1):
        if value > low * sd:
            by_low += 1
            by_middle += int(value > middle * sd)
            by_high += int(value > high * sd)
        far += int(abs(value) > either * sd)
    return by_low, by_middle, by_high, far


def root_of(count: float) -> float:
    """Return what `rooted` does of a single count."""
    return 2 * sqrt(count + 3 / 8)


def rooted(count: ArrayLike) -> Array:
    """Return twice the root of counts, of standard deviation 1 (Anscombe 1948)."""
    return np.asarray(2 * np.sqrt(np.asarray(count) + 3 / 8))


def counted(root: Array) -> Array:
    """Return the counts of such roots."""
    return np.asarray((root / 2) ** 2 - 3 / 8)
