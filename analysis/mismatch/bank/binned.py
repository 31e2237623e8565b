"""Bins of the spectrum of a map beside others: what is around them, and what of them stands out."""

import numpy as np
from numpy.typing import NDArray

from dsis.compiled import inlined, kernel

Array = NDArray[np.float64]
Places = NDArray[np.int_]
Mask = NDArray[np.bool_]
_AROUND, _OWN = 7, 2  # bins to each side that say what is around, and those that do not
MEAN_LOG = -0.5772156649  # mean of the logarithm of an exponential variate


@kernel
def beyond_white(power: Array, white: float, limit: float, places: tuple[Places, Places]) -> Array:
    """Return what bins move beyond white noise, in its units; 0 where chance moves them as much."""
    found = np.empty(places[0].size)
    for i in range(found.size):
        own = power[places[0][i], places[1][i]] / max(white, 1e-300)
        found[i] = own - 1 if own > limit else 0.0
    return found


@kernel
def in_rings(power: Array, within: Mask, ring: Array, sums: Array, logs: Array) -> None:
    """Add the logarithms of bins to their rings."""
    for y in range(power.shape[0]):
        for x in range(power.shape[1]):
            logs[y, x] = np.log(max(power[y, x], 1e-300))
            if within[y, x]:
                sums[int(ring[y, x] + 0.5)] += logs[y, x]


@kernel
def beside_rings(means: Array, ring: Array, level: Array, logs: Array) -> None:
    """Take from logarithms what rings tell of their mean."""
    for y in range(ring.shape[0]):
        for x in range(ring.shape[1]):
            lower = int(ring[y, x])
            mean = means[lower] + (ring[y, x] - lower) * (means[lower + 1] - means[lower])
            level[y, x] = np.exp(mean)
            logs[y, x] -= mean + MEAN_LOG


@kernel
def above(power: Array, level: Array, within: Mask, limit: float, found: Places) -> int:
    """Write rows and columns of bins above a limit; return how many there are, written or not."""
    count = 0
    for y in range(power.shape[0]):
        for x in range(power.shape[1]):
            if within[y, x] and power[y, x] > limit * level[y, x]:
                if count < found.shape[1]:
                    found[0, count], found[1, count] = y, x
                count += 1
    return count


@kernel
def highest_corner(level: Array, places: tuple[Places, Places], down: int, right: int) -> Array:
    """Return the highest level of the bins between which places lie."""
    rows, last = level.shape[0], level.shape[1] - 1
    found = np.zeros(places[0].size)
    for i in range(found.size):
        for v in range(down + 1):
            for u in range(right + 1):
                y, x = (places[0][i] + v) % rows, min(places[1][i] + u, last)
                found[i] = max(found[i], level[y, x])
    return found


@kernel
def of_still(
    power: Array,
    level: Array,
    within: Mask,
    moved: tuple[Array, float, float],
    places: tuple[Places, Places],
    around: Array,
) -> Array:
    """Return sums over three bins along each axis about places, in units of the level around.

    Those that are not looked at, or move as of `beyond_white`, count as 1.
    """
    rows, last = power.shape[0], power.shape[1] - 1
    found = np.zeros(places[0].size)
    for i in range(found.size):
        for v in range(-1, 2):
            for u in range(-1, 2):
                y, x = (places[0][i] + v) % rows, min(places[1][i] + u, last)
                own = moved[0][y, x] / max(moved[1], 1e-300)
                if within[y, x] and not own > moved[2]:
                    found[i] += power[y, x] / level[y, x] / around[i]
                else:
                    found[i] += 1.0
    return found


@kernel
def blocks(power: Array, level: Array, within: Mask) -> Array:
    """Return sums over three bins along each axis, in units of their level; others count as 1."""
    rows, columns = power.shape
    found = np.zeros((rows, columns))
    line = np.ones(columns)
    for y in range(rows):
        for x in range(columns):
            line[x] = power[y, x] / level[y, x] if within[y, x] else 1.0
        for x in range(columns):
            three = line[x] + (line[x - 1] if x else 1.0)
            three += line[x + 1] if x + 1 < columns else 1.0
            found[(y - 1) % rows, x] += three
            found[y, x] += three
            found[(y + 1) % rows, x] += three
    return found


@kernel
def nearby(
    apart: Array,
    within: Mask,
    columns: int,
    places: tuple[Places, Places],
    found: tuple[Array, Array],
) -> None:
    """Count the bins around places, and sum how far they are off; around the ends too."""
    rows = apart.shape[0]
    for i in range(places[0].size):
        at, sums = places[1][i], (0, 0.0)
        for v in range(-_AROUND, _AROUND + 1):
            y = (places[0][i] + v) % rows
            if abs(v) > _OWN:
                sums = _along(apart, within, columns, y, at - _AROUND, at + _AROUND + 1, sums)
            else:
                sums = _along(apart, within, columns, y, at - _AROUND, at - _OWN, sums)
                sums = _along(apart, within, columns, y, at + _OWN + 1, at + _AROUND + 1, sums)
        found[0][i], found[1][i] = sums


@inlined
def _along(
    apart: Array,
    within: Mask,
    columns: int,
    y: int,
    first: int,
    end: int,
    sums: tuple[int, float],
) -> tuple[int, float]:
    """Return count and sum with the bins of a part of a line."""
    rows, half = apart.shape
    number, total = sums
    if first >= 0 and end <= half:
        for x in range(np.uintp(first), np.uintp(end)):
            if within[y, x]:
                number += 1
                total += apart[y, x]
        return number, total
    for beside in range(first, end):
        below, x = y, beside
        if x < 0 or x >= half:  # a bin's conjugate is at the opposite frequency
            below, x = (rows - y) % rows, -x if x < 0 else columns - x
        if 0 <= x < half and within[below, x]:
            number += 1
            total += apart[below, x]
    return number, total
