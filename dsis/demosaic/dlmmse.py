"""DLMMSE demosaicking: directional linear minimum mean square-error estimation.

Zhang and Wu, "Color demosaicking via directional linear minimum mean square-error estimation",
IEEE Trans. Image Processing 14 (2005) 2167-2178, with the mean estimate of the authors' MATLAB
program, which reproduces the paper that dsis extends. At every red and blue site green minus the
site's colour is estimated along the row and along the column:

    d   primary difference, the mosaic's high-pass [1 -2 2 -2 1]/4 with the sign of the colour
    s   d smoothed with [4 9 15 23 26 23 15 9 4]/128
    p   variance of s over nine samples;  r = mean of (s - d)^2 over them + e
    x = s + p/(p + r) (d - s), with the error variance v = p r/(p + r) + e

and fused with weights inverse to the error variances, (v_v x_h + v_h x_v)/(v_h + v_v). The other
differences are means of the neighbours, diagonal ones first. e is 0.1 in squared 8-bit codes.

The mosaic times a checkerboard of +1 (green) and -1 (red, blue) turns the high-pass with its
alternating sign into the low-pass [1 2 2 2 1]/4: all sites then run through the same arithmetic,
which the compiler vectorises. Tiles with their margins stay in the second-level cache.
"""

import numpy as np
from numpy.typing import NDArray

from dsis.cfa import Cfa
from dsis.compiled import inlined, kernel, over_rows
from dsis.demosaic.borders import frame, full_scale_checked

MARGIN = 12  # 2 primary difference + 4 smoothing + 4 window + 2 colour differences
TILE_ROWS = 64 + 2 * MARGIN
TILE_COLUMNS = 256

_QUARTER, _TWO = np.float32(0.25), np.float32(2)
_S0, _S1, _S2, _S3, _S4 = (np.float32(weight / 128) for weight in (26, 23, 15, 9, 4))
_NINTH, _EIGHTH = np.float32(1 / 9), np.float32(1 / 8)


def dlmmse(
    mosaic: NDArray[np.float32],
    cfa: Cfa,
    *,
    full_scale: float = 1.0,
    out: NDArray[np.float32] | None = None,
    threads: int = 1,
) -> NDArray[np.float32]:
    """Interpolate by directional estimates of the colour differences, weighted by reliability.

    Parameters
    ----------
    mosaic
        float32 (row, column), at least 8 x 8; any unit and range, nothing is clipped.
    cfa
        Bayer phase.
    full_scale
        The value that code 255 of an 8-bit image corresponds to, in the unit of `mosaic`.
    out
        float32 (row, column, 3) to write into.
    threads
        Number of threads; the result does not depend on it.

    Returns
    -------
    NDArray[np.float32]
        (row, column, 3), in the unit of `mosaic`; the samples of the mosaic are kept.

    Raises
    ------
    ValueError
        Where an argument is not as said above.
    """
    given = frame(mosaic, cfa, MARGIN, out)
    e = np.float32(0.1) * (full_scale_checked(full_scale) / np.float32(255)) ** 2
    over_rows(lambda first, last: _rows(*given, e, first, last), mosaic.shape[0], threads)
    return given.out


@kernel
def _rows(
    mosaic: NDArray[np.float32],
    rows: NDArray[np.int64],
    columns: NDArray[np.int64],
    red_row: int,
    red_column: int,
    out: NDArray[np.float32],
    e: np.float32,
    first: int,
    last: int,
) -> None:
    shape = (TILE_ROWS, TILE_COLUMNS)
    signed, d = np.empty(shape, np.float32), np.empty(shape, np.float32)
    s, square = np.empty(shape, np.float32), np.empty(shape, np.float32)
    own, error = np.empty(shape, np.float32), np.empty(shape, np.float32)
    other = np.empty(shape, np.float32)
    for y in range(first, last, TILE_ROWS - 2 * MARGIN):
        height = min(last - y + 2 * MARGIN, TILE_ROWS)
        for x in range(0, mosaic.shape[1], TILE_COLUMNS - 2 * MARGIN):
            width = min(mosaic.shape[1] - x + 2 * MARGIN, TILE_COLUMNS)
            green = (y + x + red_row + red_column + 1) & 1  # parity of green sites in this tile
            for i in range(height):
                sign = np.float32(1 - 2 * ((i + green) & 1))
                for j in range(width):
                    signed[i, j] = sign * mosaic[rows[y + i], columns[x + j]]
                    sign = -sign
            _smooth(signed, d, s, square, height, width, 0, 1)
            for i in range(MARGIN - 2, height - MARGIN + 2):
                for j in range(MARGIN - 2, width - MARGIN + 2):
                    own[i, j], error[i, j] = _estimate(d, s, square, e, i, j, 0, 1)
            _smooth(signed, d, s, square, height, width, 1, 0)
            for i in range(MARGIN - 2, height - MARGIN + 2):
                for j in range(MARGIN - 2, width - MARGIN + 2):
                    x_v, v_v = _estimate(d, s, square, e, i, j, 1, 0)
                    x_h, v_h = own[i, j], error[i, j]
                    own[i, j] = (v_v * x_h + v_h * x_v) / (v_h + v_v)
            for i in range(MARGIN - 1, height - MARGIN + 1):
                for j in range(MARGIN - 1, width - MARGIN + 1):
                    falling = own[i - 1, j - 1] + own[i + 1, j + 1]
                    rising = own[i - 1, j + 1] + own[i + 1, j - 1]
                    other[i, j] = _QUARTER * (falling + rising)
            for i in range(height - 2 * MARGIN):
                _colours(signed, own, other, i, width, red_row, red_column, y, x, out)


@inlined
def _smooth(
    signed: NDArray[np.float32],
    d: NDArray[np.float32],
    s: NDArray[np.float32],
    square: NDArray[np.float32],
    height: int,
    width: int,
    di: int,
    dj: int,
) -> None:
    """Fill d, s and (s - d)^2 along one axis, for all sites whose neighbours lie in the tile."""
    for i in range(2 * di, height - 2 * di):
        for j in range(2 * dj, width - 2 * dj):
            near = signed[i - di, j - dj] + signed[i + di, j + dj] + signed[i, j]
            far = signed[i - 2 * di, j - 2 * dj] + signed[i + 2 * di, j + 2 * dj]
            d[i, j] = _QUARTER * (_TWO * near + far)
    for i in range(6 * di, height - 6 * di):
        for j in range(6 * dj, width - 6 * dj):
            low = _S0 * d[i, j]
            low += _S1 * (d[i - di, j - dj] + d[i + di, j + dj])
            low += _S2 * (d[i - 2 * di, j - 2 * dj] + d[i + 2 * di, j + 2 * dj])
            low += _S3 * (d[i - 3 * di, j - 3 * dj] + d[i + 3 * di, j + 3 * dj])
            low += _S4 * (d[i - 4 * di, j - 4 * dj] + d[i + 4 * di, j + 4 * dj])
            s[i, j] = low
            square[i, j] = (low - d[i, j]) * (low - d[i, j])


@inlined
def _estimate(
    d: NDArray[np.float32],
    s: NDArray[np.float32],
    square: NDArray[np.float32],
    e: np.float32,
    i: int,
    j: int,
    di: int,
    dj: int,
) -> tuple[np.float32, np.float32]:
    """Return the estimate x of the colour difference along one axis and its error variance v."""
    total, r = s[i, j], square[i, j]
    for k in range(1, 5):
        total += s[i - k * di, j - k * dj] + s[i + k * di, j + k * dj]
        r += square[i - k * di, j - k * dj] + square[i + k * di, j + k * dj]
    mean = _NINTH * total
    p = (s[i, j] - mean) * (s[i, j] - mean)
    for k in range(1, 5):
        before = s[i - k * di, j - k * dj] - mean
        after = s[i + k * di, j + k * dj] - mean
        p += before * before + after * after
    p *= _EIGHTH
    r = _NINTH * r + e
    gain = p / (p + r)
    return s[i, j] + gain * (d[i, j] - s[i, j]), gain * r + e


@inlined
def _colours(
    signed: NDArray[np.float32],
    own: NDArray[np.float32],
    other: NDArray[np.float32],
    i: int,
    width: int,
    red_row: int,
    red_column: int,
    y: int,
    x: int,
    out: NDArray[np.float32],
) -> None:
    """Write row i of a tile: the colours from green minus own and green minus other."""
    row_colour = 2 * ((y + i + red_row) & 1)  # red in red rows, blue in blue rows
    start = (y + i + x + red_row + red_column) & 1
    i += MARGIN
    for j in range(MARGIN + start, width - MARGIN, 2):
        sample = -signed[i, j]
        green = sample + own[i, j]
        result = out[y + i - MARGIN, x + j - MARGIN]
        result[row_colour] = sample
        result[1] = green
        result[2 - row_colour] = green - other[i, j]
    for j in range(MARGIN + 1 - start, width - MARGIN, 2):
        sample = signed[i, j]
        result = out[y + i - MARGIN, x + j - MARGIN]
        result[1] = sample
        along = (own[i, j - 1] + own[i, j + 1]) + (other[i - 1, j] + other[i + 1, j])
        across = (other[i, j - 1] + other[i, j + 1]) + (own[i - 1, j] + own[i + 1, j])
        result[row_colour] = sample - _QUARTER * along
        result[2 - row_colour] = sample - _QUARTER * across
