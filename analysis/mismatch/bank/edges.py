"""Decays of a map from its edges: lines that begin, or end, before the read-out has settled."""

from collections.abc import Iterator
from functools import lru_cache
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.robust import typical_square
from analysis.mismatch.bank.scalars import UNKNOWN, Number
from analysis.mismatch.bank.seams import beyond_smooth

Array = NDArray[np.float64]
ENDS = ("first", "last")
REACHES = {"near": 2.5, "far": 10.0}  # pixels of the plane after which 1 / e is left
LEAST_LINES = 24  # fewer are a smooth surface


def edges(by_row: Array, by_column: Array, squares: tuple[float, float]) -> dict[str, Number]:
    """Return how line means decay from each edge, over two reaches, in their own noise.

    Each is the coefficient of exp(-d / reach) beside smooth polynomials, over its error.
    """
    found: dict[str, Number] = {}
    for axis, means, square, across in (
        ("rows", by_row, squares[0], by_column.size),
        ("columns", by_column, squares[1], by_row.size),
    ):
        sd = sqrt(square / across)
        clear = means.size >= LEAST_LINES and sd > 0
        for name, shape in _shapes(axis, means.size):
            found[name] = (float(shape.dot(means)) / sd, 1.0) if clear else UNKNOWN
    return found


def names(axis: str) -> Iterator[str]:
    """Yield the names of an axis' numbers, in the order of `edge_shapes`."""
    for end in ENDS:
        for reach in REACHES:
            yield f"fixed_edge of {axis}, {end}, {reach}"


def line_square(means: Array, noise: float, across: int) -> float:
    """Return the mean square of line means, of the median line: at least that of pixels' noise.

    `means` are less what is smooth; each is over so many pixels `across`.
    """
    return max(noise**2 / across, typical_square(means))


def line_square_beside(means: Array, shape: Array, noise: float, across: int) -> float:
    """Return the same of what a shape leaves of line means: no shape is noise to itself."""
    own = means - shape * float(shape @ means) / max(float(shape @ shape), 1e-300)
    return line_square(own, noise, across)


def decays(size: int) -> Array:
    """Return exp(-d / reach) from the first and the last line: (shape, line)."""
    line = np.arange(size)
    distances = (line, size - 1 - line)
    return np.array([np.exp(-d / reach) for d in distances for reach in REACHES.values()])


@lru_cache(maxsize=64)
def edge_shapes(size: int) -> Array:
    """Return the decays from the first and the last line, less smooth polynomials, of norm 1."""
    rest = beyond_smooth(decays(size).T).T
    return np.asarray(rest / np.linalg.norm(rest, axis=1, keepdims=True))


@lru_cache(maxsize=64)
def _shapes(axis: str, size: int) -> tuple[tuple[str, Array], ...]:
    """Return the names of an axis' numbers, and the shape of each."""
    return tuple(zip(names(axis), edge_shapes(size), strict=True))
