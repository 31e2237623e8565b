"""Steps of a map: between its halves, and between even and odd lines."""

from collections.abc import Callable
from functools import lru_cache
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.scalars import Number

Array = NDArray[np.float64]
Rest = Callable[[Array], Array]
"""What is left of means of lines (line,): of a decay beside uneven light, or of one alone."""
SMOOTH_DEGREE = 4  # of the polynomials along an axis
WHOLE = "halves as a whole"


def seams(by_row: Array, by_column: Array, squares: tuple[float, float]) -> dict[str, Number]:
    """Return the step between halves, and between even and odd lines, in its own noise.

    Each is the coefficient of its shape beside smooth polynomials, over its error; that of halves
    as a whole is not, and sees a tilt too.
    """
    found: dict[str, Number] = {}
    for axis, means, square, across in (
        ("rows", by_row, squares[0], by_column.size),
        ("columns", by_column, squares[1], by_row.size),
    ):
        sd = sqrt(square / across)
        for name, shape in _shapes(axis, means.size):
            found[name] = (float(shape.dot(means)) / sd, 1.0)
    return found


@lru_cache(maxsize=64)
def _shapes(axis: str, size: int) -> tuple[tuple[str, Array], ...]:
    """Return names and shapes of the steps of an axis' lines."""
    half, comb = seam_shapes(size)
    return (
        (f"half_seam of {axis}", half),
        (f"parity of {axis}", comb),
        (f"half_seam of {axis}, {WHOLE}", _halves(size)),
    )


@lru_cache(maxsize=64)
def _halves(size: int) -> Array:
    """Return the step between halves about its mean, of norm 1."""
    half = np.where(np.arange(size) < size / 2, -1.0, 1.0)
    return np.asarray((half - half.mean()) / (sqrt(size) * half.std()))


@lru_cache(maxsize=64)
def seam_shapes(size: int) -> tuple[Array, Array]:
    """Return the step between halves and the comb, less smooth polynomials, of norm 1."""
    line = np.arange(size)
    step, comb = np.where(line < size / 2, -0.5, 0.5), np.where(line % 2 == 0, -0.5, 0.5)
    rest = beyond_smooth(np.stack([step, comb], 1))
    rest /= np.linalg.norm(rest, axis=0)
    return np.ascontiguousarray(rest[:, 0]), np.ascontiguousarray(rest[:, 1])


def centred(values: Array) -> Array:
    """Return means of lines (line, ...) about theirs."""
    return np.asarray(values - values.mean(0))


def beyond_smooth(values: Array) -> Array:
    """Return means of lines (line, ...) less the smooth polynomials that fit them best."""
    smooth = _polynomials(len(values))
    return np.asarray(values - smooth @ np.linalg.lstsq(smooth, values, rcond=None)[0])


@lru_cache(maxsize=64)
def _polynomials(size: int) -> Array:
    """Return the smooth polynomials along so many lines: (line, degree)."""
    along = np.linspace(-1, 1, size)
    return np.asarray(np.polynomial.legendre.legvander(along, min(SMOOTH_DEGREE, size - 3)))
