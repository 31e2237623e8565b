"""The law of a standardised residual: the normal law, its mass re-weighted interval by interval.

How much lies in each interval is learned from a virtual sensor beside its base model, whose law is
known: noise that both share cancels. Up to five standard deviations the density is the normal one
times a step function, beyond it is constant in each interval.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr, pdtr, pdtrc

from dsis.compiled import inlined, kernel
from dsis.effects import Image

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
_OUTER = np.array([4.5, 5.0, 6.0, 8.0, 12.0, 20.0, 40.0, 80.0, 200.0])
EDGES: Array = np.concatenate([-_OUTER[::-1], np.arange(-16, 17) / 4, _OUTER])
_NORMAL: Array = np.diff(ndtr(EDGES))
_MIDDLE = _OUTER.size + 16  # the interval that begins at 0
_MANY = 10.0  # residuals expected in an interval, from which their number is nearly normal
_SURE = 2.5  # standard errors of chi-squared below which departures count as none
_CHANCE = 0.01  # probability of as many, or as few, below which an interval differs
_REACH, _PER_UNIT = 200, 64  # of the table of the distribution function


@dataclass(frozen=True)
class Shape:
    """A law on the line.

    Attributes
    ----------
    mass
        Probability of each interval between `EDGES`.
    normal
        Whether it is the normal law itself.
    """

    mass: Array
    normal: bool

    def below(self, u: NDArray[np.floating]) -> Array:
        """Return the probability of lying below u."""
        if self.normal:
            return np.asarray(ndtr(u, dtype=np.float64), np.float64)
        out = np.empty(u.shape)
        flat = np.ascontiguousarray(u, np.float64).reshape(-1)
        _interpolate(flat, self._table, np.float64(_REACH), np.float64(_PER_UNIT), out.reshape(-1))
        return out

    @cached_property
    def _table(self) -> Array:
        """The distribution function at steps of 1 / 64, straight between them."""
        knots = np.arange(-_REACH * _PER_UNIT, _REACH * _PER_UNIT + 1) / _PER_UNIT
        at = np.clip(np.searchsorted(EDGES, knots, side="right") - 1, 0, self.mass.size - 1)
        start = np.concatenate([[0.0], np.cumsum(self.mass)[:-1]])
        inside = np.abs(EDGES[:-1] + EDGES[1:]) / 2 < 5
        curved = (ndtr(knots) - ndtr(EDGES[at])) / np.where(inside, _NORMAL, 1.0)[at]
        straight = (knots - EDGES[at]) / np.diff(EDGES)[at]
        table: Array = start[at] + self.mass[at] * np.where(inside[at], curved, straight)
        return table


NORMAL = Shape(_NORMAL / _NORMAL.sum(), normal=True)


@dataclass(frozen=True)
class Tally:
    """How many residuals of a sensor and of its base model's lie in each interval.

    Attributes
    ----------
    ordinary, base_ordinary
        Of ordinary pixels, by interval.
    exchanged
        How many came to each interval or left it, of pixels that are ordinary in both.
    odd, base_odd
        Of all other pixels.
    """

    ordinary: Array
    base_ordinary: Array
    exchanged: Array
    odd: Array
    base_odd: Array

    @classmethod
    def of(cls, own: Image, base: Image, many: Mask, base_many: Mask) -> "Tally":
        """Count standardised residuals (frame, row, column) of the same draws.

        `many` and `base_many` tell the ordinary pixels of each. The last intervals take all beyond.
        """
        counts = np.zeros((5, EDGES.size - 1), np.int64)
        _count(own, base, many, base_many, EDGES, counts)
        return cls(*counts.astype(np.float64))


def shape_of(counts: Array, base_counts: Array, exchanged: Array) -> Shape:
    """Return the law whose residuals were counted, beside normal ones of the same draws.

    The chance departures of the base model's counts from the normal law are taken off. What then
    departs from it is believed as far as it exceeds chance: of intervals where many are expected
    all together (James and Stein, 1961), of the others each that chance alone would hardly fill, or
    empty, so.

    Parameters
    ----------
    counts, base_counts
        Of the model and of its base model, by interval.
    exchanged
        How many came or left, by interval: the variance of the difference.
    """
    total = base_counts.sum()
    if not counts.sum() or not total:
        return NORMAL
    expected = total * NORMAL.mass
    difference = counts * (total / counts.sum()) - base_counts
    many = expected >= _MANY
    chi2 = float((difference[many] ** 2 / np.maximum(exchanged[many], 1)).sum())
    chance = many.sum() + _SURE * np.sqrt(2 * many.sum())
    believed = max(1 - chance / chi2, 0.0) if chi2 else 0.0
    shrunk = expected + believed * difference
    mass = np.maximum(np.where(many, shrunk, _sparse(expected, difference)) / total, 1e-12)
    return Shape(mass / mass.sum(), normal=False)


def _sparse(expected: Array, difference: Array) -> Array:
    """Return how many to expect where few are: none met is no proof that there are none.

    On each side, up to the interval beyond the farthest one that chance would hardly fill, half a
    residual more than were met (Krichevsky and Trofimov, 1981): where spikes are, one more may be.
    """
    met = np.rint(np.maximum(expected + difference, 0))
    crowded = (met > 0) & (pdtrc(np.maximum(met - 1, 0), expected) < _CHANCE)
    made = np.where(crowded, met, np.where(pdtr(met, expected) < _CHANCE, met + 1, expected))
    filled = np.flatnonzero(crowded)
    if filled.size:
        place = np.arange(met.size)
        first, last = min(filled[0] - 1, _MIDDLE), max(filled[-1] + 1, _MIDDLE)
        inside = (place >= first) & (place <= last)
        made = np.where(inside, np.maximum(made, met + 0.5), made)
    return np.asarray(made, np.float64)


@inlined
def _interval(u: Any, edges: Any) -> Any:
    """Return the interval of a standardised residual; the last ones take all beyond."""
    if abs(u) < np.float32(4):  # the many lie in intervals of 1 / 4
        return int(np.floor(u * np.float32(4))) + _MIDDLE
    last = edges.size - 2
    k = 0
    while k < last and u >= edges[k + 1]:
        k += 1
    return k


@kernel
def _count(
    own: Image, base: Image, many: Mask, base_many: Mask, edges: Array, counts: NDArray[np.int64]
) -> None:
    frames, rows, columns = own.shape
    for frame in range(frames):
        for row in range(rows):
            for column in range(columns):
                one = _interval(own[frame, row, column], edges)
                other = _interval(base[frame, row, column], edges)
                here, there = many[row, column], base_many[row, column]
                counts[0 if here else 3, one] += 1
                counts[1 if there else 4, other] += 1
                if here and there and one != other:
                    counts[2, one] += 1
                    counts[2, other] += 1


@kernel
def _interpolate(u: Array, table: Array, reach: float, per_unit: float, out: Array) -> None:
    last = table.size - 2
    for i in range(u.size):
        place = (min(max(u[i], -reach), reach) + reach) * per_unit
        knot = min(int(place), last)
        low = table[knot]
        out[i] = low + (place - knot) * (table[knot + 1] - low)
