"""Uneven light, halves and decays that another cause of an uneven gain explains as well."""

import numpy as np

from analysis.mismatch.contradicted import Denial
from analysis.mismatch.gainmap import gains_beside
from analysis.mismatch.gainodds import Cause, evidences
from analysis.mismatch.rank import TOLD_APART
from analysis.mismatch.state import State
from dsis.effects import Effect
from dsis.effects.line_settling import LineSettling
from dsis.effects.shading import Shading
from dsis.effects.tap_mismatch import TapMismatch

_HALVES = {"top_bottom": Cause.HALVES_OF_ROWS, "left_right": Cause.HALVES_OF_COLUMNS}
_EDGES = {"top": Cause.TOP, "bottom": Cause.BOTTOM, "left": Cause.LEFT, "right": Cause.RIGHT}


def rivalled(state: State, effect: Effect) -> Denial | None:
    """Return how an uneven gain is denied by another cause; None: it is not.

    Asked is the gain's map less what the camera's other effects make of it, whatever statistic is
    certain by itself, and whatever may be named: where another cause is as likely, at odds below
    20, the effect is not told from it.
    """
    cause = _cause(effect)
    if cause is None:
        return None
    others = [own for own in state.camera.effect if own != effect]
    image = gains_beside(state.clues(), others)
    found = {} if image is None else evidences(image)
    if not found:
        return None
    rival = max((one for one in found if one is not cause), key=lambda one: found[one])
    behind = found[rival] - found[cause]
    if behind <= -TOLD_APART:
        return None
    share = 1 / (1 + np.exp(np.clip(behind, -TOLD_APART, 700.0)))
    return Denial(float(share), f"its map of gains may as well be {rival.value}")


def _cause(effect: Effect) -> Cause | None:
    """Return how an effect makes the gain uneven; None: it does not, or not so smoothly."""
    if isinstance(effect, TapMismatch):
        return _HALVES.get(effect.regions)
    if isinstance(effect, LineSettling):
        return None if effect.offset_dn else _EDGES[effect.edge]
    return Cause.LIGHT if isinstance(effect, Shading) else None
