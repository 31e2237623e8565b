"""Frames whose means scatter by other amounts in other exposures: no offset of the read-out."""

from collections.abc import Sequence
from math import ceil

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from analysis.mismatch.bank.key import MOSAIC
from analysis.mismatch.contradicted import Denial
from analysis.mismatch.resolved import FAR_OFF
from analysis.mismatch.state import State
from dsis.effects import Effect
from dsis.effects.black_level_drift import BlackLevelDrift

Array = NDArray[np.float64]
_LEAST = 4  # places, that halves of them tell something
_TELLING = 3  # exposures, that most of them tell something
_CLEAR, _SEEN = 4.0, 2.0  # standard deviations, by which a drift would stand out, and does
_CHANCE = 1e-3  # of a variance, on either side
_MOST = 0.25  # of a drift, below which chance leaves no half of them that scatter least


def unequal(state: State, effect: Effect, without: Array) -> Denial | None:
    """Return how a wander of all frames is denied by exposures that show less of it; None: not.

    The black level knows neither light nor exposure time: frames of all exposures wander by as
    much. Where with it some still scatter far more, and the half of all that scatter least show
    less than a quarter of it together, it is something else that only some exposures have. So it is
    where most exposures that can tell do not scatter as they would, see `_agreeing`.

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
    if not any(m.statistic == "frame_variance" and m.z > FAR_OFF for m in state.mismatches):
        return None
    which = _wandering(state, without, "exposure")
    denial = _agreeing(state, _wandering(state, without, MOSAIC) or which, without)
    if denial is not None or len(which) < _LEAST:
        return denial
    values, mean, sd = state.vector.values, state.null.mean, state.null.sd
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


def _wandering(state: State, without: Array, scope: str) -> list[int]:
    """Return which numbers say how far frames wander, of those that an effect would raise."""
    mean = state.null.mean
    return [
        i
        for i, key in enumerate(state.vector.keys)
        if (key.statistic, key.scope, key.detail) == ("frame_variance", scope, "")
        and state.null.known[i]
        and np.isfinite(without[i])
        and mean[i] > without[i]
    ]


def _agreeing(state: State, which: Sequence[int], without: Array) -> Denial | None:
    """Return how a wander of all frames is denied by exposures that scatter otherwise; None: not.

    Variances of frames' means are chi-squared, of so many degrees of freedom as the null scatters
    by. An exposure can tell where the wander would clearly stand out of what there is without it;
    it agrees where something does, by as much as chance allows. Where of three and more that can
    tell less than half agree, no wander of one size is in all. Channels of an exposure move
    together.
    """
    exposures: dict[str, list[int]] = {}
    for i in which:
        exposures.setdefault(state.vector.keys[i].exposure, []).append(i)
    agree = []
    for own in exposures.values():
        values, mean, bare = state.vector.values[own], state.null.mean[own], without[own]
        share = float((state.null.sd[own] / mean).mean())
        above = float(mean.mean() / bare.mean()) - 1, float(values.mean() / bare.mean()) - 1
        if above[0] < _CLEAR * share:
            continue
        free = 2 / (9 * share**2)
        ratio = float((values**3).mean() / (mean**3).mean())
        chance = float(chi2.cdf(free * ratio, free))
        agree.append(above[1] > _SEEN * share and _CHANCE < chance < 1 - _CHANCE)
    if len(agree) < _TELLING or 2 * sum(agree) >= len(agree):
        return None
    return Denial(sum(agree) / len(agree), "frames of most exposures do not wander by as much")
