"""The law of a standardised residual: the normal law, its mass re-weighted interval by interval.

How much lies in each interval is learned from a virtual sensor beside its base model, whose law is
known: noise that both share cancels. Up to five standard deviations the density is the normal one
times a step function, beyond it is constant in each interval.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from dsis.compiled import kernel

Array = NDArray[np.float64]
_OUTER = np.array([4.5, 5.0, 6.0, 8.0, 12.0, 20.0, 40.0, 80.0, 200.0])
EDGES: Array = np.concatenate([-_OUTER[::-1], np.arange(-16, 17) / 4, _OUTER])
_NORMAL: Array = np.diff(ndtr(EDGES))
_LEAST = 1e-3  # of the normal mass: an interval that was never met
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


def counted(residuals: NDArray[np.floating]) -> Array:
    """Return how many standardised residuals lie in each interval; the last takes all beyond."""
    flat = residuals.reshape(-1)
    near = np.bincount(  # the many, in intervals of 1 / 4
        np.floor(np.clip(flat, -4.25, 4.0) * 4).astype(np.intp) + 17, minlength=34
    )
    far = flat[np.abs(flat) >= 4]
    found, _ = np.histogram(np.clip(far, -199.0, 199.0), EDGES)
    found[_OUTER.size : -_OUTER.size] = near[1:33]
    return found.astype(np.float64)


def shape_of(counts: Array, base_counts: Array) -> Shape:
    """Return the law whose residuals were counted, beside normal ones of the same draws.

    The chance departures of the base model's counts from the normal law are taken off.
    """
    total = counts.sum()
    if not total:
        return NORMAL
    mass = (counts - base_counts + base_counts.sum() * NORMAL.mass) / total
    mass = np.maximum(mass, np.maximum(_LEAST * NORMAL.mass, 1e-12))
    return Shape(mass / mass.sum(), normal=False)


@kernel
def _interpolate(u: Array, table: Array, reach: float, per_unit: float, out: Array) -> None:
    last = table.size - 2
    for i in range(u.size):
        place = (min(max(u[i], -reach), reach) + reach) * per_unit
        knot = min(int(place), last)
        low = table[knot]
        out[i] = low + (place - knot) * (table[knot + 1] - low)
