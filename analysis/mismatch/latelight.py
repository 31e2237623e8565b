"""Uneven gains and glows that uneven exposure times feign: a shutter is slower at one side."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from analysis.mismatch.contradicted import Denial, rival
from analysis.mismatch.rank import TOLD_APART
from analysis.mismatch.state import State

Array = NDArray[np.float64]
_OF_SIGNAL = frozenset({"shading", "tap_mismatch", "line_settling", "smooth_prnu"})
_OF_TIME = frozenset({"amp_glow"})
_CHANCE = 1e-3  # that late light explains as much of what is alike in all exposures


def of_late_light(state: State, kind: str) -> Denial | None:
    """Return how an uneven gain is denied by light that begins late somewhere; None: it is not.

    A gain is uneven in proportion to the signal, a glow to the exposure time. Where pixels are
    exposed for longer by the same time always, they collect more by their signal over the exposure
    time. Asked is how much each exposure leans and bows, beside what all have alike, and beside a
    glow or an uneven gain that is there as well: where that law is likelier at odds of 20, nothing
    else of these is there for certain. Of what all exposures have alike but for chance it says
    nothing: one law of many shapes is then likelier than another by chance. Exposures of one time
    do not tell, nor need they: what is uneven is then so by the same share at every level.
    """
    if kind not in _OF_SIGNAL | _OF_TIME:
        return None
    others = {own.kind for own in state.camera.effect} & (
        _OF_SIGNAL if kind in _OF_TIME else _OF_TIME
    )
    signals, behind, gained, shapes = state.calibrated.fit.signal_dn, 0.0, 0.0, 0
    times = {e.name: float(e.exposure_time_s) for e in state.setting.layout.uniform}
    for channel in state.setting.layout.channels:
        names = [e for e in times if (e, channel) in state.setting.seen.surfaces]
        signal = np.array([max(signals[name, channel], 0.0) for name in names])
        time = np.array([times[name] for name in names])
        if len(names) < 3 or not (time > 0).all():
            return None
        own = [state.setting.seen.surfaces[name, channel] for name in names]
        values = np.stack([one.coefficients for one in own])
        weights = np.array([1 / max(one.noise_dn2, 1e-9) for one in own])
        law, other = (time, signal) if kind in _OF_TIME else (signal, time)
        beside = [np.ones_like(time), *([other] if others else [])]
        late = _left([*beside, signal / time], values, weights)
        gained += _left(beside, values, weights) - late
        shapes += values.shape[1]
        behind += (_left([*beside, law], values, weights) - late) / 2
    if behind <= TOLD_APART or chi2.sf(gained, shapes) > _CHANCE:
        return None
    why = "it is uneven as light is that some pixels see for longer, the same time in each exposure"
    return rival(behind, why)


def _left(laws: Sequence[Array], values: Array, weights: Array) -> float:
    """Return chi-squared of values (exposure, shape) about multiples of laws, by exposure."""
    root = np.sqrt(weights)[:, np.newaxis]
    scaled = [law / max(float(law.max()), 1e-30) for law in laws]
    design = np.stack(scaled, 1) * root
    rest = values * root
    rest = rest - design @ np.linalg.lstsq(design, rest, rcond=None)[0]
    return float((rest**2).sum())
