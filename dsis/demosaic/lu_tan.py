"""Lu and Tan's demosaicking: colour differences, weighted by the inverse gradient.

Lu and Tan, "Color filter array demosaicking: new method and performance measures", IEEE Trans.
Image Processing 12 (2003) 1194-1210. Green at a red or blue site is the weighted mean of four
directions d, with e = G(d) + (C(0) - C(2d))/2 and the weight

    1/(1 + |G(-d) - G(d)| + |G(d) - G(3d)| + |C(0) - C(2d)| + |G(a) - G(a+2d)|/2
         + |G(b) - G(b+2d)|/2),   a and b the green neighbours across d.

Red and blue minus green are then weighted means of the four diagonal, afterwards of the four axial
neighbours, with the weight 1/(1 + |C(d) - C(-d)| + |M(0) - M(2d)| + |G(0) - G(d)|), M the mosaic.
The 1 is one 8-bit code. The post-processing, not used in the paper that dsis extends, replaces
green minus red and green minus blue by their medians and takes green from both.
"""

import numpy as np
from numpy.typing import NDArray

from dsis.cfa import Cfa
from dsis.compiled import inlined, kernel, over_rows
from dsis.demosaic.borders import frame, full_scale_checked

MARGIN = 5  # 3 green + 1 diagonal + 1 axial differences
TILE_ROWS = 64 + 2 * MARGIN
TILE_COLUMNS = 256

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
    over_rows(lambda first, last: _rows(*given, code, first, last), mosaic.shape[0], threads)
    if post_process:
        _filter_differences(given.out)
    return given.out


@kernel
def _rows(
    mosaic: NDArray[np.float32],
    rows: NDArray[np.int64],
    columns: NDArray[np.int64],
    red_row: int,
    red_column: int,
    out: NDArray[np.float32],
    code: np.float32,
    first: int,
    last: int,
) -> None:
    shape = (TILE_ROWS, TILE_COLUMNS)
    m, g, o = np.empty(shape, np.float32), np.empty(shape, np.float32), np.empty(shape, np.float32)
    along, across = np.empty(TILE_COLUMNS, np.float32), np.empty(TILE_COLUMNS, np.float32)
    for y in range(first, last, TILE_ROWS - 2 * MARGIN):
        height = min(last - y + 2 * MARGIN, TILE_ROWS)
        for x in range(0, mosaic.shape[1], TILE_COLUMNS - 2 * MARGIN):
            width = min(mosaic.shape[1] - x + 2 * MARGIN, TILE_COLUMNS)
            for i in range(height):
                for j in range(width):
                    m[i, j] = mosaic[rows[y + i], columns[x + j]]
            chroma = (y + x + red_row + red_column) & 1  # parity of red and blue in this tile
            for i in range(3, height - 3):
                for j in range(3, width - 3):
                    sum_h, weight_h = _green(m, code, i, j, 0, 1)
                    sum_v, weight_v = _green(m, code, i, j, 1, 0)
                    g[i, j] = (sum_h + sum_v) / (weight_h + weight_v)
                for j in range(3 + ((i + chroma) & 1), width - 3, 2):
                    g[i, j] = m[i, j]
            for i in range(4, height - 4):
                for j in range(4, width - 4):
                    falling, weight_f = _difference(m, m, g, code, i, j, 1, 1)
                    rising, weight_r = _difference(m, m, g, code, i, j, 1, -1)
                    o[i, j] = g[i, j] + (falling + rising) / (weight_f + weight_r)
            for i in range(5, height - 5):
                for j in range(5, width - 5):
                    sum_h, weight_h = _difference(m, m, g, code, i, j, 0, 1)
                    sum_v, weight_v = _difference(o, m, g, code, i, j, 1, 0)
                    along[j] = (sum_h + sum_v) / (weight_h + weight_v)
                    sum_h, weight_h = _difference(o, m, g, code, i, j, 0, 1)
                    sum_v, weight_v = _difference(m, m, g, code, i, j, 1, 0)
                    across[j] = (sum_h + sum_v) / (weight_h + weight_v)
                row = y + i - MARGIN
                row_colour = 2 * ((row + red_row) & 1)  # red in red rows, blue in blue rows
                start = 5 + ((i + chroma + 1) & 1)
                for j in range(start, width - 5, 2):
                    result = out[row, x + j - MARGIN]
                    result[row_colour] = m[i, j]
                    result[1] = g[i, j]
                    result[2 - row_colour] = o[i, j]
                for j in range(11 - start, width - 5, 2):
                    result = out[row, x + j - MARGIN]
                    result[row_colour] = m[i, j] + along[j]
                    result[1] = m[i, j]
                    result[2 - row_colour] = m[i, j] + across[j]


@inlined
def _green(
    m: NDArray[np.float32], code: np.float32, i: int, j: int, di: int, dj: int
) -> tuple[np.float32, np.float32]:
    """Return weighted sum and weight of the two estimates of green along one axis."""
    here, ahead, behind = m[i, j], m[i + di, j + dj], m[i - di, j - dj]
    second, back = m[i + 2 * di, j + 2 * dj], m[i - 2 * di, j - 2 * dj]
    left, right = m[i - dj, j - di], m[i + dj, j + di]
    common = code + abs(behind - ahead)
    side = abs(left - m[i - dj + 2 * di, j - di + 2 * dj])
    side += abs(right - m[i + dj + 2 * di, j + di + 2 * dj])
    edge = abs(ahead - m[i + 3 * di, j + 3 * dj]) + abs(here - second)
    weight_ahead = _ONE / (common + edge + _HALF * side)
    side = abs(left - m[i - dj - 2 * di, j - di - 2 * dj])
    side += abs(right - m[i + dj - 2 * di, j + di - 2 * dj])
    edge = abs(behind - m[i - 3 * di, j - 3 * dj]) + abs(here - back)
    weight_behind = _ONE / (common + edge + _HALF * side)
    total = weight_ahead * (ahead + _HALF * (here - second))
    total += weight_behind * (behind + _HALF * (here - back))
    return total, weight_ahead + weight_behind


@inlined
def _difference(
    c: NDArray[np.float32],
    m: NDArray[np.float32],
    g: NDArray[np.float32],
    code: np.float32,
    i: int,
    j: int,
    di: int,
    dj: int,
) -> tuple[np.float32, np.float32]:
    """Return weighted sum and weight of colour c minus green at the two neighbours on one axis."""
    common = code + abs(c[i + di, j + dj] - c[i - di, j - dj])
    edge = abs(m[i, j] - m[i + 2 * di, j + 2 * dj]) + abs(g[i, j] - g[i + di, j + dj])
    weight_ahead = _ONE / (common + edge)
    edge = abs(m[i, j] - m[i - 2 * di, j - 2 * dj]) + abs(g[i, j] - g[i - di, j - dj])
    weight_behind = _ONE / (common + edge)
    total = weight_ahead * (c[i + di, j + dj] - g[i + di, j + dj])
    total += weight_behind * (c[i - di, j - dj] - g[i - di, j - dj])
    return total, weight_ahead + weight_behind


@kernel
def _filter_differences(image: NDArray[np.float32]) -> None:
    """Replace both colour differences by recursive 3 x 3 medians, in the order of reading.

    Each median sees the ones before it, so the planes are run through once, with three rows of
    either difference at hand; borders are reflected.
    """
    height, width, _ = image.shape
    lines = np.empty((3, 2, width), np.float32)
    for i in (0, 1):
        _load_differences(image, i, lines[i])
    for i in range(height):
        here, below, above = lines[i % 3], lines[(i + 1) % 3], lines[(i + 2) % 3]
        if i == 0:
            above = below
        if i == height - 1:
            below = above
        elif i > 0:
            _load_differences(image, i + 1, below)
        for j in range(width):
            before, after = max(j - 1, 1 - j), min(j + 1, 2 * width - 3 - j)
            for k in (0, 1):
                here[k, j] = _median(above[k], here[k], below[k], before, j, after)
            green = _HALF * ((image[i, j, 0] + here[0, j]) + (image[i, j, 2] + here[1, j]))
            image[i, j, 0] = green - here[0, j]
            image[i, j, 1] = green
            image[i, j, 2] = green - here[1, j]


@kernel
def _load_differences(image: NDArray[np.float32], i: int, line: NDArray[np.float32]) -> None:
    for j in range(image.shape[1]):
        line[0, j] = image[i, j, 1] - image[i, j, 0]
        line[1, j] = image[i, j, 1] - image[i, j, 2]


@kernel
def _median(
    above: NDArray[np.float32],
    here: NDArray[np.float32],
    below: NDArray[np.float32],
    a: int,
    b: int,
    c: int,
) -> np.float32:
    """Return the median of 3 x 3 samples: of the largest low, the middle one and smallest high."""
    low_a, middle_a, high_a = _sorted(above[a], here[a], below[a])
    low_b, middle_b, high_b = _sorted(above[b], here[b], below[b])
    low_c, middle_c, high_c = _sorted(above[c], here[c], below[c])
    low = max(low_a, low_b, low_c)
    high = min(high_a, high_b, high_c)
    _, middle, _ = _sorted(middle_a, middle_b, middle_c)
    _, median, _ = _sorted(low, middle, high)
    return median


@kernel
def _sorted(
    a: np.float32, b: np.float32, c: np.float32
) -> tuple[np.float32, np.float32, np.float32]:
    low, high = min(a, b), max(a, b)
    return min(low, c), max(low, min(high, c)), max(high, c)
