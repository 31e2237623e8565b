"""Whether the numbers of a camera's base model hold beside an effect."""

from math import inf, isfinite, nan, sqrt

from scipy.stats import chi2

from analysis.mismatch.credited import joined
from analysis.mismatch.rank import Ranked
from analysis.mismatch.recalibrate import Calibrated
from analysis.mismatch.state import State
from dsis.camera import BaseNoise

HOLD, WRONG = 0.01, 1e-4  # chance of numbers that are farther off


def preferred(state: State, users: BaseNoise, one: Ranked, other: Ranked) -> Ranked | None:
    """Return the one of two effects that tie which the user's numbers speak for; None: neither.

    Two effects may explain the same but for what one does to the variance of all pixels, which a
    model of another slope does as well. Where a camera model says that slope, wrongly as it seems
    without either, and rightly beside one of them alone, the other needs a wrong number besides,
    wrong by as much as the first one says. That numbers hold without either says nothing: they may
    have been measured in such frames.
    """
    if not chance(users, state.calibrated) < WRONG:
        return None
    chances = [(beside(state, users, ranked), ranked) for ranked in (one, other)]
    for (own, ranked), (against, _) in (chances, chances[::-1]):
        if own > HOLD and against < WRONG:
            return ranked
    return None


def beside(state: State, users: BaseNoise, ranked: Ranked) -> float:
    """Return the chance of the user's numbers beside an effect as it was fitted."""
    camera = joined(state.camera, ranked.polished.effects, state.setting.given)
    if camera is None:
        return nan
    return chance(users, state.setting.calibrated(camera, state.calibrated))


def chance(users: BaseNoise, calibrated: Calibrated) -> float:
    """Return the chance that slopes fitted again are farther from the user's."""
    squares = _squares(users, calibrated)
    return float(chi2.sf(sum(squares), len(squares))) if squares else nan


def far_off(users: BaseNoise, calibrated: Calibrated) -> float:
    """Return how many standard errors slopes fitted again are from the user's; inf: none is."""
    return sqrt(sum(_squares(users, calibrated)) or inf)


def _squares(users: BaseNoise, calibrated: Calibrated) -> list[float]:
    """Return the squares of differences of slopes over their errors; none: segments are others."""
    pieces = calibrated.fit.pieces
    if len(pieces) != len(users.segment):
        return []
    return [
        (piece.slope - own.slope) ** 2 / (piece.slope_error**2 + (own.slope_se or 0.0) ** 2)
        for piece, own in zip(pieces, users.segment, strict=True)
        if isfinite(piece.slope_error)
    ]
