"""Patches of a map: what pixels that lie together have in common, over several sizes."""

from functools import lru_cache
from math import cbrt, inf, log, sqrt

import numpy as np
from numpy.typing import NDArray
from scipy.special import log_ndtr

from analysis.mismatch.bank.lines import any_of
from analysis.mismatch.bank.robust import typical_square
from analysis.mismatch.bank.scalars import UNKNOWN, Number, score_of_log
from dsis.compiled import kernel, pairwise_sum
from dsis.measures.fixed_pattern import Smooth

Array = NDArray[np.float64]
SIZES = (4, 8, 16)  # pixels of the plane along a side
_NAMES = tuple(f"fixed_patch_variance of {size} pixels" for size in SIZES)
_LEAST_PATCHES = 12.0  # beyond lines and smooth surfaces, to be worth a number
OUTLYING_PATCH = "outlying_patch"
_FAR_OUT = 3.0  # standard deviations of a pixel, beyond which it counts as so far out
_APART = 0.7  # of patches that overlap by half, for the largest of them
_TELLS = 0.2  # of patches, by the median of their squares: independent ones of normal variates
_CHANCE = 3.0  # standard errors of a typical square


def patches(pixels: Array, square: float) -> dict[str, Number]:
    """Return the mean squares of patches of each size beside that of pixels, as a cube root.

    Parameters
    ----------
    pixels
        What rows, columns and smooth surfaces leave of a map.
    square
        Its mean square per degree of freedom: white noise has ratios of 1.
    """
    rows, columns = pixels.shape
    found: dict[str, Number] = {}
    for size, name in zip(SIZES, _NAMES, strict=True):
        free = _free(rows, columns, size)
        if free < _LEAST_PATCHES or not square > 0:
            found[name] = UNKNOWN
            continue
        ratio = _squares(pixels, size) / size**2 / free / square
        dof = (rows - 1) * (columns - 1)
        found[name] = cbrt(ratio), sqrt(2 / (9 * free) - 2 / (9 * dof))
    found[OUTLYING_PATCH] = _standing_out(pixels, square)
    return found


def outlying(pixels: Array, square: float) -> tuple[float, int, int, int] | None:
    """Return the chance of the patch that stands out most, its place and size; None: no patch.

    Patches overlap by half, and are compared with white noise, or with the scatter of the many of
    their size where that is more for sure; a single pixel counts little. The logarithm of the
    chance is of the least of as many (Sidak, 1967), of all sizes.

    Parameters
    ----------
    pixels, square
        As of `patches`.
    """
    if not square > 0:
        return None
    found: list[tuple[float, int, int, int]] = []
    cells, limit = pixels, _FAR_OUT * sqrt(square)
    for size in SIZES:
        if _free(*pixels.shape, size) < _LEAST_PATCHES:
            break
        cells, sums, y, x = _overlapping(cells, limit)  # cells are half as wide as patches
        limit = inf
        white = square * size**2 * _kept(pixels.shape, size)
        typical = typical_square(sums.reshape(-1)) / (1 + _CHANCE * sqrt(2 / (_TELLS * sums.size)))
        far = abs(float(sums[y, x])) / sqrt(max(typical, white))
        chance = any_of(log(2) + float(log_ndtr(-far)), max(_APART * sums.size, 1.0))
        found.append((chance, y * size // 2, x * size // 2, size))
    if not found:
        return None
    chance, row, column, size = min(found)
    return any_of(chance, len(found)), row, column, size


def _standing_out(pixels: Array, square: float) -> Number:
    """Return the normal score of the patch that stands out most."""
    found = outlying(pixels, square)
    return UNKNOWN if found is None else (score_of_log(found[0]), 1.0)


@kernel
def _overlapping(pixels: Array, limit: float) -> tuple[Array, Array, int, int]:
    """Return sums over two by two pixels, over two by two of these, and where the latter are far.

    Pixels beyond a limit count as so far out; what is left over belongs to none. The sums of sums
    overlap by half: (row, column), and the row and column of the one farthest from 0.
    """
    rows, columns = pixels.shape[0] // 2, pixels.shape[1] // 2
    cells, sums = np.empty((rows, columns)), np.empty((rows - 1, columns - 1))
    top, left, farthest = 0, 0, -1.0
    for y in range(rows):
        above, below = pixels[2 * y], pixels[2 * y + 1]
        for x in range(columns):
            total = 0.0
            for k in range(2 * x, 2 * x + 2):
                total += min(max(above[k], -limit), limit) + min(max(below[k], -limit), limit)
            cells[y, x] = total
        for x in range(columns - 1 if y else 0):
            own = cells[y - 1, x] + cells[y - 1, x + 1] + cells[y, x] + cells[y, x + 1]
            sums[y - 1, x] = own
            if abs(own) > farthest:
                top, left, farthest = y - 1, x, abs(own)
    return cells, sums, top, left


def _kept(shape: tuple[int, ...], size: int) -> float:
    """Return the share of a patch's variance that means of rows and columns do not take."""
    rows, columns = shape
    return (1 - size / rows) * (1 - size / columns)


def names() -> list[str]:
    """Return the names of the numbers, in the order of `SIZES`."""
    return list(_NAMES)


@kernel
def _squares(pixels: Array, size: int) -> float:
    """Return the sum of squares of the sums over patches; what is left over belongs to none."""
    down, across = pixels.shape[0] // size, pixels.shape[1] // size
    squares, line = np.empty(down * across), np.empty(across * size)
    for y in range(down):
        line[:] = 0.0
        for k in range(y * size, (y + 1) * size):
            for x in range(line.size):
                line[x] += pixels[k, x]
        for x in range(across):
            own = pairwise_sum(line[x * size : (x + 1) * size])
            squares[y * across + x] = own * own
    return pairwise_sum(squares)


def _sums(values: Array, size: int) -> Array:
    """Return sums of so many rows each; what is left over belongs to no patch."""
    count = len(values) // size
    return np.asarray(values[: count * size].reshape(count, size, values.shape[1]).sum(1))


@lru_cache(maxsize=64)
def _free(rows: int, columns: int, size: int) -> float:
    """Return the degrees of freedom that patches of white noise have beyond what was taken off."""
    smooth = Smooth.of(rows, columns)
    n, m = rows // size, columns // size
    down, across = (
        (_sums(basis, size) ** 2).sum(0) / size
        for basis in (smooth.along_rows, smooth.along_columns)
    )
    taken = float(np.outer(down, across)[smooth.mixed].sum())
    return max(float((n - down[0]) * (m - across[0])) - taken, 0.0)
