"""The highest of many bins of a spectrum: its normal score, and where between bins it lies."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.lines import log_chance
from analysis.mismatch.bank.scalars import UNKNOWN, Number, middle_of_gamma, score_of_log
from dsis.compiled import kernel
from dsis.measures.median import median

Array = NDArray[np.float64]
_SINGLE = ((1, 1),)
_BLOCKS = (*_SINGLE, (1, 2), (2, 1), (2, 2))
LEAST_BINS = 8
_ALTERNATES = 0.1  # bins from half a cycle per pixel: phases of a line drift by less than a tenth


@dataclass(frozen=True)
class Peak:
    """The largest bin of a spectrum: cycles per pixel of the plane along x and y, its height.

    `off` says where in the bin the frequency lies, -0.5 to 0.5 of a bin along y, by the larger
    neighbour: a sinusoid of bin k + d has (d / (1 - d))^2 as much power in bin k + 1 as in k.
    """

    fx: float
    fy: float
    power: float
    off: float = 0.0


def largest_line(power: Array, degrees: float) -> Number:
    """Return the normal score of the largest of half bins, from 0 to half a cycle per line.

    From one cycle a frame on: less is much like the frame's mean, which is off.
    """
    return largest(power[np.newaxis, 2:-1], max(round(degrees), 1), blocks=_SINGLE)


def line_top(power: Array) -> tuple[float, float, float]:
    """Return cycles a frame of the largest of half bins, what is beyond it, and its power."""
    place = int(power[2:].argmax())
    return place / 2 + 1, top(power[2:], place) / 2, float(power[place + 2])


def top(power: Array, place: int) -> float:
    """Return where the parabola through a bin and its neighbours is highest, -0.5 to 0.5."""
    if not 0 < place < power.size - 1:
        return 0.0
    below, at, above = (float(p) for p in power[place - 1 : place + 2])
    bend = below - 2 * at + above
    return float(np.clip((below - above) / (2 * bend), -0.5, 0.5)) if bend < 0 else 0.0


def largest(
    inner: Array,
    degrees: int,
    edge: Array | None = None,
    blocks: Sequence[tuple[int, int]] = _BLOCKS,
) -> Number:
    """Return the normal score of the largest bin, or block of two bins a side.

    A sinusoid between bins shows in all of a block, in a single one by 0.4 per axis at worst. White
    noise is the median bin, over that of Gamma(degrees) / degrees; `edge` are further bins.
    """
    if inner.size < LEAST_BINS:
        return UNKNOWN
    white = white_level(inner, degrees)
    if not white > 0:
        return UNKNOWN
    (rows, columns), own = inner.shape, _highest(inner)
    parts = [
        (own[high - 1][wide - 1], high * wide, (rows - high + 1) * (columns - wide + 1))
        for high, wide in blocks
        if high <= rows and wide <= columns
    ]
    if edge is not None and edge.size:
        parts.append((float(edge.max()), 1, edge.size))
    least = min(
        log_chance(power / white / bins, 1, count, degrees * bins) for power, bins, count in parts
    )
    return score_of_log(least), 1.0


@kernel
def _highest(inner: Array) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return the largest bin and the largest sums of `_BLOCKS`, by their rows and columns."""
    one, beside, below, four = -np.inf, -np.inf, -np.inf, -np.inf
    rows, columns = inner.shape
    for y in range(rows):
        line, after = inner[y], inner[min(y + 1, rows - 1)]
        for x in range(columns):
            one = max(one, line[x])
        for x in range(columns - 1):
            beside = max(beside, line[x] + line[x + 1])
        if y + 1 < rows:
            for x in range(columns):
                below = max(below, line[x] + after[x])
            for x in range(columns - 1):
                four = max(four, line[x] + line[x + 1] + after[x] + after[x + 1])
    return (one, beside), (below, four)


def white_level(power: Array, degrees: float) -> float:
    """Return the power of a bin of white noise, Gamma(degrees): by the median, without lines."""
    return median(power) * degrees / middle_of_gamma(degrees)


def summed(power: Array, block: tuple[int, int]) -> Array:
    """Return the sum of every block (rows, columns) of bins."""
    rows, columns = (size - own + 1 for size, own in zip(power.shape, block, strict=True))
    parts = [power[y : y + rows, x : x + columns] for y in range(block[0]) for x in range(block[1])]
    return reduce(np.add, parts)


def within_bin(power: Array, place: int) -> float:
    """Return where between bins a sinusoid in white noise of power 1 lies, -0.5 to 0.5."""
    excess = sqrt(max(float(power[place]) - 1, 0.0))
    below = sqrt(max(float(power[place - 1]) - 1, 0.0)) if place else 0.0
    above = sqrt(max(float(power[place + 1]) - 1, 0.0)) if place + 1 < power.size else 0.0
    side, larger = (1.0, above) if above >= below else (-1.0, below)
    return side * larger / (excess + larger) if excess > 0 else 0.0


def frequency(at: float, size: int) -> float:
    """Return cycles per pixel of cycles in all; what nearly alternates by pixel does so exactly."""
    return 0.5 if abs(at - size / 2) < _ALTERNATES else at / size
