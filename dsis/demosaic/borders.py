"""What the algorithms share: arguments checked once, and mosaics continued beyond their borders.

A mosaic is reflected about its edge samples, which are not repeated: reflection moves a sample by
an even distance, so it keeps the colour of the filter. Kernels work on tiles that carry their
margin with them; `positions` says which sample each site of a tile is, and no loop needs a branch.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dsis.cfa import RED, Cfa, pattern

MIN_SIZE = 8  # rows and columns


class Frame(NamedTuple):
    """A mosaic ready for the kernels.

    Attributes
    ----------
    mosaic
        float32 (row, column), contiguous.
    rows, columns
        The sample's row (column) for every site from `-margin` on; see `positions`.
    red_row, red_column
        0 or 1: which rows and columns hold the red filters.
    out
        float32 (row, column, 3), contiguous: where the result goes.
    """

    mosaic: NDArray[np.float32]
    rows: NDArray[np.int64]
    columns: NDArray[np.int64]
    red_row: int
    red_column: int
    out: NDArray[np.float32]


def frame(
    mosaic: NDArray[np.float32], cfa: Cfa, margin: int, out: NDArray[np.float32] | None
) -> Frame:
    """Check the arguments of an algorithm and return them as its kernels want them.

    Parameters
    ----------
    mosaic
        float32 (row, column), at least 8 x 8, any unit and range.
    cfa
        One of the four Bayer phases.
    margin
        Sites that the algorithm needs beyond each border.
    out
        float32 (row, column, 3), C-contiguous and writable, or None for a new array. It may not
        overlap `mosaic`.

    Raises
    ------
    ValueError
        Where an argument is not as said above.
    """
    if mosaic.ndim != 2 or mosaic.dtype != np.float32:
        message = f"mosaic is {mosaic.dtype} {mosaic.shape}, must be float32 (row, column)"
        raise ValueError(message)
    if min(mosaic.shape) < MIN_SIZE:
        message = f"mosaic is {mosaic.shape[0]} x {mosaic.shape[1]}, must be at least 8 x 8"
        raise ValueError(message)
    if cfa is Cfa.MONO:
        message = "cfa is MONO, must be a Bayer pattern: RGGB, BGGR, GRBG or GBRG"
        raise ValueError(message)
    shape = (*mosaic.shape, 3)
    if out is None:
        out = np.empty(shape, np.float32)
    elif out.shape != shape or out.dtype != np.float32:
        message = f"out is {out.dtype} {out.shape}, must be float32 {shape}"
        raise ValueError(message)
    elif not (out.flags.carray and out.flags.writeable):
        message = "out must be C-contiguous, aligned and writable"
        raise ValueError(message)
    elif np.may_share_memory(mosaic, out):
        message = "out overlaps mosaic"
        raise ValueError(message)
    red_row, red_column = _red(cfa)
    return Frame(
        # Writable too, so that a read-only array needs no kernels of its own.
        np.require(mosaic, requirements=["C", "A", "W"]),
        positions(mosaic.shape[0], margin),
        positions(mosaic.shape[1], margin),
        red_row,
        red_column,
        out,
    )


@lru_cache(maxsize=4)
def _red(cfa: Cfa) -> tuple[int, int]:
    row, column = np.argwhere(pattern(cfa) == RED)[0]
    return int(row), int(column)


@lru_cache(maxsize=16)
def positions(count: int, margin: int) -> NDArray[np.int64]:
    """Return the sample at each site -margin .. count + margin - 1 of a reflected line: int64.

    The array is shared, to be read only.
    """
    period = 2 * (count - 1)
    site = np.arange(-margin, count + margin) % period
    return np.minimum(site, period - site)


def full_scale_checked(full_scale: float) -> np.float32:
    """Return `full_scale` as float32; `ValueError` unless 1e-6 <= full_scale <= 1e9.

    Outside, the squares and reciprocals of single precision would lose digits silently.
    """
    if not 1e-6 <= full_scale <= 1e9:
        message = f"full_scale is {full_scale}, must be from 1e-6 to 1e9"
        raise ValueError(message)
    return np.float32(full_scale)
