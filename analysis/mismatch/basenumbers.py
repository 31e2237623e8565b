"""Whether the numbers of a camera's base model hold beside an effect."""

from collections.abc import Sequence
from dataclasses import replace
from math import isfinite, nan

from scipy.stats import chi2

from analysis.mismatch.credited import joined
from analysis.mismatch.rank import Ranked
from analysis.mismatch.recalibrate import Calibrated
from analysis.mismatch.state import State
from dsis.camera import BaseNoise
from dsis.effects.readout_memory import ReadoutMemory

_HOLD, _WRONG = 0.01, 1e-4  # chance of numbers that are farther off
_SMALL = 0.5  # share of noise beyond which there is no such share of the signal


def preferred(state: State, users: BaseNoise, one: Ranked, other: Ranked) -> Ranked | None:
    """Return the one of two effects that tie which the user's numbers speak for; None: neither.

    Two effects may explain the same but for what one does to the variance of all pixels, which a
    model of another slope does as well. Where a camera model says that slope, wrongly as it seems
    without either, and rightly beside one of them alone, the other needs a wrong number besides,
    wrong by as much as the first one says. That numbers hold without either says nothing: they may
    have been measured in such frames.
    """
    if not _chance(users, state.calibrated) < _WRONG:
        return None
    chances = [(_beside(state, users, ranked), ranked) for ranked in (one, other)]
    for (chance, ranked), (against, _) in (chances, chances[::-1]):
        if chance > _HOLD and against < _WRONG:
            return ranked
    return None


def of_what(state: State, users: BaseNoise, fitted: Sequence[Ranked]) -> list[Ranked]:
    """Return ranked effects; a memory is of the signal where the user's numbers say so.

    What is remembered of the noise alone adds to variances; a share of the signal that takes the
    place of as much of it lessens them, and correlates the same. Of samples of one colour nothing
    else tells the two apart: where numbers are wrong beside the first and hold beside the second,
    it is that. Of the nearest sample of a colour a filter says so, see `preferred`.
    """
    return [_of_signal(state, users, one) for one in fitted]


def _of_signal(state: State, users: BaseNoise, ranked: Ranked) -> Ranked:
    (effect, *others), layout = ranked.polished.effects, state.setting.layout
    if not isinstance(effect, ReadoutMemory) or effect.remembers != "noise":
        return ranked
    apart = 1 if layout.channels == ("MONO",) else 2
    mixed, filtered = effect.lag_pixels % apart, effect.lag_pixels == apart and effect.fraction > 0
    if mixed or filtered or abs(effect.fraction) >= _SMALL:
        return ranked
    if not _chance(users, state.calibrated) < _WRONG:
        return ranked
    share = effect.fraction / (1 + effect.fraction)  # of (1 - s, s), in proportion 1 to f
    signal = effect.model_copy(update={"fraction": share, "remembers": "signal"})
    polished = replace(ranked.polished, effects=(signal, *others))
    other = replace(ranked, polished=polished)
    wrong = _beside(state, users, ranked) < _WRONG
    return other if wrong and _beside(state, users, other) > _HOLD else ranked


def _beside(state: State, users: BaseNoise, ranked: Ranked) -> float:
    """Return the chance of the user's numbers beside an effect as it was fitted."""
    camera = joined(state.camera, ranked.polished.effects, state.setting.given)
    if camera is None:
        return nan
    return _chance(users, state.setting.calibrated(camera, state.calibrated))


def _chance(users: BaseNoise, calibrated: Calibrated) -> float:
    """Return the chance that slopes fitted again are farther from the user's."""
    pieces = calibrated.fit.pieces
    if len(pieces) != len(users.segment):
        return nan
    squares = [
        (piece.slope - own.slope) ** 2 / (piece.slope_error**2 + (own.slope_se or 0.0) ** 2)
        for piece, own in zip(pieces, users.segment, strict=True)
        if isfinite(piece.slope_error)
    ]
    return float(chi2.sf(sum(squares), len(squares))) if squares else nan
