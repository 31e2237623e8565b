"""How the coefficients of a group are shrunk, and the noise variance that each of them has.

Makinen, Azzari and Foi (2020, see `bm3d`): where noise is correlated, the variance of a coefficient
follows from the covariances of the blocks, which the places of the members give.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dsis.compiled import inlined, kernel

_CERTAIN = np.float32(1e15)  # the mean stays: its square over itself plus any variance is 1
_U = np.uintp


class Shrinkage(NamedTuple):
    """How coefficients are shrunk.

    `forward` and `inverse` are the (8, 8) matrices of the block transform; `covariance` is the
    noise covariance of a coefficient of two blocks, (channel, 2 j + 1, 2 j + 1, 64): offset along
    rows and columns, coefficient, the horizontal one first; further away it vanishes; `least` the
    smallest variance that is believed. With j = 0 even blocks that overlap are taken to be
    independent. `threshold` in standard deviations; `window`, (8, 8), weighs a block's pixels.
    """

    forward: NDArray[np.float32]
    inverse: NDArray[np.float32]
    covariance: NDArray[np.float32]
    least: np.float32
    threshold: np.float32
    window: NDArray[np.float32]


@kernel
def repeat(one: NDArray[np.float32], least: np.float32, variance: NDArray[np.float32]) -> None:
    """Give every member's coefficients the variances of one block."""
    for h in range(8):
        for n in range(variance.shape[1]):
            variance[h, n] = max(one[h * 8 + n % 8], least)


@kernel
def fill_covariances(
    covariance: NDArray[np.float32], places: NDArray[np.int32], slots: NDArray[np.intp],
    count: int, width: int, between: NDArray[np.float32],
) -> None:  # fmt: skip
    """Fill the covariances between members, those above the diagonal, by slot."""
    reach = covariance.shape[0] // 2
    rows, columns = places[:count] // width, places[:count] % width
    for m in range(count):
        for n in range(m, count):
            dy, dx = rows[n] - rows[m], columns[n] - columns[m]
            target = between[min(slots[m], slots[n]), max(slots[m], slots[n])]
            if abs(dy) > reach or abs(dx) > reach:
                target[:] = np.float32(0)
                continue
            source = covariance[dy + reach, dx + reach]
            for c in range(64):
                target[_U(c)] = source[_U(c)]


@kernel
def combine_covariances(
    between: NDArray[np.float32], least: np.float32, variance: NDArray[np.float32], count: int
) -> None:
    """Turn covariances between members into variances after Haar's transform between them.

    The difference of a pair has half the sum of its variances less its covariance; the sums have
    covariances again.
    """
    half = count // 2
    while half > 0:
        for i in range(half):
            a, b, ab = between[i, i], between[i + half, i + half], between[i, i + half]
            for h in range(8):
                target = variance[h, (i + half) * 8 : (i + half + 1) * 8]
                for v in range(8):
                    c = _U(h * 8 + v)
                    target[_U(v)] = max((a[c] + b[c]) * np.float32(0.5) - ab[c], least)
        for i in range(half):
            for j in range(i, half):
                a, b = between[i, j], between[i + half, j + half]
                p, q = between[i, j + half], between[j, i + half]
                for n in range(64):
                    c = _U(n)
                    a[c] = ((a[c] + b[c]) + (p[c] + q[c])) * np.float32(0.5)
        half //= 2
    for h in range(8):
        for v in range(8):
            variance[h, v] = max(between[0, 0, h * 8 + v], least)


@kernel
def cut(
    a: NDArray[np.float32], variance: NDArray[np.float32], threshold: np.float32,
    left: NDArray[np.float32], count: int,
) -> np.float32:  # fmt: skip
    """Set small coefficients to zero; return the noise variance in those that stay."""
    zero, mean, square = np.float32(0), a[0, 0], threshold * threshold
    left[:] = zero
    for k in range(8):
        row, v = a[k], variance[k]
        for n in range(count * 8):
            i = _U(n)
            stays = row[i] * row[i] > square * v[i]
            row[i] = row[i] if stays else zero
            left[i] += v[i] if stays else zero
    if a[0, 0] == zero:
        left[0] += variance[0, 0]
    a[0, 0] = mean
    return _sum(left, count)


@kernel
def shrink_as_wiener(
    a: NDArray[np.float32], b: NDArray[np.float32], variance: NDArray[np.float32],
    left: NDArray[np.float32], count: int,
) -> np.float32:  # fmt: skip
    """Multiply by b^2/(b^2 + v); return the noise variance that remains."""
    b[0, 0] = _CERTAIN
    left[:] = np.float32(0)
    for k in range(8):
        row, other, v = a[k], b[k], variance[k]
        for n in range(count * 8):
            i = _U(n)
            energy = other[i] * other[i]
            gain = energy / (energy + v[i])
            row[i] *= gain
            left[i] += gain * gain * v[i]
    return _sum(left, count)


@inlined
def _sum(left: NDArray[np.float32], count: int) -> np.float32:
    total = np.float32(0)
    for n in range(count * 8):
        total += left[_U(n)]
    return np.float32(total)
