"""Whether levels bend smoothly, by whatever law, rather than where a read-out path begins."""

from collections.abc import Sequence
from math import log

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.state import State

Array = NDArray[np.float64]
_DEGREES = (2, 3)  # of a response: bent one way, or by more in one half than in the other
_TOLD_APART = 3.0  # of log-likelihood: odds of 20


def behind_smooth(state: State, mean: Array) -> float:
    """Return by how much log-likelihood a smooth bend explains the levels better than an effect.

    `mean` are the numbers predicted with the effect, whose size is free; the smooth bend is a
    polynomial in the signal S. Beside both each channel's scale is free. A free number costs half
    the logarithm of the number of levels (Schwarz, Annals of Statistics 6, 1978); where even the
    better law misfits, all errors are larger by as much (Birge, Physical Review 40, 1932). Minus
    infinity: levels do not say.
    """
    flats = {e.name for e in state.setting.layout.uniform if e.kind == "flat"}
    signals = state.calibrated.fit.signal_dn
    which = [
        i
        for i, key in enumerate(state.vector.keys)
        if key.statistic == "level" and key.scope == "exposure" and key.exposure in flats
        if state.null.known[i] and np.isfinite(mean[i])
    ]
    places = [state.vector.keys[i].place for i in which]
    sd = state.null.sd[which]
    value = (state.vector.values[which] - state.null.mean[which]) / sd
    signal = np.array([max(signals[at], 0.0) for at in places])
    change = (mean[which] - state.null.mean[which]) / sd
    if not change.any():
        return -np.inf
    s = signal / signal.max()
    channels = sorted({channel for _, channel in places})
    scales = [np.where([own == channel for _, own in places], s, 0.0) / sd for channel in channels]
    price = log(len(which))
    laws = [[*scales, *(s**power / sd for power in range(2, most + 1))] for most in _DEGREES]
    fits = [(_misfit(value, law), len(law)) for law in (*laws, [*scales, change])]
    if any(free >= len(which) for _, free in fits):
        return -np.inf
    *smooth, own = (misfit + free * price for misfit, free in fits)
    wider = min(misfit / (len(which) - free) for misfit, free in fits)
    best = min(smooth)
    return (own - best) / 2 / max(wider, 1.0)


def at_no_switch(state: State, kind: str, mean: Array) -> bool:
    """Return whether levels deny that gains of read-out paths disagree: they bend smoothly."""
    return kind == "dual_gain_mismatch" and behind_smooth(state, mean) >= _TOLD_APART


def smooth_as_well(state: State, mean: Array, kind: str, other: str) -> bool:
    """Return whether levels bend smoothly by some law at least as well as they do at a switch.

    The one law of a bend that a nonlinearity is fitted as may gain less: its kind has others.
    """
    if (kind, other) != ("dual_gain_mismatch", "nonlinearity"):
        return False
    return 0 <= behind_smooth(state, mean) < _TOLD_APART


def _misfit(value: Array, columns: Sequence[Array]) -> float:
    """Return the sum of squares that columns leave of values."""
    design = np.stack(columns, 1)
    return float(((value - design @ np.linalg.lstsq(design, value, rcond=None)[0]) ** 2).sum())
