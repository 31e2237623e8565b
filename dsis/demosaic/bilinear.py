"""Bilinear demosaicking: each missing colour is the mean of its nearest samples.

Red and blue are convolved with [1 2 1; 2 4 2; 1 2 1]/4 on their quarter of the sites, green with
[0 1 0; 1 4 1; 0 1 0]/4 on its half. On white noise of variance 1 that leaves 9/16, 5/8 and 9/16.
"""

import numpy as np
from numpy.typing import NDArray

from dsis.cfa import Cfa
from dsis.compiled import inlined, kernel, over_rows
from dsis.demosaic.borders import Frame, frame

MARGIN = 1
_SPAN = 512  # columns: what a span reads and writes stays in the first-level cache
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
    """Demosaick rows first..last-1, a span of columns at a time that stays in the first cache."""
    width = given.mosaic.shape[1]
    own, green, other = (
        np.empty(_SPAN, np.float32),
        np.empty(_SPAN, np.float32),
        np.empty(_SPAN, np.float32),
    )
    for y in range(first, last):
        above, here, below = (
            given.mosaic[given.rows[y]],
            given.mosaic[given.rows[y + 1]],
            given.mosaic[given.rows[y + 2]],
        )
        blue = (y + given.red_row) & 1  # whether the row's own colour is blue, not red
        parity = (y + given.red_row + given.red_column) & 1  # of the columns that hold it
        line = given.out[y].reshape(-1)
        for start in range(1, width - 1, _SPAN):
            end = min(start + _SPAN, width - 1)
            _span(
                above[start - 1 : end + 1],
                here[start - 1 : end + 1],
                below[start - 1 : end + 1],
                np.uint32((start + parity) & 1),
                own,
                green,
                other,
            )
            if blue:
                _interleave(other, green, own, line[3 * start : 3 * end])
            else:
                _interleave(own, green, other, line[3 * start : 3 * end])
        for x in (0, width - 1):
            left, right = given.columns[x], given.columns[x + 2]
            beside, upright = here[left] + here[right], above[x] + below[x]
            diagonal = (above[left] + below[right]) + (above[right] + below[left])
            pixel = line[3 * x : 3 * x + 3]
            if (x & 1) == parity:
                pixel[2 * blue], pixel[1] = here[x], _QUARTER * (beside + upright)
                pixel[2 - 2 * blue] = _QUARTER * diagonal
            else:
                pixel[2 * blue], pixel[1] = _HALF * beside, here[x]
                pixel[2 - 2 * blue] = _HALF * upright


@inlined
def _span(
    above: NDArray[np.float32],
    here: NDArray[np.float32],
    below: NDArray[np.float32],
    parity: np.uint32,
    own: NDArray[np.float32],
    green: NDArray[np.float32],
    other: NDArray[np.float32],
) -> None:
    """Fill the row's own colour, green and the other from three rows with one sample around.

    Both kinds of sites are computed everywhere and one is chosen: no strides, all vector.
    """
    for i in range(np.uintp(here.size - 2)):
        beside, upright = here[i] + here[i + 2], above[i + 1] + below[i + 1]
        diagonal = (above[i] + below[i + 2]) + (above[i + 2] + below[i])
        sampled = (np.uint32(i) & np.uint32(1)) == parity
        own[i] = here[i + 1] if sampled else _HALF * beside
        green[i] = _QUARTER * (beside + upright) if sampled else here[i + 1]
        other[i] = _QUARTER * diagonal if sampled else _HALF * upright


@inlined
def _interleave(
    red: NDArray[np.float32],
    green: NDArray[np.float32],
    blue: NDArray[np.float32],
    line: NDArray[np.float32],
) -> None:
    for i in range(np.uintp(line.size // 3)):
        line[3 * i], line[3 * i + 1], line[3 * i + 2] = red[i], green[i], blue[i]
