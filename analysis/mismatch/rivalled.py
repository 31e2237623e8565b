"""Uneven light, halves and decays that another cause of an uneven gain explains as well."""

from math import exp

import numpy as np

from analysis.mismatch.bank.edges import line_square
from analysis.mismatch.bank.seams import beyond_smooth
from analysis.mismatch.contradicted import Denial
from analysis.mismatch.gainmap import gains_beside
from analysis.mismatch.gainodds import Cause, evidence_beside, evidences
from analysis.mismatch.rank import TOLD_APART
from analysis.mismatch.state import State
from dsis.effects import Effect
from dsis.effects.line_settling import LineSettling
from dsis.effects.shading import Shading
from dsis.effects.tap_mismatch import TapMismatch

_HALVES = {"top_bottom": Cause.HALVES_OF_ROWS, "left_right": Cause.HALVES_OF_COLUMNS}
_LARGEST = 700.0  # of an exponent
_EDGES = {"top": Cause.TOP, "bottom": Cause.BOTTOM, "left": Cause.LEFT, "right": Cause.RIGHT}


def rivalled(state: State, effect: Effect) -> Denial | None:
    """Return how an uneven gain is denied by another cause; None: it is not.

    Asked is the gain's map less what the camera's other effects make of it, whatever statistic is
    certain by itself, and whatever may be named: where another cause is as likely, at odds below
    20, and beside it the effect is no likelier than nothing, it is not told from that. Of a decay
    of the gain with an offset that is sure, nothing is asked: lines do settle at that edge.
    """
    cause = _cause(state, effect)
    if cause is None:
        return None
    others = [own for own in state.camera.effect if own != effect]
    image = gains_beside(state.clues(), others)
    if image is None:
        return None
    found = evidences(image)
    for rival in sorted(found, key=lambda one: -found[one]):
        behind = found[rival] - found[cause]
        if rival is cause or behind <= -TOLD_APART:
            continue
        if rival is not Cause.FIELD:  # which may be beside the effect as it is
            behind = -evidence_beside(image, cause, rival)
        if behind > -TOLD_APART:
            share = 1 / (1 + exp(min(behind, _LARGEST)))
            return Denial(share, f"its map of gains may as well be {rival.value}")
    return None


def _cause(state: State, effect: Effect) -> Cause | None:
    """Return how an effect makes the gain uneven; None: it does not, or not so smoothly."""
    if isinstance(effect, TapMismatch):
        return _HALVES.get(effect.regions)
    if isinstance(effect, LineSettling):
        return None if _settles(state, effect) else _EDGES[effect.edge]
    return Cause.LIGHT if isinstance(effect, Shading) else None


def _settles(state: State, effect: LineSettling) -> bool:
    """Return whether a decay has no gain, or an offset that is surely one: at odds of 20.

    Of its size and length, less half of the logarithm of the lines' number for each (Schwarz 1978).
    """
    if not (effect.gain_percent and effect.offset_dn):
        return not effect.gain_percent
    layout, images = state.setting.layout, state.setting.seen.images
    axis = int(effect.edge in ("left", "right"))
    square = 0.0
    for (channel, name), (image, noise) in images.items():
        if name == "offset":
            step = 1 if channel == "MONO" else 2
            line = step * np.arange(image.shape[axis])
            shape = np.exp(-line / effect.length_pixels)
            means = image.mean(1 - axis)
            error = line_square(beyond_smooth(means), noise, image.shape[1 - axis])
            square += effect.offset_dn**2 * float(((shape - shape.mean()) ** 2).sum()) / error
    lines = (layout.rows, layout.columns)[axis]
    return bool(square / 2 - np.log(lines) > TOLD_APART)
