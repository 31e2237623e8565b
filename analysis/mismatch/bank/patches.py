"""Patches of a map: how much pixels that lie together have in common, over several sizes."""

from functools import lru_cache
from math import cbrt, sqrt

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.scalars import UNKNOWN, Number
from dsis.compiled import kernel, pairwise_sum
from dsis.measures.fixed_pattern import Smooth

Array = NDArray[np.float64]
SIZES = (4, 8, 16)  # pixels of the plane along a side
_NAMES = tuple(f"fixed_patch_variance of {size} pixels" for size in SIZES)
_LEAST_PATCHES = 12.0  # beyond lines and smooth surfaces, to be worth a number


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
    return found


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
