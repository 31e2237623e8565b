"""Lu and Tan's demosaicking: colour differences, weighted by the inverse gradient.

Lu and Tan, "Color filter array demosaicking: new method and performance measures", IEEE Trans.
Image Processing 12 (2003) 1194-1210. Green at a red or blue site is the weighted mean of four
directions d, with e = G(d) + (C(0) - C(2d))/2 and the weight

    1/(1 + |G(-d) - G(d)| + |G(d) - G(3d)| + |C(0) - C(2d)| + |G(a) - G(a+2d)|/2
         + |G(b) - G(b+2d)|/2),   a and b the green neighbours across d.

Red and blue minus green are then weighted means of the four diagonal, afterwards of the four axial
neighbours, with the weight 1/(1 + |C(d) - C(-d)| + |M(0) - M(2d)| + |G(0) - G(d)|), M the mosaic.
The 1 is one 8-bit code. Post-processing replaces green minus red and green minus blue by their
medians and takes green from both; the matrix of the paper that dsis extends fits without it.

Tiles are kept flat, so that a row is a step of `PITCH`, and indexed by unsigned integers, which
spare the check for negative ones that would keep the compiler from vectorising.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dsis.cfa import Cfa
from dsis.compiled import inlined, kernel, over_rows
from dsis.demosaic.borders import Frame, frame, full_scale_checked

MARGIN = 5  # 3 green + 1 diagonal + 1 axial differences
ROWS = 64 + 2 * MARGIN  # of a tile
PITCH = 256  # columns of a tile

_U = np.uintp
_ONE, _HALF = np.float32(1), np.float32(0.5)


def lu_tan(
    mosaic: NDArray[np.float32],
    cfa: Cfa,
    *,
    full_scale: float = 1.0,
    post_process: bool = False,
    out: NDArray[np.float32] | None = None,
    threads: int = 1,
) -> NDArray[np.float32]:
    """Interpolate colour differences along the directions of the least gradient.

    Parameters
    ----------
    mosaic
        float32 (row, column), at least 8 x 8; any unit and range, nothing is clipped.
    cfa
        Bayer phase.
    full_scale
        The value that code 255 of an 8-bit image corresponds to, in the unit of `mosaic`.
    post_process
        Filter the colour differences by a recursive 3 x 3 median (it runs on one thread); the
        samples of the mosaic may then change, otherwise they are kept.
    out
        float32 (row, column, 3) to write into.
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
    code = full_scale_checked(full_scale) / np.float32(255)
    over_rows(lambda first, last: _rows(given, code, first, last), mosaic.shape[0], threads)
    if post_process:
        _filter_differences(given.out)
    return given.out


class _Tile(NamedTuple):
    """Where a tile lies, margin excluded, and its planes, margin included: float32 (ROWS * PITCH).

    `m` is the mosaic and `g` green. `other` is blue at red sites and red at blue sites. At green
    sites `along` is the colour of the neighbours in the row, `across` that of those in the column.
    """

    y: int
    x: int
    height: int
    width: int
    m: NDArray[np.float32]
    g: NDArray[np.float32]
    other: NDArray[np.float32]
    along: NDArray[np.float32]
    across: NDArray[np.float32]


@kernel
def _rows(given: Frame, code: np.float32, first: int, last: int) -> None:
    """Demosaick rows first..last-1 tile by tile."""
    planes = np.empty((5, ROWS * PITCH), np.float32)
    m, g, other, along, across = planes[0], planes[1], planes[2], planes[3], planes[4]
    columns = given.mosaic.shape[1]
    for y in range(first, last, ROWS - 2 * MARGIN):
        for x in range(0, columns, PITCH - 2 * MARGIN):
            height, width = min(last - y, ROWS - 2 * MARGIN), min(columns - x, PITCH - 2 * MARGIN)
            tile = _Tile(y, x, height, width, m, g, other, along, across)
            chroma = (y + x + given.red_row + given.red_column) & 1  # parity of red and blue
            _load(given, tile)
            _interpolate_green(tile, code, chroma)
            _interpolate_diagonally(tile, code)
            _interpolate_axially(tile, code)
            for i in range(height):
                _write(given, tile, i, (i + chroma) & 1)


@inlined
def _load(given: Frame, tile: _Tile) -> None:
    for i in range(tile.height + 2 * MARGIN):
        row = given.rows[tile.y + i]
        for j in range(tile.width + 2 * MARGIN):
            tile.m[_U(i * PITCH + j)] = given.mosaic[row, given.columns[tile.x + j]]


@inlined
def _interpolate_green(tile: _Tile, code: np.float32, chroma: int) -> None:
    m, g = tile.m, tile.g
    for i in range(3, tile.height + 2 * MARGIN - 3):
        for k in range(i * PITCH + 3, i * PITCH + tile.width + 2 * MARGIN - 3):
            sum_h, weight_h = _green(m, code, k, 1, PITCH)
            sum_v, weight_v = _green(m, code, k, PITCH, 1)
            g[_U(k)] = (sum_h + sum_v) / (weight_h + weight_v)
        first_green = i * PITCH + 3 + ((i + chroma) & 1)
        for k in range(first_green, i * PITCH + tile.width + 2 * MARGIN - 3, 2):
            g[_U(k)] = m[_U(k)]


@inlined
def _interpolate_diagonally(tile: _Tile, code: np.float32) -> None:
    m, g = tile.m, tile.g
    for i in range(4, tile.height + 2 * MARGIN - 4):
        for k in range(i * PITCH + 4, i * PITCH + tile.width + 2 * MARGIN - 4):
            sum_f, weight_f = _difference(tile, m, code, k, PITCH + 1)
            sum_r, weight_r = _difference(tile, m, code, k, PITCH - 1)
            tile.other[_U(k)] = g[_U(k)] + (sum_f + sum_r) / (weight_f + weight_r)


@inlined
def _interpolate_axially(tile: _Tile, code: np.float32) -> None:
    m, other = tile.m, tile.other
    for i in range(MARGIN, tile.height + MARGIN):
        for k in range(i * PITCH + MARGIN, i * PITCH + tile.width + MARGIN):
            sum_h, weight_h = _difference(tile, m, code, k, 1)
            sum_v, weight_v = _difference(tile, other, code, k, PITCH)
            tile.along[_U(k)] = m[_U(k)] + (sum_h + sum_v) / (weight_h + weight_v)
        for k in range(i * PITCH + MARGIN, i * PITCH + tile.width + MARGIN):
            sum_h, weight_h = _difference(tile, other, code, k, 1)
            sum_v, weight_v = _difference(tile, m, code, k, PITCH)
            tile.across[_U(k)] = m[_U(k)] + (sum_h + sum_v) / (weight_h + weight_v)


@inlined
def _green(
    m: NDArray[np.float32], code: np.float32, k: int, step: int, side: int
) -> tuple[np.float32, np.float32]:
    """Return weighted sum and weight of the two estimates of green along one axis."""
    here, ahead, behind = m[_U(k)], m[_U(k + step)], m[_U(k - step)]
    second, back = m[_U(k + 2 * step)], m[_U(k - 2 * step)]
    left, right = m[_U(k - side)], m[_U(k + side)]
    common = code + abs(behind - ahead)
    edge = abs(ahead - m[_U(k + 3 * step)]) + abs(here - second)
    aside = abs(left - m[_U(k - side + 2 * step)]) + abs(right - m[_U(k + side + 2 * step)])
    weight_ahead = _ONE / (common + edge + _HALF * aside)
    edge = abs(behind - m[_U(k - 3 * step)]) + abs(here - back)
    aside = abs(left - m[_U(k - side - 2 * step)]) + abs(right - m[_U(k + side - 2 * step)])
    weight_behind = _ONE / (common + edge + _HALF * aside)
    total = weight_ahead * (ahead + _HALF * (here - second))
    total += weight_behind * (behind + _HALF * (here - back))
    return total, weight_ahead + weight_behind


@inlined
def _difference(
    tile: _Tile, c: NDArray[np.float32], code: np.float32, k: int, step: int
) -> tuple[np.float32, np.float32]:
    """Return weighted sum and weight of colour c minus green at the two neighbours on one axis."""
    m, g = tile.m, tile.g
    ahead, behind = c[_U(k + step)], c[_U(k - step)]
    green_ahead, green_behind = g[_U(k + step)], g[_U(k - step)]
    common = code + abs(ahead - behind)
    edge = abs(m[_U(k)] - m[_U(k + 2 * step)]) + abs(g[_U(k)] - green_ahead)
    weight_ahead = _ONE / (common + edge)
    edge = abs(m[_U(k)] - m[_U(k - 2 * step)]) + abs(g[_U(k)] - green_behind)
    weight_behind = _ONE / (common + edge)
    total = weight_ahead * (ahead - green_ahead) + weight_behind * (behind - green_behind)
    return total, weight_ahead + weight_behind


@inlined
def _write(given: Frame, tile: _Tile, i: int, start: int) -> None:
    """Write row i of a tile, first at red and blue sites, then at green ones."""
    y = tile.y + i
    row_colour = 2 * ((y + given.red_row) & 1)  # red in red rows, blue in blue rows
    base = (i + MARGIN) * PITCH + MARGIN
    for j in range(start, tile.width, 2):
        pixel = given.out[y, tile.x + j]
        pixel[row_colour] = tile.m[_U(base + j)]
        pixel[1] = tile.g[_U(base + j)]
        pixel[2 - row_colour] = tile.other[_U(base + j)]
    for j in range(1 - start, tile.width, 2):
        pixel = given.out[y, tile.x + j]
        pixel[row_colour] = tile.along[_U(base + j)]
        pixel[1] = tile.m[_U(base + j)]
        pixel[2 - row_colour] = tile.across[_U(base + j)]


@kernel
def _filter_differences(image: NDArray[np.float32]) -> None:
    """Replace both colour differences by recursive 3 x 3 medians, in the order of reading.

    Each median sees the ones before it, so the planes are run through once, with three rows of
    either difference at hand; borders are reflected.
    """
    height, width, _ = image.shape
    lines = np.empty((3, 2, width), np.float32)
    _load_differences(image, 0, lines)
    _load_differences(image, 1, lines)
    for i in range(height):
        if 0 < i < height - 1:
            _load_differences(image, i + 1, lines)
        here = lines[i % 3]
        above = lines[(i - 1) % 3] if i > 0 else lines[1]
        below = lines[(i + 1) % 3] if i < height - 1 else above
        for j in range(width):
            before, after = abs(j - 1), width - 1 - abs(width - 2 - j)
            for c in (0, 1):
                low_a, middle_a, high_a = _sorted(
                    above[c, before], here[c, before], below[c, before]
                )
                low_b, middle_b, high_b = _sorted(above[c, j], here[c, j], below[c, j])
                low_c, middle_c, high_c = _sorted(above[c, after], here[c, after], below[c, after])
                # The median is the middle of the largest low, the middle middle, the smallest high.
                low, high = max(low_a, low_b, low_c), min(high_a, high_b, high_c)
                here[c, j] = _sorted(low, _sorted(middle_a, middle_b, middle_c)[1], high)[1]
            green = _HALF * ((image[i, j, 0] + here[0, j]) + (image[i, j, 2] + here[1, j]))
            image[i, j, 0] = green - here[0, j]
            image[i, j, 1] = green
            image[i, j, 2] = green - here[1, j]


@kernel
def _load_differences(image: NDArray[np.float32], i: int, lines: NDArray[np.float32]) -> None:
    """Put green minus red and green minus blue of row i of the image into line i modulo 3."""
    for j in range(image.shape[1]):
        lines[i % 3, 0, j] = image[i, j, 1] - image[i, j, 0]
        lines[i % 3, 1, j] = image[i, j, 1] - image[i, j, 2]


@kernel
def _sorted(
    a: np.float32, b: np.float32, c: np.float32
) -> tuple[np.float32, np.float32, np.float32]:
    low, high = min(a, b), max(a, b)
    return min(low, c), max(low, min(high, c)), max(high, c)
