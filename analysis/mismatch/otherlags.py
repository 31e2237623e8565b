"""Memory of one lag among many that are alike or stand out: it is no lag of its own."""

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.coherent import ALTERNATING
from analysis.mismatch.contradicted import Denial
from analysis.mismatch.state import State
from dsis.effects import Effect
from dsis.effects.readout_memory import ReadoutMemory

Array = NDArray[np.float64]
_KIND = "readout_memory"
_BESIDE = {"correlation_0_1": "rows", "correlation_1_0": "columns"}
_NEIGHBOURS = frozenset({"adc_memory", "crosstalk", "readout_memory", "spatial_filtering"})
_STATISTIC = "line_correlation"
_CLEAR = 4.0  # standard deviations, from which a lag stands out
_ALIKE = 0.5  # of what it explains, that most other lags must keep to be like it
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
    if (denial := _alternating(state, kind, mean, without)) is not None or kind != _KIND:
        return denial
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


def _alternating(state: State, kind: str, mean: Array, without: Array) -> Denial | None:
    """Return how what makes neighbours alike is denied by lines that alternate; None: it is not.

    A line of n samples that alternates by noise of its own has that power, beside white noise's 1,
    in one of n waves: neighbours are unlike by 1 / n of it, at all odd lags. Where the effect makes
    them unlike along that axis, and by no more than twice as much, that may be all there is.
    """
    if kind not in _NEIGHBOURS or all(m.statistic != ALTERNATING for m in state.mismatches):
        return None
    layout = state.setting.layout
    size = {"rows": layout.columns, "columns": layout.rows}
    power, unlike = dict.fromkeys(size, 0.0), dict.fromkeys(size, 0.0)
    changed = 0.0
    for i, key in enumerate(state.vector.keys):
        if not (state.null.known[i] and np.isfinite(mean[i]) and np.isfinite(without[i])):
            continue
        if key.statistic == ALTERNATING:
            left = (state.vector.values[i] - mean[i]) / state.null.sd[i]
            beyond = state.vector.values[i] ** 3 - mean[i] ** 3
            power[key.detail] = max(power.get(key.detail, 0.0), beyond if left > _CLEAR else 0.0)
        elif key.statistic in _BESIDE and key.scope == "exposure":
            change, axis = float(mean[i] - without[i]), _BESIDE[key.statistic]
            unlike[axis] = max(unlike[axis], -change)
            changed = max(changed, abs(change))
    if any(
        unlike[axis] >= _LEAST * changed > 0 and power[axis] / size[axis] > _LEAST * unlike[axis]
        for axis in size
    ):
        return Denial(0.0, "lines alternate by noise of their own, and neighbours with them")
    return None


def alike(state: State, effect: Effect, without: Array) -> Denial | None:
    """Return how memory of one lag is denied by lags that are all alike; None: it is not.

    What samples of a line have in common makes them alike at all distances; a memory does at its
    own. Where most other lags along the axis keep half of what it explains, it is one of those.
    """
    if not isinstance(effect, ReadoutMemory):
        return None
    step = 1 if state.setting.layout.channels == ("MONO",) else 2
    own = f"{effect.along} {effect.lag_pixels / step:g}"
    explained, left = 0.0, []
    for i, key in enumerate(state.vector.keys):
        if key.statistic != _STATISTIC or not state.null.known[i]:
            continue
        if key.detail == own:
            explained = float(state.null.mean[i] - without[i])
        elif key.detail.startswith(effect.along):
            left.append(float(state.vector.values[i] - state.null.mean[i]))
    typical = float(np.median(left)) if left else 0.0
    if typical * explained <= 0 or abs(typical) < _ALIKE * abs(explained):
        return None
    why = "samples of a line are as much alike at other distances"
    return Denial(max(1 - abs(typical / explained), 0.0), why)
