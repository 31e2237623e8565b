"""The law of a standardised residual: the normal law, its mass re-weighted interval by interval.

How much lies in each interval is learned from a virtual sensor beside its base model, whose law is
known: noise that both share cancels. Up to five standard deviations the density is the normal one
times a step function, beyond it is constant in each interval.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr, pdtr, pdtrc

from dsis.compiled import kernel

Array = NDArray[np.float64]
_OUTER = np.array([4.5, 5.0, 6.0, 8.0, 12.0, 20.0, 40.0, 80.0, 200.0])
EDGES: Array = np.concatenate([-_OUTER[::-1], np.arange(-16, 17) / 4, _OUTER])
_NORMAL: Array = np.diff(ndtr(EDGES))
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


def interval_of(residuals: NDArray[np.floating]) -> NDArray[np.intp]:
    """Return the interval of each standardised residual; the last ones take all beyond."""
    flat = residuals.reshape(-1)
    # The many lie in intervals of 1 / 4.
    near = np.floor(np.clip(flat, -4.25, 4.0) * 4)
    found: NDArray[np.intp] = near.astype(np.intp) + (_OUTER.size + 16)
    far = np.flatnonzero(np.abs(flat) >= 4)
    found[far] = np.searchsorted(EDGES, np.clip(flat[far], -199.0, 199.0), side="right") - 1
    return found


def counted(intervals: NDArray[np.intp]) -> Array:
    """Return how many residuals lie in each interval."""
    return np.bincount(intervals, minlength=EDGES.size - 1).astype(np.float64)


def moved(own: NDArray[np.intp], base: NDArray[np.intp]) -> Array:
    """Return how many residuals came to each interval or left it, of the same draws."""
    other = own != base
    return counted(own[other]) + counted(base[other])


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
    """Return how many to expect where few are: none met is no proof that there are none."""
    met = np.rint(np.maximum(expected + difference, 0))
    crowded = (met > 0) & (pdtrc(np.maximum(met - 1, 0), expected) < _CHANCE)
    return np.where(crowded, met, np.where(pdtr(met, expected) < _CHANCE, met + 1, expected))


@kernel
def _interpolate(u: Array, table: Array, reach: float, per_unit: float, out: Array) -> None:
    last = table.size - 2
    for i in range(u.size):
        place = (min(max(u[i], -reach), reach) + reach) * per_unit
        knot = min(int(place), last)
        low = table[knot]
        out[i] = low + (place - knot) * (table[knot + 1] - low)
