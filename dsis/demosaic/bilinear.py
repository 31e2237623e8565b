"""Bilinear demosaicking: each missing colour is the mean of its nearest samples.

Red and blue are convolved with [1 2 1; 2 4 2; 1 2 1]/4 on their quarter of the sites, green with
[0 1 0; 1 4 1; 0 1 0]/4 on its half. On white noise of variance 1 that leaves 9/16, 5/8 and 9/16.
"""

import numpy as np
from numpy.typing import NDArray

from dsis.cfa import Cfa
from dsis.compiled import kernel, over_rows
from dsis.demosaic.borders import Frame, frame

MARGIN = 1
_HALF = np.float32(0.5)
_QUARTER = np.float32(0.25)


def bilinear(
    mosaic: NDArray[np.float32],
    cfa: Cfa,
    *,
    out: NDArray[np.float32] | None = None,
    threads: int = 1,
) -> NDArray[np.float32]:
    """Interpolate each colour linearly between its samples.

    Parameters
    ----------
    mosaic
        float32 (row, column), at least 8 x 8; any unit and range, nothing is clipped.
    cfa
        Bayer phase.
    out
        float32 (row, column, 3) to write into; re-using one saves as much time as the arithmetic.
    threads
        Number of threads; the result does not depend on it.

    Returns
    -------
    NDArray[np.float32]
        (row, column, 3), in the unit of `mosaic`.

    Raises
    ------
    ValueError
        Where an argument is not as said above.
    """
    given = frame(mosaic, cfa, MARGIN, out)
    over_rows(lambda first, last: _rows(given, first, last), mosaic.shape[0], threads)
    return given.out


@kernel
def _rows(given: Frame, first: int, last: int) -> None:
    """Demosaick rows first..last-1 with three rows of the mosaic at hand."""
    width = given.mosaic.shape[1]
    above = np.empty(width + 2 * MARGIN, np.float32)
    here, below = np.empty_like(above), np.empty_like(above)
    _load(given, first - 1, above)
    _load(given, first, here)
    for y in range(first, last):
        _load(given, y + 1, below)
        row_colour = 2 * ((y + given.red_row) & 1)  # red in red rows, blue in blue rows
        start = (y + given.red_row + given.red_column) & 1
        line = given.out[y]
        for x in range(start, width, 2):
            axial = (here[x] + here[x + 2]) + (above[x + 1] + below[x + 1])
            diagonal = (above[x] + below[x + 2]) + (above[x + 2] + below[x])
            line[x, row_colour] = here[x + 1]
            line[x, 1] = _QUARTER * axial
            line[x, 2 - row_colour] = _QUARTER * diagonal
        for x in range(1 - start, width, 2):
            line[x, row_colour] = _HALF * (here[x] + here[x + 2])
            line[x, 1] = here[x + 1]
            line[x, 2 - row_colour] = _HALF * (above[x + 1] + below[x + 1])
        above, here, below = here, below, above


@kernel
def _load(given: Frame, y: int, line: NDArray[np.float32]) -> None:
    """Fill `line` with row y of the mosaic, -1 <= y <= number of rows, and its margins."""
    row = given.rows[y + MARGIN]
    for x in range(line.size):
        line[x] = given.mosaic[row, given.columns[x]]
