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
alternating sign into the low-pass [1 2 2 2 1]/4: all sites then run through the same arithmetic.
A tile with its margin stays in the second-level cache; it is kept flat, so that a row is a step of
`PITCH`, and indexed by unsigned integers, which spare the check for negative ones that would keep
the compiler from vectorising.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dsis.cfa import Cfa
from dsis.compiled import inlined, kernel, over_rows
from dsis.demosaic.borders import Frame, frame, full_scale_checked

MARGIN = 12  # 2 primary difference + 4 smoothing + 4 window + 2 colour differences
ROWS = 64 + 2 * MARGIN  # of a tile
PITCH = 256  # columns of a tile

_U, _I = np.uintp, np.intp
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
    over_rows(lambda first, last: _rows(given, e, first, last), mosaic.shape[0], threads)
    return given.out


class _Tile(NamedTuple):
    """Where a tile lies, margin excluded, and its planes, margin included: float32 (ROWS * PITCH).

    `signed` is the mosaic times the checkerboard; `d`, `s` and `square` = (s - d)^2 serve the row
    and then the column; `own` becomes green minus the site's own colour, first as x_h with the
    error variance `error`; `other` is green minus the colour of the diagonal neighbours.
    """

    y: int
    x: int
    height: int
    width: int
    signed: NDArray[np.float32]
    d: NDArray[np.float32]
    s: NDArray[np.float32]
    square: NDArray[np.float32]
    own: NDArray[np.float32]
    error: NDArray[np.float32]
    other: NDArray[np.float32]


@kernel
def _rows(given: Frame, e: np.float32, first: int, last: int) -> None:
    """Demosaick rows first..last-1 tile by tile."""
    planes = np.empty((7, ROWS * PITCH), np.float32)
    signed, d, s, square = planes[0], planes[1], planes[2], planes[3]
    own, error, other = planes[4], planes[5], planes[6]
    columns = given.mosaic.shape[1]
    for y in range(first, last, ROWS - 2 * MARGIN):
        for x in range(0, columns, PITCH - 2 * MARGIN):
            height, width = min(last - y, ROWS - 2 * MARGIN), min(columns - x, PITCH - 2 * MARGIN)
            tile = _Tile(y, x, height, width, signed, d, s, square, own, error, other)
            _load(given, tile)
            _smooth(tile, _I(0), _I(1))
            _estimate_along_rows(tile, e)
            _smooth(tile, _I(1), _I(0))
            _fuse_with_columns(tile, e)
            _average_diagonally(tile)
            for i in range(height):
                _write(given, tile, i)


@inlined
def _load(given: Frame, tile: _Tile) -> None:
    """Fill `signed`: green samples as they are, red and blue ones times -1."""
    chroma = (tile.y + tile.x + given.red_row + given.red_column) & 1  # parity of red and blue
    for i in range(tile.height + 2 * MARGIN):
        sign = np.float32(2 * ((i + chroma) & 1) - 1)
        row = given.rows[tile.y + i]
        for j in range(tile.width + 2 * MARGIN):
            tile.signed[_U(i * PITCH + j)] = sign * given.mosaic[row, given.columns[tile.x + j]]
            sign = -sign


@inlined
def _smooth(tile: _Tile, di: np.intp, dj: np.intp) -> None:
    """Fill `d`, `s` and `square` along one axis, where the neighbours lie in the tile."""
    signed, d, s, square = tile.signed, tile.d, tile.s, tile.square
    step = di * PITCH + dj
    for i in range(2 * di, tile.height + 2 * MARGIN - 2 * di):
        for k in range(i * PITCH + 2 * dj, i * PITCH + tile.width + 2 * MARGIN - 2 * dj):
            near = signed[_U(k - step)] + signed[_U(k + step)] + signed[_U(k)]
            far = signed[_U(k - 2 * step)] + signed[_U(k + 2 * step)]
            d[_U(k)] = _QUARTER * (_TWO * near + far)
    for i in range(6 * di, tile.height + 2 * MARGIN - 6 * di):
        for k in range(i * PITCH + 6 * dj, i * PITCH + tile.width + 2 * MARGIN - 6 * dj):
            low = _S0 * d[_U(k)]
            low += _S1 * (d[_U(k - step)] + d[_U(k + step)])
            low += _S2 * (d[_U(k - 2 * step)] + d[_U(k + 2 * step)])
            low += _S3 * (d[_U(k - 3 * step)] + d[_U(k + 3 * step)])
            low += _S4 * (d[_U(k - 4 * step)] + d[_U(k + 4 * step)])
            s[_U(k)] = low
            square[_U(k)] = (low - d[_U(k)]) * (low - d[_U(k)])


@inlined
def _estimate(tile: _Tile, e: np.float32, k: int, step: np.intp) -> tuple[np.float32, np.float32]:
    """Return the estimate x of the colour difference along one axis and its error variance v."""
    s, square = tile.s, tile.square
    here = s[_U(k)]
    total, r = here, square[_U(k)]
    for n in range(1, 5):
        total += s[_U(k - n * step)] + s[_U(k + n * step)]
        r += square[_U(k - n * step)] + square[_U(k + n * step)]
    mean = _NINTH * total
    p = (here - mean) * (here - mean)
    for n in range(1, 5):
        before, after = s[_U(k - n * step)] - mean, s[_U(k + n * step)] - mean
        p += before * before + after * after
    p *= _EIGHTH
    r = _NINTH * r + e
    gain = p / (p + r)
    return here + gain * (tile.d[_U(k)] - here), gain * r + e


@inlined
def _estimate_along_rows(tile: _Tile, e: np.float32) -> None:
    for i in range(MARGIN - 2, tile.height + MARGIN + 2):
        for k in range(i * PITCH + MARGIN - 2, i * PITCH + tile.width + MARGIN + 2):
            tile.own[_U(k)], tile.error[_U(k)] = _estimate(tile, e, k, _I(1))


@inlined
def _fuse_with_columns(tile: _Tile, e: np.float32) -> None:
    for i in range(MARGIN - 2, tile.height + MARGIN + 2):
        for k in range(i * PITCH + MARGIN - 2, i * PITCH + tile.width + MARGIN + 2):
            x_v, v_v = _estimate(tile, e, k, _I(PITCH))
            x_h, v_h = tile.own[_U(k)], tile.error[_U(k)]
            tile.own[_U(k)] = (v_v * x_h + v_h * x_v) / (v_h + v_v)


@inlined
def _average_diagonally(tile: _Tile) -> None:
    own = tile.own
    for i in range(MARGIN - 1, tile.height + MARGIN + 1):
        for k in range(i * PITCH + MARGIN - 1, i * PITCH + tile.width + MARGIN + 1):
            falling = own[_U(k - PITCH - 1)] + own[_U(k + PITCH + 1)]
            rising = own[_U(k - PITCH + 1)] + own[_U(k + PITCH - 1)]
            tile.other[_U(k)] = _QUARTER * (falling + rising)


@inlined
def _write(given: Frame, tile: _Tile, i: int) -> None:
    """Write row i of a tile, first at red and blue sites, then at green ones."""
    signed, own, other = tile.signed, tile.own, tile.other
    y = tile.y + i
    row_colour = 2 * ((y + given.red_row) & 1)  # red in red rows, blue in blue rows
    start = (y + tile.x + given.red_row + given.red_column) & 1
    base = (i + MARGIN) * PITCH + MARGIN
    for j in range(start, tile.width, 2):
        k = base + j
        sample = -signed[_U(k)]
        green = sample + own[_U(k)]
        pixel = given.out[y, tile.x + j]
        pixel[row_colour] = sample
        pixel[1] = green
        pixel[2 - row_colour] = green - other[_U(k)]
    for j in range(1 - start, tile.width, 2):
        k = base + j
        sample = signed[_U(k)]
        along = own[_U(k - 1)] + own[_U(k + 1)]
        along += other[_U(k - PITCH)] + other[_U(k + PITCH)]
        across = other[_U(k - 1)] + other[_U(k + 1)]
        across += own[_U(k - PITCH)] + own[_U(k + PITCH)]
        pixel = given.out[y, tile.x + j]
        pixel[row_colour] = sample - _QUARTER * along
        pixel[1] = sample
        pixel[2 - row_colour] = sample - _QUARTER * across
