"""Uneven light, halves and decays that another cause of an uneven gain explains as well."""

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.contradicted import Denial, rival
from analysis.mismatch.edged import settles
from analysis.mismatch.gainmap import gains_beside
from analysis.mismatch.gainodds import Cause, evidence_beside, evidences, without_field
from analysis.mismatch.rank import TOLD_APART
from analysis.mismatch.state import State
from dsis.effects import Effect
from dsis.effects.line_settling import LineSettling
from dsis.effects.shading import Shading
from dsis.effects.smooth_prnu import SmoothPrnu
from dsis.effects.tap_mismatch import TapMismatch

Array = NDArray[np.float64]
_HALVES = {"top_bottom": Cause.HALVES_OF_ROWS, "left_right": Cause.HALVES_OF_COLUMNS}
_EDGES = {"top": Cause.TOP, "bottom": Cause.BOTTOM, "left": Cause.LEFT, "right": Cause.RIGHT}


def rivalled(state: State, effect: Effect) -> Denial | None:
    """Return how an uneven gain is denied by another cause; None: it is not.

    Asked is the gain's map less what the camera's other effects make of it, whatever statistic is
    certain by itself, and whatever may be named: where another cause is as likely, at odds below
    20, and beside it the effect is no likelier than nothing, it is not told from that. Of a decay
    of the gain with an offset that is sure, nothing is asked: lines do settle at that edge.
    """
    cause = Cause.FIELD if isinstance(effect, SmoothPrnu) else _cause(state, effect)
    if cause is None:
        return None
    others = [own for own in state.camera.effect if own != effect]
    image = gains_beside(state.clues(), others)
    if image is None:
        return None
    if cause is Cause.FIELD:
        return _no_field(image)
    found = evidences(image)
    for other in sorted(found, key=lambda one: -found[one]):
        behind = found[other] - found[cause]
        if other is cause or behind <= -TOLD_APART:
            continue
        if other is not Cause.FIELD:  # which may be beside the effect as it is
            behind = -evidence_beside(image, cause, other)
        if behind > -TOLD_APART:
            return rival(behind, f"its map of gains may as well be {other.value}")
    return None


def _no_field(image: Array) -> Denial | None:
    """Return how gains that neighbours share are denied by halves alone; None: they are not.

    Where these are seen, as likely as a field without them, and one beside them no likelier than
    none, there may be none: a long field has no step where parts of the sensor meet.
    """
    found = without_field(image, _HALVES.values())
    for other in sorted(found, key=lambda one: -found[one].behind):
        odds = found[other]
        if odds.seen > TOLD_APART > odds.beside and odds.behind > -TOLD_APART:
            return rival(odds.behind, f"its map of gains may as well be {other.value}")
    return None


def _cause(state: State, effect: Effect) -> Cause | None:
    """Return how an effect makes the gain uneven; None: it does not, or not so smoothly."""
    if isinstance(effect, TapMismatch):
        return _HALVES.get(effect.regions)
    if isinstance(effect, LineSettling):
        return None if settles(state, effect) else _EDGES[effect.edge]
    return Cause.LIGHT if isinstance(effect, Shading) else None
