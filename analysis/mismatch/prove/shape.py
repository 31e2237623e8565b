"""The law of a standardised residual: the normal law, its mass re-weighted interval by interval.

How much lies in each interval is learned from a virtual sensor beside its base model, whose law is
known: noise that both share cancels. Up to five standard deviations the density is the normal one
times a step function, beyond it is constant in each interval.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

Array = NDArray[np.float64]
_OUTER = np.array([4.5, 5.0, 6.0, 8.0, 12.0, 20.0, 40.0, 80.0, 200.0])
EDGES: Array = np.concatenate([-_OUTER[::-1], np.arange(-16, 17) / 4, _OUTER])
_NORMAL: Array = np.diff(ndtr(EDGES))
_BELOW: Array = ndtr(EDGES[:-1])
_NORMAL_INSIDE: NDArray[np.bool_] = np.abs(EDGES[:-1] + EDGES[1:]) / 2 < 5
_LEAST = 1e-3  # of the normal mass: an interval that was never met


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

    def below(self, u: Array) -> Array:
        """Return the probability of lying below u."""
        if self.normal:
            return np.asarray(ndtr(u), np.float64)
        at = np.clip(np.searchsorted(EDGES, u, side="right") - 1, 0, self.mass.size - 1)
        ratio = self.mass / _NORMAL.clip(1e-300)
        start = np.concatenate([[0.0], np.cumsum(self.mass)[:-1]])
        curved = start[at] + ratio[at] * (ndtr(u) - _BELOW[at])
        slope = self.mass / np.diff(EDGES)
        straight = start[at] + slope[at] * (np.clip(u, EDGES[0], EDGES[-1]) - EDGES[at])
        return np.where(_NORMAL_INSIDE[at], curved, straight)


NORMAL = Shape(_NORMAL / _NORMAL.sum(), normal=True)


def counted(residuals: Array) -> Array:
    """Return how many standardised residuals lie in each interval; the last takes all beyond."""
    found, _ = np.histogram(np.clip(residuals, -199.0, 199.0), EDGES)
    return found.astype(np.float64)


def shape_of(counts: Array, base_counts: Array) -> Shape:
    """Return the law whose residuals were counted, beside normal ones of the same draws."""
    total, base_total = counts.sum(), base_counts.sum()
    if not total or not base_total:
        return NORMAL
    mass = NORMAL.mass + counts / total - base_counts / base_total
    mass = np.maximum(mass, np.maximum(_LEAST * NORMAL.mass, 1e-12))
    return Shape(mass / mass.sum(), normal=False)
