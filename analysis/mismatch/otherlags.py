"""Memory of one lag among many that stand out: the largest of them is no lag of its own."""

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.contradicted import Denial
from analysis.mismatch.state import State

Array = NDArray[np.float64]
_KIND = "readout_memory"
_STATISTIC = "line_correlation"
_CLEAR = 4.0  # standard deviations, from which a lag stands out
_LEAST = 0.5  # of the squares of what stands out along lines, that the memory must explain


def other_lags(state: State, kind: str, mean: Array, without: Array) -> Denial | None:
    """Return how memory is denied by other lags along the same lines; None: it is not.

    A sample that remembers one read before is alike at that lag. Where more is left at lags that
    the memory does not change than it explains, something correlates samples at all of them - lines
    that are left over, noise of whole rows - of which one is the largest.

    Parameters
    ----------
    state
        With the memory, or before it is taken in.
    kind
        The effect; of any other nothing is said.
    mean, without
        The numbers predicted with it, and without it.
    """
    if kind != _KIND:
        return None
    keys = state.vector.keys
    if all(key.statistic != _STATISTIC for key in keys):
        return None
    known = state.null.known & np.isfinite(mean) & np.isfinite(without)
    own = np.array([key.statistic == _STATISTIC for key in keys]) & known
    if not own.any():
        return None
    change = np.where(own, mean - without, 0.0) / state.null.sd
    left = np.where(own, state.vector.values - mean, 0.0) / state.null.sd
    first = int(np.argmax(np.abs(change)))
    if abs(change[first]) < _CLEAR:
        return None  # lags along lines do not show it
    axis, lag = keys[first].detail.split(" ")
    shown = more = 0.0
    for i in np.flatnonzero(own).tolist():
        where, number = keys[i].detail.split(" ")
        if where == axis and number == lag:
            shown += float(change[i]) ** 2
        elif where == axis and abs(left[i]) > _CLEAR:
            more += float(left[i]) ** 2
    share = shown / (shown + more)
    return Denial(share, "samples are alike at other lags as well") if share < _LEAST else None
