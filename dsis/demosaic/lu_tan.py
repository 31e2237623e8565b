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

import numpy as np
from numpy.typing import NDArray

from dsis.cfa import Cfa
from dsis.compiled import inlined, kernel, over_rows
from dsis.demosaic.borders import frame, full_scale_checked

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
    """Demosaick rows first..last-1 tile by tile."""
    m, g = np.empty(ROWS * PITCH, np.float32), np.empty(ROWS * PITCH, np.float32)
    other = np.empty(ROWS * PITCH, np.float32)
    along, across = np.empty(ROWS * PITCH, np.float32), np.empty(ROWS * PITCH, np.float32)
    for y in range(first, last, ROWS - 2 * MARGIN):
        height = min(last - y + 2 * MARGIN, ROWS)
        for x in range(0, mosaic.shape[1], PITCH - 2 * MARGIN):
            width = min(mosaic.shape[1] - x + 2 * MARGIN, PITCH)
            chroma = (y + x + red_row + red_column) & 1  # parity of red and blue in this tile
            for i in range(height):
                for j in range(width):
                    m[_U(i * PITCH + j)] = mosaic[rows[y + i], columns[x + j]]
            for i in range(3, height - 3):
                for k in range(i * PITCH + 3, i * PITCH + width - 3):
                    sum_h, weight_h = _green(m, code, k, 1, PITCH)
                    sum_v, weight_v = _green(m, code, k, PITCH, 1)
                    g[_U(k)] = (sum_h + sum_v) / (weight_h + weight_v)
                for j in range(3 + ((i + chroma) & 1), width - 3, 2):
                    g[_U(i * PITCH + j)] = m[_U(i * PITCH + j)]
            for i in range(4, height - 4):
                for k in range(i * PITCH + 4, i * PITCH + width - 4):
                    sum_f, weight_f = _difference(m, m, g, code, k, PITCH + 1)
                    sum_r, weight_r = _difference(m, m, g, code, k, PITCH - 1)
                    other[_U(k)] = g[_U(k)] + (sum_f + sum_r) / (weight_f + weight_r)
            for i in range(5, height - 5):
                for k in range(i * PITCH + 5, i * PITCH + width - 5):
                    sum_h, weight_h = _difference(m, m, g, code, k, 1)
                    sum_v, weight_v = _difference(other, m, g, code, k, PITCH)
                    along[_U(k)] = m[_U(k)] + (sum_h + sum_v) / (weight_h + weight_v)
                for k in range(i * PITCH + 5, i * PITCH + width - 5):
                    sum_h, weight_h = _difference(other, m, g, code, k, 1)
                    sum_v, weight_v = _difference(m, m, g, code, k, PITCH)
                    across[_U(k)] = m[_U(k)] + (sum_h + sum_v) / (weight_h + weight_v)
            for i in range(height - 2 * MARGIN):
                _write(m, g, other, along, across, i, width, red_row, red_column, y, x, out)


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
    c: NDArray[np.float32],
    m: NDArray[np.float32],
    g: NDArray[np.float32],
    code: np.float32,
    k: int,
    step: int,
) -> tuple[np.float32, np.float32]:
    """Return weighted sum and weight of colour c minus green at the two neighbours on one axis."""
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
def _write(
    m: NDArray[np.float32],
    g: NDArray[np.float32],
    other: NDArray[np.float32],
    along: NDArray[np.float32],
    across: NDArray[np.float32],
    i: int,
    width: int,
    red_row: int,
    red_column: int,
    y: int,
    x: int,
    out: NDArray[np.float32],
) -> None:
    """Write row i of a tile: at red and blue sites, then at green ones."""
    row_colour = 2 * ((y + i + red_row) & 1)  # red in red rows, blue in blue rows
    start = (y + i + x + red_row + red_column) & 1
    base = (i + MARGIN) * PITCH + MARGIN
    for j in range(start, width - 2 * MARGIN, 2):
        result = out[y + i, x + j]
        result[row_colour] = m[_U(base + j)]
        result[1] = g[_U(base + j)]
        result[2 - row_colour] = other[_U(base + j)]
    for j in range(1 - start, width - 2 * MARGIN, 2):
        result = out[y + i, x + j]
        result[row_colour] = along[_U(base + j)]
        result[1] = m[_U(base + j)]
        result[2 - row_colour] = across[_U(base + j)]


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
