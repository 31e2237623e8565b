"""Offsets of pixels, lines or frames that grow with exposure time, as no offset does."""

from math import exp

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.candidates import CANDIDATES
from analysis.mismatch.contradicted import Denial
from analysis.mismatch.rank import TOLD_APART
from analysis.mismatch.state import State

Array = NDArray[np.float64]
_OFFSETS = frozenset({"dsnu", "row_fpn", "column_fpn", "black_level_drift"})
_LEAST_NUMBER = 0.5  # of a cube root of a variance: below, its error is another's


def grown(state: State, kind: str, without: Array) -> Denial | None:
    """Return how offsets are denied by exposure times; None: they are not.

    Offsets are the same at all times. Where what pixels, lines or frames differ by in single
    exposures goes with the square of the times instead, at odds of 20, something that needs time
    makes them differ: trails of pixels that overflow, say, or a sensor that warms up.

    Parameters
    ----------
    state
        With the effect.
    kind
        The effect.
    without
        The numbers predicted without it.
    """
    if kind not in _OFFSETS:
        return None
    times = {e.name: e.exposure_time_s for e in state.setting.layout.exposures}
    changes, excess, errors, time_s = [], [], [], []
    calls = set(CANDIDATES[kind].calls) - {"level"}
    for i, key in enumerate(state.vector.keys):
        if key.statistic not in calls or key.exposure not in times:
            continue
        if not state.null.known[i]:
            continue
        # Numbers are cube roots of variances relative to noise.
        mean = float(state.null.mean[i])
        changes.append(mean**3 - float(without[i]) ** 3)
        excess.append(float(state.vector.values[i]) ** 3 - float(without[i]) ** 3)
        errors.append(3 * max(mean, _LEAST_NUMBER) ** 2 * float(state.null.sd[i]))
        time_s.append(times[key.exposure])
    error, shape = np.array(errors), np.array(changes)
    seen, alike = np.array(excess) / error, shape / error
    growing = alike * np.square(time_s)
    behind = (_left(seen, alike) - _left(seen, growing)) / 2
    if not behind > TOLD_APART:
        return None
    why = "it grows with exposure time, as no offset does"
    return Denial(1 / (1 + exp(min(behind, 700.0))), why)


def _left(seen: Array, shape: Array) -> float:
    """Return the square sum that a shape of the best size, if any, leaves."""
    square = float(shape @ shape)
    size = max(float(seen @ shape) / square, 0.0) if square > 0 else 0.0
    return float(np.square(seen - size * shape).sum())
