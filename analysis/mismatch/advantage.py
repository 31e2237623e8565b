"""By how much one of two effects explains the numbers better, as recordings with each have it.

The likelihood of numbers takes each by itself. Of one sensor many are told by the same pixels - a
gain with and without what is taken off beside it, near an edge and far from it - and have chance in
common: ten nats may be what one sensor in twenty feigns. What recordings with either of two effects
gain by the first over the second says how much the gain of the recording is worth (D. R. Cox, Tests
of separate families of hypotheses, 4th Berkeley Symposium, 1961).
"""

from math import log1p

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.rank import Ranked
from analysis.mismatch.state import State

Array = NDArray[np.float64]
_LEAST_SD = 1e-6  # nats


def odds(state: State, best: Ranked, other: Ranked, ahead: float) -> float:
    """Return the logarithm of the odds of one effect against another, nats.

    Of gains that are normally distributed over recordings of either kind. An effect that is further
    ahead than its own recordings would have it is as likely as if it were not.

    Parameters
    ----------
    state
        Without both.
    best, other
        The effects, fitted.
    ahead
        By how much the first gains more than the second in the recording, nats.
    """
    with_best, with_other = _advantages(state, best.mean, other.mean)
    behind = max(_scores(with_best, -ahead, -1), 0.0)
    beyond = max(_scores(with_other, ahead, 1), 0.0)
    degrees = len(with_best) - 1
    return (degrees + 1) / 2 * (log1p(beyond**2 / degrees) - log1p(behind**2 / degrees))


def _scores(gains: Array, value: float, sign: int) -> float:
    """Return by how many standard deviations a value is above gains, or their negatives."""
    sd = max(float(gains.std(ddof=1)), _LEAST_SD)
    return (value - sign * float(gains.mean())) / sd


def _advantages(state: State, one: Array, other: Array) -> tuple[Array, Array]:
    """Return what one prediction gains over another in recordings of the one, and of the other.

    These scatter about what is predicted as simulated recordings of the state do about theirs.
    """
    predictor = state.predictor()
    scatter = state.simulated - state.null.mean
    found = []
    for mean in (one, other):
        beside = [predictor.beside(mean + own) for own in scatter]
        found.append(np.array([own.gain(one) - own.gain(other) for own in beside]))
    return found[0], found[1]
