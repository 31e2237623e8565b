"""A soft full well that no level comes near: levels bend, as of any response."""

import numpy as np
from scipy.special import expit

from analysis.mismatch.candidates.patterns import made_of_light
from analysis.mismatch.contradicted import Denial
from analysis.mismatch.state import State
from dsis.effects import Effect
from dsis.effects.saturation import Saturation

_BRIGHTEST = 3.0  # standard deviations of noise: of many pixels some have as much
_FULLEST = 3.0  # standard deviations of full wells that differ: of many pixels some have so little
_BENT = 0.9  # of charge that comes, that a pixel still keeps where a limit is near


def far_below(state: State, effect: Effect) -> Denial | None:
    """Return how a soft full well is denied by levels that all lie far below it; None: they do not.

    A pixel that fills up collects less and less of what comes: with a softness k the share
    1 / (1 + exp((Q - full well) / k)) of it. Where even the brightest pixels keep nine tenths,
    levels bend, as those of any response may, and nothing shows that they have a limit.
    """
    if not isinstance(effect, Saturation) or not effect.softness_dn:
        return None
    levels, clues = state.setting.seen.levels, state.clues()
    had = {channel: made_of_light(clues, channel) for channel in clues.layout.sites}
    brightest = {channel: float(own.max() / own.mean()) for channel, own in had.items()}
    flats = {e.name for e in state.setting.layout.uniform if e.kind == "flat"}
    most = max(
        (
            max(state.setting.layout.signal_dn[place], 0.0) * brightest.get(place[1], 1.0)
            + _BRIGHTEST * max(own.variance_dn2, 0.0) ** 0.5
            for place, own in levels.items()
            if place[0] in flats
        ),
        default=np.inf,
    )
    least = effect.full_well_dn * (1 - _FULLEST * effect.spread_percent / 100)
    kept = float(expit((least - most) / effect.softness_dn))
    if kept < _BENT:
        return None
    return Denial(1 - kept, "no level is near the full well: levels bend as of any response")
