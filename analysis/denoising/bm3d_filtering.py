"""Collaborative filtering: similar blocks are transformed together, shrunk, and put back.

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
_CERTAIN = np.float32(1e15)  # the mean stays: its square over itself plus any variance is 1
_U = np.uintp


class Groups(NamedTuple):
    """The groups of a band of reference blocks.

    `places` (row, column, member) and `counts` (row, column) are `match_blocks`'s; `slots`
    (1 + log2 MOST, MOST) tells where each member of a group of 2^k stands.
    """

    places: NDArray[np.int32]
    counts: NDArray[np.int32]
    slots: NDArray[np.intp]


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


def bit_reversed() -> NDArray[np.intp]:
    """Return (1 + log2 MOST, MOST): row k holds the slots of the members of a group of 2^k."""
    bits = MOST.bit_length() - 1
    slots = np.zeros((bits + 1, MOST), np.intp)
    for k in range(bits + 1):
        for n in range(1 << k):
            slots[k, n] = int(f"{n:0{k}b}"[::-1], 2) if k else 0
    return slots


@kernel
def filter_groups(
    noisy: NDArray[np.float32],
    basic: NDArray[np.float32],
    groups: Groups,
    shrinkage: Shrinkage,
    top: int,
    total: NDArray[np.float32],
    weight: NDArray[np.float32],
) -> None:
    """Filter the groups of a band and add the results, times their weights, to its buffers.

    With an empty `basic` coefficients below the threshold are set to zero (weight: one over the
    noise variance that remains); otherwise they are multiplied by Wiener's b^2/(b^2 + v), b from
    `basic`, v the noise variance. The mean of a group is kept as it is: a shift of the image shifts
    the result.

    Parameters
    ----------
    noisy, basic
        float32 (channel, row, column); `basic` may have no channel.
    groups, shrinkage
        See there.
    top
        Row of the image that row 0 of the buffers is.
    total, weight
        Buffers, float32 (channel, row, column).
    """
    channels, _, width = noisy.shape
    wiener = basic.shape[0] > 0
    a = np.empty((8, MOST * 8), np.float32)
    b = np.empty((8, MOST * 8), np.float32)
    spare = np.empty((8, MOST * 8), np.float32)
    left = np.empty(MOST * 8, np.float32)
    independent = shrinkage.covariance.shape[1] == 1
    variances = np.empty((channels, 8, MOST * 8), np.float32)
    for channel in range(channels):
        _repeat(shrinkage.covariance[channel, 0, 0], shrinkage.least, variances[channel])
    members = 1 if independent else MOST
    between = np.empty((members, members, 64), np.float32)
    for r in range(groups.counts.shape[0]):
        for c in range(groups.counts.shape[1]):
            count = groups.counts[r, c]
            order = 0
            while (1 << order) < count:
                order += 1
            slots = groups.slots[order]
            places = groups.places[r, c]
            for channel in range(channels):
                variance = variances[channel]
                if not independent:
                    covariance = shrinkage.covariance[channel]
                    fill_covariances(covariance, places, slots, count, width, between)
                    combine_covariances(between, shrinkage.least, variance, count)
                _gather(noisy[channel], places, slots, count, a)
                _haar(a, count)
                _transform(shrinkage.forward, a, spare, count)
                if wiener:
                    _gather(basic[channel], places, slots, count, b)
                    _haar(b, count)
                    _transform(shrinkage.forward, b, spare, count)
                    remaining = _shrink_as_wiener(a, b, variance, left, count)
                else:
                    remaining = _cut(a, variance, shrinkage.threshold, left, count)
                _transform(shrinkage.inverse, a, spare, count)
                _haar_back(a, count)
                _scatter(
                    a, places, slots, count, width, top, shrinkage.window,
                    np.float32(1) / remaining, total[channel], weight[channel],
                )  # fmt: skip


@kernel
def _repeat(one: NDArray[np.float32], least: np.float32, variance: NDArray[np.float32]) -> None:
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
def _gather(
    plane: NDArray[np.float32], places: NDArray[np.int32], slots: NDArray[np.intp], count: int,
    group: NDArray[np.float32],
) -> None:  # fmt: skip
    width = plane.shape[1]
    for m in range(count):
        y, x, s = places[m] // width, places[m] % width, slots[m] * 8
        for k in range(8):
            source, target = plane[y + k], group[k]
            for j in range(8):
                target[_U(s + j)] = source[_U(x + j)]


@kernel
def _haar(group: NDArray[np.float32], count: int) -> None:
    """Transform between members: sums and differences of pairs, over sqrt(2), of the sums again."""
    half = count * 4
    while half >= 8:
        for k in range(8):
            low, high = group[k, :half], group[k, half : 2 * half]
            for n in range(half):
                p, q = low[_U(n)], high[_U(n)]
                low[_U(n)] = (p + q) * _SQRT_HALF
                high[_U(n)] = (p - q) * _SQRT_HALF
        half //= 2


@kernel
def _haar_back(group: NDArray[np.float32], count: int) -> None:
    half = 8
    while half <= count * 4:
        for k in range(8):
            low, high = group[k, :half], group[k, half : 2 * half]
            for n in range(half):
                p, q = low[_U(n)], high[_U(n)]
                low[_U(n)] = (p + q) * _SQRT_HALF
                high[_U(n)] = (p - q) * _SQRT_HALF
        half *= 2


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
def _transform(
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
def _cut(
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
def _shrink_as_wiener(
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


@kernel
def _scatter(
    group: NDArray[np.float32],
    places: NDArray[np.int32],
    slots: NDArray[np.intp],
    count: int,
    width: int,
    top: int,
    window: NDArray[np.float32],
    certainty: np.float32,
    total: NDArray[np.float32],
    weight: NDArray[np.float32],
) -> None:
    """Add each member's block where it came from, weighted by the window and `certainty`."""
    for m in range(count):
        y, x, s = places[m] // width - top, places[m] % width, slots[m] * 8
        for k in range(8):
            block, w, t, n = group[k], window[k], total[y + k], weight[y + k]
            for j in range(8):
                certain = certainty * w[_U(j)]
                t[_U(x + j)] += certain * block[_U(s + j)]
                n[_U(x + j)] += certain
