"""Lines of a 2-D power spectrum: sinusoids, each in one bin, whatever the spectrum around it.

What makes neighbouring pixels alike (crosstalk, a memory, pink noise) bends a spectrum smoothly; a
sinusoid is a single bin, or leaks into few where its frequency lies between bins.
"""

from functools import lru_cache
from math import exp, expm1, log, log1p, sqrt

import numpy as np
from numpy.typing import NDArray
from scipy.special import betainc, gammaincc, gammainccinv, gammaln, log_ndtr, polygamma

from analysis.mismatch.bank.scalars import UNKNOWN, Number, middle_of_gamma, score_of_log
from dsis.compiled import inlined, kernel

Array = NDArray[np.float64]
Places = NDArray[np.int_]
_AROUND = 9  # bins along each axis whose median says what is around
_LOOKED_AT = 1024  # highest bins: lines are among them
_ALONE = -40.0  # ln of a chance, of which two bins in a spectrum are none
_HELD = 1e-290  # chances that a float holds
_ALMOST = 1 - 1e-12  # of a chance: its logarithm is finite
_SURE = -7.0  # logarithm of a chance, 1 in 1000: below, a bin stands out of those near it
_ROUNDED = 1e-9  # of a level: more than rounding may change
_NEAR = range(2, 7)  # bins on either side that say what is around: a line leaks into the next
_CHANCE = 0.01  # that any bin of a spectrum without lines is taken for one


def without_lines(power: Array, degrees: int) -> Array:
    """Return a spectrum with its lines cut down to what is around them.

    A line exceeds, by more than chance, the median of its neighbours along either axis: what rows
    or columns of bins have in common is no line.

    Parameters
    ----------
    power
        Half plane of a real transform (row, columns // 2 + 1), of any unit.
    degrees
        Independent frames in it.
    """
    y, x = _highest(power)
    limit = float(gammainccinv(degrees, _CHANCE / power.size)) / degrees
    found = power.copy()
    _cut_down(power, y, x, middle_of_gamma(degrees) / degrees, limit, found)
    return found


def separate(power: Array, columns: int, white: float, most: int) -> list[tuple[int, int, float]]:
    """Return row and column of the bins of separate lines, and their height, the highest first.

    Height is the power relative to white noise and to the most that higher lines leak into the bin:
    of a line between bins, bin k + d has up to (sin(pi / 2N) / sin(pi (d - 1/2) / N))^2 of what its
    larger bin k has, along each axis. The axes of the spectrum are left out: they hold what rows,
    columns and frames have in common.

    Parameters
    ----------
    power
        Half plane of a real transform (row, columns // 2 + 1).
    columns
        Columns of the image.
    white
        Power of a bin without lines.
    most
        How many lines.
    """
    rows = power.shape[0]
    y, x = _highest(power)
    # The last column of an even number holds each line twice, in conjugate bins.
    once = (y > 0) & (x > 0) & ~((2 * x == columns) & (2 * y > rows))
    y, x = y[once], x[once]
    height = power[y, x] / white
    tops, heights = _separated(y, x, height, _leaks(rows), _leaks(columns), min(most, y.size))
    return list(zip(y[tops].tolist(), x[tops].tolist(), heights.tolist(), strict=True))


@kernel
def _separated(
    y: Places, x: Places, height: Array, down: Array, across: Array, most: int
) -> tuple[Places, Array]:
    """Return which bins are the highest separate lines, and their heights, as `separate` does.

    `down` and `across` are the largest amplitudes that leak so many bins away, see `_leaks`.
    """
    level = np.ones(height.size)
    tops, heights = np.empty(most, np.int_), np.empty(most)
    for rank in range(most):
        top, highest = 0, height[0] / level[0]
        for i in range(1, height.size):
            if height[i] / level[i] > highest:
                top, highest = i, height[i] / level[i]
        tops[rank], heights[rank] = top, highest
        excess = max(height[top] - 1, 0.0)
        for i in range(height.size):
            leaked = down[y[i] - y[top]] * across[x[i] - x[top]]
            leaked += down[y[i] + y[top]] * across[x[i] + x[top]]  # of its conjugate
            level[i] += excess * (leaked * leaked)
        level[top] = np.inf
    return tops, heights


def log_chance(power: float, rank: int, bins: int, degrees: float) -> float:
    """Return the logarithm of the chance that so many of the bins are so high in white noise.

    Each is Gamma(degrees) / degrees, their number binomial.
    """
    single = _log_above(degrees, degrees * power)
    if single > _ALONE:
        return log(betainc(rank, bins - rank + 1, exp(single)))
    # The first term of the binomial sum: the next is as rare as one bin more.
    return float(rank * single + gammaln(bins + 1) - gammaln(rank + 1) - gammaln(bins - rank + 1))


def beside_others(power: Array, degrees: float) -> Array:
    """Return by how much each bin of a line's spectrum stands out of those near it: (bin,).

    In standard deviations of the logarithm of Gamma(degrees), beside the mean of the logarithms of
    `_NEAR` bins on either side: so a line is seen in noise of any smooth spectrum. Minus infinity
    at both ends, whose neighbours lie on one side. Power that falls as a power of the frequency is
    convex, and feigns no line.

    Parameters
    ----------
    power
        Of successive bins, (bin,), of any unit.
    degrees
        Independent frames in it.
    """
    found = np.full(power.size, -np.inf)
    ends = _NEAR[-1]
    if power.size <= 2 * ends or not power.min() > 0:
        return found
    logs = np.log(power)
    own = slice(ends, power.size - ends)
    beside = np.zeros(power.size - 2 * ends)
    for k in (sign * k for k in _NEAR for sign in (-1, 1)):
        beside += logs[ends + k : power.size - ends + k]
    found[own] = (logs[own] - beside / (2 * len(_NEAR))) / _spread(degrees)
    return found


@lru_cache(maxsize=64)
def _spread(degrees: float) -> float:
    """Return the standard deviation of the logarithm of a bin less the mean of those near it."""
    return sqrt(float(polygamma(1, max(degrees, 1.0))) * (1 + 1 / (2 * len(_NEAR))))


def chance_beside(standing_out: Array) -> float:
    """Return the logarithm of the chance of the largest of such deviations in noise."""
    known = standing_out[np.isfinite(standing_out)]
    return any_of(float(log_ndtr(-known.max())), known.size) if known.size else 0.0


def of_colour(power: Array, degrees: float) -> Number:
    """Return the normal score of the bin that stands out most of those near it."""
    chance = chance_beside(beside_others(power, degrees))
    return (score_of_log(chance), 1.0) if chance < 0 else UNKNOWN


def clearest_bin(power: Array, degrees: float) -> int:
    """Return the bin that stands out of those near it, if one does for sure; else the largest."""
    beside = beside_others(power, degrees)
    return int((beside if chance_beside(beside) < _SURE else power).argmax())


def any_of(log_least: float, count: float) -> float:
    """Return the logarithm of the chance that the least of independent chances is no larger."""
    if log_least < _ALONE:
        return log_least + log(count)
    return log(-expm1(count * log1p(-min(exp(log_least), _ALMOST))))


def _log_above(shape: float, x: float) -> float:
    """Return ln of the chance of Gamma(shape) above x; far out by Laplace's approximation."""
    chance = float(gammaincc(shape, x))
    if chance > _HELD:
        return log(chance)
    return float((shape - 1) * log(x) - x - gammaln(shape) - log1p(-max(shape - 1, 0.0) / x))


@kernel
def _cut_down(
    power: Array, y: Places, x: Places, typical: float, limit: float, found: Array
) -> None:
    """Write the level around a bin where one exceeds it so many times.

    The level is the larger median of the `_AROUND` bins around it along either axis, in units of
    what is `typical` of a mean of 1. Most bins need none: half of those around are high enough.
    """
    rows, half = power.shape
    lines = np.empty((2, _AROUND))
    for i in range(y.size):
        own = power[y[i], x[i]]
        enough = own / limit * typical * (1 + _ROUNDED)
        below = beside = 0
        for k in range(_AROUND):
            v, u = y[i] + k - _AROUND // 2, abs(x[i] + k - _AROUND // 2)
            u = min(u, 2 * (half - 1) - u)  # beyond its ends a half plane is mirrored
            while v < 0:  # a division takes longer
                v += rows
            while v >= rows:
                v -= rows
            while u < 0:
                u += half
            lines[0, k], lines[1, k] = power[v, x[i]], power[y[i], u]
            below += int(lines[0, k] > enough)
            beside += int(lines[1, k] > enough)
        if max(below, beside) > _AROUND // 2:
            continue
        level = max(_middle(lines[0]), _middle(lines[1])) / typical
        if own > limit * level:
            found[y[i], x[i]] = level


@inlined
def _middle(line: Array) -> float:
    """Return the median of few values, which are sorted."""
    for k in range(1, line.size):
        _insert(line, k, line[k])
    return float(line[line.size // 2])


@inlined
def _insert(line: Array, count: int, value: float) -> None:
    """Put a value where it belongs among the first, which ascend."""
    place = count
    while place > 0 and line[place - 1] > value:
        line[place] = line[place - 1]
        place -= 1
    line[place] = value


def _highest(power: Array) -> tuple[Places, Places]:
    """Return rows and columns of the highest bins, in the order of the spectrum."""
    count = min(_LOOKED_AT, power.size)
    found = np.sort(np.argpartition(power, -count, axis=None)[-count:])
    y, x = np.unravel_index(found, power.shape)
    return y, x


@lru_cache(maxsize=64)
def _leaks(size: int) -> Array:
    """Return the largest amplitude that leaks so many bins away, relative to the larger bin.

    For each distance of 0 to twice the size; negative ones wrap.
    """
    around = np.abs((np.arange(size) + size // 2) % size - size // 2)
    farther = np.sin(np.pi / (2 * size)) / np.sin(np.pi * (np.maximum(around, 1) - 0.5) / size)
    return np.tile(np.where(around > 0, farther, 1.0), 2)
