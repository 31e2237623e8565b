"""By which law neighbours are alike: filters smooth all noise, crosstalk that of light alone."""

from collections.abc import Callable
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.clues import Clues
from analysis.mismatch.contradicted import Denial, rival
from analysis.mismatch.layout import Place
from analysis.mismatch.rank import TOLD_APART
from analysis.mismatch.recalibrate import code_step
from analysis.mismatch.state import State

Array = NDArray[np.float64]
_PAIRS = frozenset({"correlation_0_1", "correlation_1_0", "correlation_0_2", "correlation_2_0"})
_ROUNDING = 1 / 12  # of a step between codes, squared: noise that comes after any filter
_CLIPPED = 1e-3  # share of samples at an end of the converter, from which variances are not noise's


class Law(StrEnum):
    """What neighbours share, and so how their correlation changes from level to level."""

    ALL = "all noise alike"
    LIGHT = "noise of light alone"
    CHARGE = "noise of light, the more the brighter"


_LAWS = {
    "spatial_filtering": Law.ALL,
    "crosstalk": Law.LIGHT,
}


def shared_otherwise(state: State, kind: str, without: Array) -> Denial | None:
    """Return how a filter or crosstalk is denied by the law of what is shared; None: it is not.

    Where another law is likelier at odds of 20, whatever follows it, word or none, is there
    instead. `without` are the numbers predicted without the effect.
    """
    own = _LAWS.get(kind)
    if own is None:
        return None
    found = evidences(state, without)
    best = max(found, key=lambda law: found[law])
    behind = found[best] - found[own]
    if behind <= TOLD_APART:
        return None
    return rival(behind, f"neighbours share {best.value}, by how alike they are at each level")


def evidences(state: State, without: Array) -> dict[Law, float]:
    """Return what the correlations of neighbours gain by each law, in nats.

    Each correlation of each channel has a size of its own, by least squares over the uniform
    exposures: as many for each law, so that gains compare as they are. Of a share f of the noise
    the correlation is f times the correlation of that share; of charge it grows with the signal,
    too.

    Parameters
    ----------
    state
        With the effect or before it is taken in.
    without
        The numbers predicted without it.
    """
    clues = state.clues()
    shapes: dict[Law, Callable[[Place], float]] = {
        Law.ALL: lambda place: _unrounded(clues, place),
        Law.LIGHT: clues.shot_share,
        Law.CHARGE: lambda place: clues.signal(place) * clues.shot_share(place),
    }
    rows = _left(state, without)
    gains = dict.fromkeys(shapes, 0.0)
    for one in rows.values():
        values = np.array([value / sd for _, value, sd in one])
        for law, shape in shapes.items():
            own = np.array([shape(place) / sd for place, _, sd in one])
            square = float(own @ own)
            gains[law] += float(own @ values) ** 2 / (2 * square) if square > 0 else 0.0
    return gains


def _unrounded(clues: Clues, place: Place) -> float:
    """Return the share of a variance that was there before codes were rounded."""
    total = max(clues.seen.levels[place].variance_dn2, 1e-9)
    return max(1 - _ROUNDING * code_step(clues.camera) ** 2 / total, 0.0)


def _left(state: State, without: Array) -> dict[tuple[str, str], list[tuple[Place, float, float]]]:
    """Return place, value and its error of each correlation and channel: what an effect is to make.

    Not where the converter cuts noise off.
    """
    levels, uniform = state.setting.seen.levels, {e.name for e in state.setting.layout.uniform}
    found: dict[tuple[str, str], list[tuple[Place, float, float]]] = {}
    for i, key in enumerate(state.vector.keys):
        place = (key.exposure, key.channel)
        if key.statistic not in _PAIRS or key.scope != "exposure" or place not in levels:
            continue
        known = state.null.known[i] and np.isfinite(without[i]) and place[0] in uniform
        clipped = max(levels[place].clipped_low, levels[place].clipped_high) > _CLIPPED
        if known and not clipped:
            value = float(state.vector.values[i] - without[i])
            found.setdefault((key.statistic, key.channel), []).append(
                (place, value, float(state.null.sd[i]))
            )
    return found
