"""A field of gains that the outermost lines make, whose pixels have fewer neighbours."""

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.contradicted import Denial
from analysis.mismatch.state import State
from dsis.effects import Effect
from dsis.effects.smooth_prnu import SmoothPrnu
from dsis.measures.fixed_pattern import Smooth

Array = NDArray[np.float64]
_MOST = 0.5  # of what smooth surfaces explain, that the outermost lines may make


def of_outermost_lines(state: State, effect: Effect) -> Denial | None:
    """Return how a field of gains is denied by the outermost lines; None: it is not.

    A single line at an edge that is darker than the others pulls polynomials along with it, which
    count most at their ends. A field goes on beyond it: where each outermost line is replaced by
    the next, as much is left. Where less than half of it is, beyond noise, lines of the edge differ
    and no field is seen.
    """
    if not isinstance(effect, SmoothPrnu):
        return None
    whole = inside = 0.0
    for (_, name), (image, noise) in state.setting.seen.images.items():
        if name == "gain":
            own = (image - image.mean()) / noise
            whole += _smooth(own)
            inside += _smooth(np.pad(own[1:-1, 1:-1], 1, mode="edge"))
    if whole <= 0 or inside > _MOST * whole:
        return None
    return Denial(max(inside / whole, 0.0), "lines at an edge make most of what is smooth in it")


def _smooth(image: Array) -> float:
    """Return the power of smooth surfaces of a map of unit noise, beyond that noise."""
    coefficients = Smooth.of(*image.shape).coefficients(image)
    order = np.arange(len(coefficients))
    taken = (order[:, np.newaxis] + order > 0) & (order[:, np.newaxis] + order < len(order))
    return float((coefficients[taken] ** 2 - 1).sum())
