"""Frames whose means scatter by other amounts in other exposures: no offset of the read-out."""

from math import ceil

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.contradicted import Denial
from analysis.mismatch.resolved import FAR_OFF
from analysis.mismatch.state import State
from dsis.effects import Effect
from dsis.effects.black_level_drift import BlackLevelDrift

Array = NDArray[np.float64]
_LEAST = 4  # places, that halves of them tell something
_MOST = 0.25  # of a drift, below which chance leaves no half of them that scatter least


def unequal(state: State, effect: Effect, without: Array) -> Denial | None:
    """Return how a wander of all frames is denied by exposures that show less of it; None: not.

    The black level knows neither light nor exposure time: frames of all exposures wander by as
    much. Where with it some still scatter far more, and the half of all that scatter least show
    less than a quarter of it together, it is something else that only some exposures have.

    Parameters
    ----------
    state
        With the effect.
    effect
        The effect.
    without
        The numbers predicted without it.
    """
    if not isinstance(effect, BlackLevelDrift):
        return None
    values, mean, sd = state.vector.values, state.null.mean, state.null.sd
    which = [
        i
        for i, key in enumerate(state.vector.keys)
        if (key.statistic, key.scope) == ("frame_variance", "exposure")
        and state.null.known[i]
        and np.isfinite(without[i])
        and mean[i] > without[i]
    ]
    far = any(m.statistic == "frame_variance" and m.z > FAR_OFF for m in state.mismatches)
    if not far or len(which) < _LEAST:
        return None
    # Numbers are cube roots of variances relative to those of pixels.
    made = mean[which] ** 3 - without[which] ** 3
    shown = (values[which] ** 3 - without[which] ** 3) / made
    weights = (made / (3 * mean[which] ** 2 * sd[which])) ** 2
    least = np.argsort(shown)[: ceil(len(which) / 2)]
    share = float(np.average(shown[least], weights=weights[least]))
    if share >= _MOST:
        return None
    return Denial(
        max(share, 0.0), "frames of some exposures wander far more, and those of others less"
    )
