"""Bilinear demosaicking: each missing colour is the mean of its nearest samples.

Red and blue are convolved with [1 2 1; 2 4 2; 1 2 1]/4 on their quarter of the sites, green with
[0 1 0; 1 4 1; 0 1 0]/4 on its half. On white noise of variance 1 that leaves 9/16, 5/8 and 9/16.
"""

import numpy as np
from numpy.typing import NDArray

from dsis.cfa import Cfa
from dsis.compiled import inlined, kernel, over_rows
from dsis.demosaic.bilinear_block import PIXELS, fence, store, stream
from dsis.demosaic.borders import Frame, frame

MARGIN = 1
_CACHED_BYTES = 1 << 24  # what is larger has left the caches before anyone reads it
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
        Number of threads, for large images; the result does not depend on it.

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
    large = given.out.nbytes > _CACHED_BYTES
    # One thread is done with what fits the caches before another is awake.
    workers = threads if large else 1
    over_rows(lambda first, last: _rows(given, large, first, last), mosaic.shape[0], workers)
    return given.out


@kernel
def _rows(given: Frame, past_the_cache: bool, first: int, last: int) -> None:
    """Demosaick rows first..last-1 in blocks; the first and the last overlap their neighbours."""
    width = given.mosaic.shape[1]
    wide = width >= PIXELS + 2
    end = width - 1 - PIXELS
    for y in range(first, last):
        above, here, below = (
            given.mosaic[given.rows[y]],
            given.mosaic[given.rows[y + 1]],
            given.mosaic[given.rows[y + 2]],
        )
        blue = ((y + given.red_row) & 1) != 0  # whether the row's own colour is blue, not red
        parity = (y + given.red_row + given.red_column) & 1  # of the columns that hold it
        line = given.out[y].reshape(-1)
        for x in range(0, width, width - 1 if wide else 1):  # both ends, or all of a short row
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
        if wide:
            store(above, here, below, np.uintp(1), line, blue, parity == 0)
            x = _aligned(line)
            green = ((x + parity) & 1) != 0
            if past_the_cache:
                for begin in range(x, end + 1, PIXELS):
                    stream(above, here, below, np.uintp(begin), line, blue, green)
            else:
                for begin in range(x, end + 1, PIXELS):
                    store(above, here, below, np.uintp(begin), line, blue, green)
            store(above, here, below, np.uintp(end), line, blue, ((end + parity) & 1) != 0)
    fence()


@inlined
def _aligned(line: NDArray[np.float32]) -> int:
    """Return the first pixel after pixel 0 that begins where a line of the cache does: 1..16.

    A pixel has 3 samples, a line of the cache 16, and 3 x 11 = 1 modulo 16.
    """
    samples = line[3:].ctypes.data >> 2
    return 1 + ((-samples * 11) & (PIXELS - 1))
