"""By which law neighbours are alike: filters smooth all noise, crosstalk that of light alone."""

from collections.abc import Callable, Sequence
from enum import StrEnum
from functools import partial

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.basefit import CLIPPED_SHARE
from analysis.mismatch.clues import Clues
from analysis.mismatch.contradicted import Denial, rival
from analysis.mismatch.layout import Place
from analysis.mismatch.rank import TOLD_APART
from analysis.mismatch.recalibrate import code_step
from analysis.mismatch.state import State
from analysis.mismatch.straight import bent, misfits, upwards

Array = NDArray[np.float64]
Left = dict[tuple[str, str], list[tuple[Place, float, float]]]
_BESIDE = frozenset({"correlation_0_1", "correlation_1_0"})
_PAIRS = _BESIDE | {"correlation_0_2", "correlation_2_0"}
_GRAINS = "noise that is added as the square of the signal"
_READ = "noise of the read-out alone"
_ROUNDING = 1 / 12  # of a step between codes, squared: noise that comes after any filter


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
    instead. What charge takes from variances counts, for or against it, where these are left
    unexplained and the model's lie on a line; noise in grains is asked of where they bend upwards.
    Of a filter, which smooths all noise, whether it is that of the read-out alone: a pattern of
    blocks, a wander of the supply. `without` are the numbers predicted without the effect.
    """
    own = _LAWS.get(kind)
    if own is None:
        return None
    left = left_by(state, without, _PAIRS)
    if not left:
        return None
    found = _gains(state.clues(), left)
    said: dict[str, float] = {}
    if any(m.statistic == "pixel_variance" for m in state.mismatches):
        if not bent(state):
            before, after = misfits(state, _factor(state.clues(), left))
            found[Law.CHARGE] += (before - after) / 2
        if upwards(state):
            grains = _grains(state.clues())
            said[_GRAINS] = sum(_fitted(one, grains)[1] for one in left.values())
    if own == Law.ALL:
        said[_READ] = sum(
            _fitted(one, partial(_read_share, state.clues()))[1] for one in left.values()
        )
    said |= {law.value: gain for law, gain in found.items()}
    best = max(said, key=lambda law: said[law])
    behind = said[best] - found[own]
    if behind <= TOLD_APART:
        return None
    return rival(behind, f"neighbours share {best}, by how alike they are at each level")


def of_charge(state: State) -> Callable[[Place, float], float] | None:
    """Return by what variances lack what neighbours share as charge does; None: they do not.

    The factor of a place, or a default: what restores its variance. The camera's own crosstalk or
    filter is taken for what it is put in for: charge may be shared by another law, as long as that
    is not less likely, at odds of 20, than any other.
    """
    camera = state.camera
    others = tuple(own for own in camera.effect if own.kind not in _LAWS)
    without = state.null.mean
    if len(others) < len(camera.effect):
        without = state.predictor().mean(camera.model_copy(update={"effect": others}))
    left = left_by(state, without, _BESIDE)
    found = _gains(state.clues(), left)
    charge = found[Law.CHARGE]
    if charge <= TOLD_APART or charge < max(found.values()) - TOLD_APART:
        return None
    return _factor(state.clues(), left)


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
    return _gains(state.clues(), left_by(state, without, _PAIRS))


def _gains(clues: Clues, left: Left) -> dict[Law, float]:
    shapes = _shapes(clues)
    return {
        law: sum(_fitted(own, shape)[1] for own in left.values()) for law, shape in shapes.items()
    }


def _shapes(clues: Clues) -> dict[Law, Callable[[Place], float]]:
    """Return how large correlations are by each law, but for a factor."""
    return {
        Law.ALL: lambda place: _unrounded(clues, place),
        Law.LIGHT: clues.shot_share,
        Law.CHARGE: lambda place: clues.signal(place) * clues.shot_share(place),
    }


def _grains(clues: Clues) -> Callable[[Place], float]:
    """Return how large correlations are where part of the variance is the signal's square."""
    levels = clues.seen.levels
    return lambda at: clues.signal(at) ** 2 / max(levels[at].variance_dn2, 1e-9)


def _fitted(
    seen: Sequence[tuple[Place, float, float]], shape: Callable[[Place], float]
) -> tuple[float, float]:
    """Return the factor of a shape, by least squares, and the log-likelihood it gains."""
    values = np.array([value / sd for _, value, sd in seen])
    own = np.array([shape(place) / sd for place, _, sd in seen])
    square, through = float(own @ own), float(own @ values)
    return (through / square, through**2 / (2 * square)) if square > 0 else (0.0, 0.0)


def _factor(clues: Clues, left: Left) -> Callable[[Place, float], float]:
    """Return what restores variances of places whose neighbours share charge.

    Each place by the correlations of its channel with the next pixels along rows and columns, as
    the law has them.
    """
    shape = _shapes(clues)[Law.CHARGE]
    sizes: dict[str, float] = {}
    for (statistic, channel), own in left.items():
        if statistic in _BESIDE:
            sizes[channel] = sizes.get(channel, 0.0) + 2 * _fitted(own, shape)[0]

    def factor(place: Place, default: float) -> float:
        return default + sizes.get(place[1], 0.0) * shape(place)

    return factor


def _unrounded(clues: Clues, place: Place) -> float:
    """Return the share of a variance that was there before codes were rounded."""
    total = max(clues.seen.levels[place].variance_dn2, 1e-9)
    return max(1 - _ROUNDING * code_step(clues.camera) ** 2 / total, 0.0)


def _read_share(clues: Clues, place: Place) -> float:
    """Return the share of a variance that is read noise."""
    return max(_unrounded(clues, place) - clues.shot_share(place), 0.0)


def left_by(state: State, without: Array, statistics: frozenset[str]) -> Left:
    """Return place, value and its error of each correlation and channel: what an effect is to make.

    Not where the converter cuts noise off.
    """
    levels, uniform = state.setting.seen.levels, {e.name for e in state.setting.layout.uniform}
    found: Left = {}
    for i, key in enumerate(state.vector.keys):
        place = (key.exposure, key.channel)
        if key.statistic not in statistics or key.scope != "exposure" or place not in levels:
            continue
        known = state.null.known[i] and np.isfinite(without[i]) and place[0] in uniform
        clipped = max(levels[place].clipped_low, levels[place].clipped_high) > CLIPPED_SHARE
        if known and not clipped:
            value = float(state.vector.values[i] - without[i])
            found.setdefault((key.statistic, key.channel), []).append(
                (place, value, float(state.null.sd[i]))
            )
    return found
