"""Light that changes slowly: it is no flicker, which is new in each frame."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from analysis.mismatch.contradicted import Denial, rival
from analysis.mismatch.framewalk import means_of, walk_of
from analysis.mismatch.rank import SURE_GAIN, TOLD_APART
from analysis.mismatch.state import State
from dsis.effects import Effect
from dsis.effects.black_level_drift import BlackLevelDrift
from dsis.effects.flicker import Flicker


def fading(state: State, effect: Effect) -> Denial | None:
    """Return how flicker is denied by light that stays near what it was; None: it is not.

    A lamp that warms up, or a gain that falls as a sensor does, moves the means of frames by shares
    of the light, and each follows the one before. Where all lit frames, each mean as a share of its
    exposure's, are for certain likelier with gains that persist than with new ones, these are none
    of a flicker. Nothing is said where something else may persist: an offset that wanders, in the
    model or in darks, or charge that stays.
    """
    if not isinstance(effect, Flicker):
        return None
    others = [own for own in state.camera.effect if not isinstance(own, Flicker)]
    if _persistent(state, others):
        return None
    layout, signal = state.setting.layout, state.calibrated.fit.signal_dn

    def light(name: str) -> float:
        return float(np.mean([signal.get((name, c), 0.0) for c in layout.channels]))

    lit = [own for own in layout.uniform if own.kind != "dark" and light(own.name) > 0]
    means = means_of(state.setting.seen.lines, lit, others, light)
    shares = [
        replace(own, means=own.means / light(name), new_dn2=own.new_dn2 / light(name) ** 2)
        for name, own in means.items()
    ]
    walk = walk_of(shares) if shares else None
    if walk is None or walk.gain < SURE_GAIN:
        return None
    return rival(walk.gain, "the light of a frame is near that of the frame before")


def _persistent(state: State, effects: Sequence[Effect]) -> bool:
    """Return whether means of frames may persist whatever the light does."""
    if any(isinstance(own, BlackLevelDrift) or own.looks_back for own in effects):
        return True
    if any(m.statistic == "frame_correlation" for m in state.mismatches):
        return True
    darks = [own for own in state.setting.layout.uniform if own.kind == "dark"]
    means = means_of(state.setting.seen.lines, darks, effects, lambda _: 0.0)
    walk = walk_of(list(means.values())) if means else None
    return walk is not None and walk.gain > TOLD_APART
