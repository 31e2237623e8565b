"""Groups of similar blocks: taken from an image, transformed together, and put back.

A group lies as (block row, member, block column), so that the transform along rows, the transform
between members and the shrinkage run over long contiguous stretches. Members stand in bit-reversed
order: Haar's pairs are then always the two halves of what is left.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dsis.compiled import inlined, kernel

MOST = 32  # members of a group, at most
_SQRT_HALF = np.float32(np.sqrt(0.5))
_U = np.uintp


class Groups(NamedTuple):
    """The groups of a band of reference blocks.

    `places` (row, column, member) and `counts` (row, column) are `match_blocks`'s; `slots`
    (1 + log2 MOST, MOST) tells where each member of a group of 2^k stands.
    """

    places: NDArray[np.int32]
    counts: NDArray[np.int32]
    slots: NDArray[np.intp]


class Sums(NamedTuple):
    """What the groups of a band add up to: weighted estimates, and their weights.

    `total` and `weight` are float32 (channel, row, column); their row 0 is row `top` of the image.
    """

    top: int
    total: NDArray[np.float32]
    weight: NDArray[np.float32]


def bit_reversed() -> NDArray[np.intp]:
    """Return (1 + log2 MOST, MOST): row k holds the slots of the members of a group of 2^k."""
    bits = MOST.bit_length() - 1
    slots = np.zeros((bits + 1, MOST), np.intp)
    for k in range(bits + 1):
        for n in range(1 << k):
            slots[k, n] = int(f"{n:0{k}b}"[::-1], 2) if k else 0
    return slots


@kernel
def gather(
    plane: NDArray[np.float32], places: NDArray[np.int32], slots: NDArray[np.intp], count: int,
    group: NDArray[np.float32],
) -> None:  # fmt: skip
    """Fill a group with the blocks of a plane, each in its slot."""
    width = plane.shape[1]
    for m in range(count):
        y, x, s = places[m] // width, places[m] % width, slots[m] * 8
        for k in range(8):
            source, target = plane[y + k], group[k]
            for j in range(8):
                target[_U(s + j)] = source[_U(x + j)]


@kernel
def haar(group: NDArray[np.float32], count: int) -> None:
    """Transform between members: sums and differences of pairs, over sqrt(2), of the sums again."""
    half = count * 4
    while half >= 8:
        _pairs(group, half)
        half //= 2


@kernel
def haar_back(group: NDArray[np.float32], count: int) -> None:
    """Undo `haar`."""
    half = 8
    while half <= count * 4:
        _pairs(group, half)
        half *= 2


@inlined
def _pairs(group: NDArray[np.float32], half: int) -> None:
    """Replace the first half of what is left by its sums with the second, that by differences."""
    for k in range(8):
        low, high = group[k, :half], group[k, half : 2 * half]
        for n in range(half):
            p, q = low[_U(n)], high[_U(n)]
            low[_U(n)] = (p + q) * _SQRT_HALF
            high[_U(n)] = (p - q) * _SQRT_HALF


@inlined
def _along_rows(
    matrix: NDArray[np.float32], a: NDArray[np.float32], b: NDArray[np.float32], count: int
) -> None:
    """Fill b[i] with the sum over k of matrix[i, k] a[k]."""
    a0, a1, a2, a3, a4, a5, a6, a7 = a[0], a[1], a[2], a[3], a[4], a[5], a[6], a[7]
    for i in range(8):
        m0, m1, m2, m3 = matrix[i, 0], matrix[i, 1], matrix[i, 2], matrix[i, 3]
        m4, m5, m6, m7 = matrix[i, 4], matrix[i, 5], matrix[i, 6], matrix[i, 7]
        out = b[i]
        for n in range(count * 8):
            k = _U(n)
            upper = (m0 * a0[k] + m1 * a1[k]) + (m2 * a2[k] + m3 * a3[k])
            out[k] = upper + ((m4 * a4[k] + m5 * a5[k]) + (m6 * a6[k] + m7 * a7[k]))


@kernel
def transform(
    matrix: NDArray[np.float32], a: NDArray[np.float32], spare: NDArray[np.float32], count: int
) -> None:
    """Replace each member's block X by (matrix X matrix^T)^T; twice keeps the orientation."""
    _along_rows(matrix, a, spare, count)
    for m in range(0, count * 8, 8):
        for i in range(8):
            source = spare[i]
            for j in range(8):
                a[_U(j), _U(m + i)] = source[_U(m + j)]
    _along_rows(matrix, a, spare, count)
    for i in range(8):
        source, target = spare[i], a[i]
        for n in range(count * 8):
            target[_U(n)] = source[_U(n)]


@kernel
def scatter(
    group: NDArray[np.float32], places: NDArray[np.int32], slots: NDArray[np.intp], count: int,
    window: NDArray[np.float32], certainty: np.float32, sums: Sums, channel: int,
) -> None:  # fmt: skip
    """Add each member's block where it came from, weighted by the window and `certainty`."""
    total, weight = sums.total[channel], sums.weight[channel]
    width = total.shape[1]
    for m in range(count):
        y, x, s = places[m] // width - sums.top, places[m] % width, slots[m] * 8
        for k in range(8):
            block, w, t, n = group[k], window[k], total[y + k], weight[y + k]
            for j in range(8):
                certain = certainty * w[_U(j)]
                t[_U(x + j)] += certain * block[_U(s + j)]
                n[_U(x + j)] += certain
