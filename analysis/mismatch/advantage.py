"""By how much one of two effects explains the numbers better, as recordings with each have it.

The likelihood of numbers takes each by itself. Of one sensor many are told by the same pixels - a
gain with and without what is taken off beside it, near an edge and far from it - and have chance in
common: ten nats may be what one sensor in twenty feigns. What recordings with either of two effects
gain by the first over the second says how much the gain of the recording is worth (D. R. Cox, Tests
of separate families of hypotheses, 4th Berkeley Symposium, 1961).
"""

from math import log, log1p

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.rank import Ranked
from analysis.mismatch.state import State

Array = NDArray[np.float64]
_LEAST_SD = 1e-6  # nats


def odds(state: State, best: Ranked, other: Ranked) -> tuple[float, float]:
    """Return by how much numbers are likelier with one effect than with another, and the odds.

    Both in nats, the odds of gains that are normally distributed over recordings of either kind. An
    effect that is further ahead than its own recordings would have it is as likely as if it were
    not.

    Parameters
    ----------
    state
        Without both.
    best, other
        The effects, fitted.
    """
    predictor = state.predictor()
    ahead = predictor.gain(best.mean) - predictor.gain(other.mean)
    with_best, with_other = _advantages(state, best.mean, other.mean)
    sizes = [max(float(own.std(ddof=1)), _LEAST_SD) for own in (with_best, with_other)]
    degrees = len(with_best) - 1
    wider = 1 + 1 / len(with_best)  # the means are no better known
    behind = min((ahead - float(with_best.mean())) / sizes[0], 0.0)
    beyond = max((ahead - float(with_other.mean())) / sizes[1], 0.0)
    far, near = (log1p(z**2 / (degrees * wider)) for z in (beyond, behind))
    return ahead, log(sizes[1] / sizes[0]) + (degrees + 1) / 2 * (far - near)


def _advantages(state: State, one: Array, other: Array) -> tuple[Array, Array]:
    """Return what one prediction gains over another in recordings of the one, and of the other.

    These scatter about what is predicted as simulated recordings of the state do about theirs: what
    an effect draws at random, and another sensor would have otherwise, is not in it.
    """
    predictor = state.predictor()
    scatter = state.simulated - state.null.mean
    found = []
    for mean in (one, other):
        beside = [predictor.beside(mean + own) for own in scatter]
        found.append(np.array([own.gain(one) - own.gain(other) for own in beside]))
    return found[0], found[1]
