"""Products of neighbouring pixels, summed over an image: where most of the time goes."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from dsis.compiled import ROWS_PER_BLOCK, inlined, kernel, over_rows

Sums = NDArray[np.float64]
_BLOCK = ROWS_PER_BLOCK


@lru_cache(maxsize=32)
def half_plane(reach: int) -> NDArray[np.int64]:
    """Return the lags (dy, dx) up to `reach`: dy > 0, or dy = 0 and dx >= 0; (lag, 2)."""
    lags = np.array(
        [(y, x) for y in range(reach + 1) for x in range(-reach, reach + 1) if y > 0 or x >= 0]
    )
    lags.flags.writeable = False
    return lags


def lag_products(image: NDArray[np.float32], reach: int, threads: int) -> Sums:
    """Return sums of image(y, x) image(y + dy, x + dx): (lag, row parity, column parity) of (y, x).

    The lags are those of `half_plane`; pairs that leave the image (C-contiguous) are left out.
    """
    rows, columns = image.shape
    sums = np.zeros((-(-rows // _BLOCK), len(half_plane(reach)), 2, 2))

    def block(first: int, last: int) -> None:
        by_column = np.empty((3, columns), np.float32)
        _lag_products(image, reach, first, last, _margin(columns, reach), by_column, sums)

    over_rows(block, rows, threads)
    total: Sums = sums.sum(0)
    return total


def lag_products_of_all(images: NDArray[np.float32], reach: int) -> Sums:
    """Return the sum of `lag_products` over images (image, row, column)."""
    count, rows, columns = images.shape
    sums = np.zeros((count, -(-rows // _BLOCK), len(half_plane(reach)), 2, 2))
    margin = _margin(columns, reach)
    by_column = np.empty((3, columns), np.float32)
    for image, own in zip(images, sums, strict=True):
        _lag_products(image, reach, 0, rows, margin, by_column, own)
    total: Sums = sums.sum(1).sum(0)
    return total


def _margin(columns: int, reach: int) -> NDArray[np.float32]:
    """Return room for a block of rows, zeros on all its sides."""
    return np.zeros((_BLOCK + reach + 8) * (columns + 2 * reach + 3), np.float32)


@kernel
def _lag_products(
    image: NDArray[np.float32],
    reach: int,
    first: int,
    last: int,
    margin: NDArray[np.float32],
    by_column: NDArray[np.float32],
    sums: Sums,
) -> None:
    """Sum products by column, in float32: it holds 32 products of one sign to 1e-6.

    Three lags and four rows at a time keep what is loaded in registers; a margin of zeros spares
    the ends of rows and columns a case of their own. Rows are copied in a loop: an assignment of
    slices takes a second more to compile.
    """
    rows, columns = image.shape
    wide = columns + 2 * reach + 3
    a, b, c = by_column[0], by_column[1], by_column[2]
    size, two = np.uintp(columns), np.uintp(2 * wide)
    for start in range(first, last, _BLOCK):
        height, loaded = min(_BLOCK, rows - start), min(_BLOCK + reach, rows - start)
        margin[loaded * wide :] = 0
        for y in range(loaded):
            for x in range(columns):
                margin[y * wide + reach + x] = image[start + y, x]
        lag = 0
        for dy in range(reach + 1):
            for dx in range(0 if dy == 0 else -reach, reach + 1, 3):
                lags = min(3, reach - dx + 1)
                for parity in range(2):
                    by_column[:] = 0
                    for y in range((start + parity) & 1, height, 8):
                        h0 = np.uintp(y * wide + reach)
                        t0 = np.uintp((y + dy) * wide + reach + dx)
                        h1, h2, h3 = h0 + two, h0 + two + two, h0 + two + two + two
                        t1, t2, t3 = t0 + two, t0 + two + two, t0 + two + two + two
                        for i in range(size):
                            v0, v1 = margin[h0 + i], margin[h1 + i]
                            v2, v3 = margin[h2 + i], margin[h3 + i]
                            j = i + np.uintp(1)
                            k = i + np.uintp(2)
                            a[i] = (
                                ((a[i] + v0 * margin[t0 + i]) + v1 * margin[t1 + i])
                                + v2 * margin[t2 + i]
                            ) + v3 * margin[t3 + i]
                            b[i] = (
                                ((b[i] + v0 * margin[t0 + j]) + v1 * margin[t1 + j])
                                + v2 * margin[t2 + j]
                            ) + v3 * margin[t3 + j]
                            c[i] = (
                                ((c[i] + v0 * margin[t0 + k]) + v1 * margin[t1 + k])
                                + v2 * margin[t2 + k]
                            ) + v3 * margin[t3 + k]
                    for g in range(lags):
                        _by_parity(by_column[g], sums[start // _BLOCK, lag + g, parity])
                lag += lags


@inlined
def _by_parity(line: NDArray[np.float32], out: Sums) -> None:
    """Write the sums of the even and of the odd entries."""
    even, odd = 0.0, 0.0
    for i in range(line.size // 2):
        even += line[2 * i]
        odd += line[2 * i + 1]
    if line.size & 1:
        even += line[line.size - 1]
    out[0], out[1] = even, odd
