"""Memory of one lag among many that stand out: the largest of them is no lag of its own."""

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.contradicted import Denial
from analysis.mismatch.state import State

Array = NDArray[np.float64]
_KIND = "readout_memory"
_STATISTIC = "line_correlation"
_CLEAR = 5.0  # standard deviations, from which a lag stands out
_MOST = 1.0  # of what the memory's own lag shows, that another may


def other_lags(state: State, kind: str, mean: Array, without: Array) -> Denial | None:
    """Return how memory is denied by other lags along the same lines; None: it is not.

    A sample that remembers one read before is alike at that lag. Where others that the memory does
    not change are left as far off as its own lag was, something correlates samples at all of them -
    lines that are left over, noise of whole rows - of which one is the largest.

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
    known = state.null.known & np.isfinite(mean) & np.isfinite(without)
    own = np.array([key.statistic == _STATISTIC for key in keys]) & known
    if not own.any():
        return None
    change = np.where(own, mean - without, 0.0) / state.null.sd
    left = np.where(own, state.vector.values - mean, 0.0) / state.null.sd
    first = int(np.argmax(np.abs(change)))
    axis = keys[first].detail.split(" ")[0]
    shown = abs(float(change[first] + left[first]))
    others = [
        abs(float(left[i]))
        for i in np.flatnonzero(own)
        if keys[i].detail.split(" ")[0] == axis and abs(change[i]) < abs(change[first]) / 2
    ]
    most = max(others, default=0.0)
    if most < _CLEAR or most < _MOST * shown:
        return None
    return Denial(1 - shown / (shown + most), "samples are alike at other lags as well")
