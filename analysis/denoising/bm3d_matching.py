"""Block matching: for every reference block the most similar blocks of its neighbourhood.

For one row of reference blocks and one offset, the squared differences of all blocks along that
row share their column sums: eight rows are summed once per column, then eight columns in three
doublings. This is the exact distance of Dabov et al. (2007), equation (5) without pre-filter, at a
hundredth of the cost of comparing block by block.
"""

import numpy as np
from numpy.typing import NDArray

from dsis.compiled import kernel

_U = np.uintp


@kernel
def match_blocks(
    plane: NDArray[np.float32],
    rows: NDArray[np.intp],
    columns: NDArray[np.intp],
    bias: NDArray[np.float32],
    limit: np.float32,
    places: NDArray[np.int32],
    counts: NDArray[np.int32],
) -> None:
    """Find the nearest blocks of each reference block, itself first, then by distance.

    Parameters
    ----------
    plane
        float32 (row, column): where blocks are compared.
    rows, columns
        Upper left corners of the reference blocks: all pairs of the two.
    bias
        (2 r + 1, 2 r + 1): squared distance that noise alone gives at each offset, relative to
        white noise; subtracted. r is the reach of the search.
    limit
        Sum of squared differences up to which a block is similar.
    places
        Result, (rows, columns, most): row * plane width + column of each similar block.
    counts
        Result, (rows, columns): how many of them are used, the largest power of two found.
    """
    height, width = plane.shape
    reach, most = bias.shape[0] // 2, places.shape[2]
    nearest = np.empty((columns.size, most), np.float32)
    one = np.empty(width, np.float32)
    two = np.empty(width, np.float32)
    for r in range(rows.size):
        y = rows[r]
        for c in range(columns.size):
            places[r, c, 0] = y * width + columns[c]
            counts[r, c] = 1
        for dy in range(-min(reach, y), min(reach, height - 8 - y) + 1):
            for dx in range(-reach, reach + 1):
                if dy == 0 and dx == 0:
                    continue
                first, last = max(0, -dx), width - max(0, dx)
                _differences(plane, y, dy, dx, first, last, one)
                _double(one, two, first, last - 1, 1)
                _double(two, one, first, last - 3, 2)
                _double(one, two, first, last - 7, 4)
                _insert(
                    two, columns, first, last - 8, bias[dy + reach, dx + reach], limit,
                    y * width + dy * width + dx, nearest, places[r], counts[r],
                )  # fmt: skip
        for c in range(columns.size):
            used = 1
            while 2 * used <= counts[r, c]:
                used *= 2
            counts[r, c] = used


@kernel
def _differences(
    plane: NDArray[np.float32], y: int, dy: int, dx: int, first: int, last: int,
    out: NDArray[np.float32],
) -> None:  # fmt: skip
    """Fill out[first:last] with the squared differences to offset (dy, dx), summed over 8 rows."""
    a0, a1, a2, a3 = plane[y], plane[y + 1], plane[y + 2], plane[y + 3]
    a4, a5, a6, a7 = plane[y + 4], plane[y + 5], plane[y + 6], plane[y + 7]
    v = y + dy
    b0, b1, b2, b3 = plane[v], plane[v + 1], plane[v + 2], plane[v + 3]
    b4, b5, b6, b7 = plane[v + 4], plane[v + 5], plane[v + 6], plane[v + 7]
    for x in range(first, last):
        i, k = _U(x), _U(x + dx)
        d0, d1, d2, d3 = a0[i] - b0[k], a1[i] - b1[k], a2[i] - b2[k], a3[i] - b3[k]
        d4, d5, d6, d7 = a4[i] - b4[k], a5[i] - b5[k], a6[i] - b6[k], a7[i] - b7[k]
        upper = (d0 * d0 + d1 * d1) + (d2 * d2 + d3 * d3)
        out[i] = upper + ((d4 * d4 + d5 * d5) + (d6 * d6 + d7 * d7))


@kernel
def _double(
    a: NDArray[np.float32], b: NDArray[np.float32], first: int, last: int, step: int
) -> None:
    """Fill b[first:last] with a[x] + a[x + step]."""
    for x in range(first, last):
        b[_U(x)] = a[_U(x)] + a[_U(x + step)]


@kernel
def _insert(
    distance: NDArray[np.float32],
    columns: NDArray[np.intp],
    first: int,
    last: int,
    bias: np.float32,
    limit: np.float32,
    place: int,
    nearest: NDArray[np.float32],
    places: NDArray[np.int32],
    counts: NDArray[np.int32],
) -> None:
    """Keep the candidate at one offset for each reference block whose list it improves."""
    most = nearest.shape[1]
    for c in range(columns.size):
        x = columns[c]
        if x < first or x > last:
            continue
        d = distance[_U(x)] - bias
        found = counts[c]
        if d >= limit or (found == most and d >= nearest[c, most - 1]):
            continue
        n = found if found < most else most - 1
        while n > 1 and d < nearest[c, n - 1]:
            nearest[c, n] = nearest[c, n - 1]
            places[c, n] = places[c, n - 1]
            n -= 1
        nearest[c, n] = d
        places[c, n] = place + x
        if found < most:
            counts[c] = found + 1
