"""Pixels that stand out in the dark, and may be some that jump but stay where they are."""

from analysis.mismatch.contradicted import Denial
from analysis.mismatch.jumping import NAME
from analysis.mismatch.standout import heights
from analysis.mismatch.state import State
from dsis.effects import Effect
from dsis.effects.hot_pixels import HotPixels
from dsis.effects.rts import Rts

_CLEAR, _BELOW = 5.0, -4.0  # standard deviations of a map's noise: of all pixels, of few
_MOST = 0.5  # of those that stand out


def jumped(state: State, effect: Effect) -> Denial | None:
    """Return how hot pixels are denied by pixels that jump; None: they are not.

    A pixel that jumps rarely, or back at once, is in one of its two states through all frames of an
    exposure, and seems brighter than others; that it does not grow with exposure time only another
    time tells. Where all exposures take the same, and as many pixels jump as stand out, or more,
    there may be no hot ones. Nor where frames show that pixels jump, which nothing explains, and
    hot ones leave pixels that stand out; nor where most of those that grow with time are as far
    below the others at none: these changed their state from one exposure to the next.
    """
    if not isinstance(effect, HotPixels):
        return None
    if {m.statistic for m in state.mismatches} >= {NAME, "outlying_pixels"}:
        return Denial(0.0, "frames show pixels that jump, and others than hot ones stand out")
    if turned(state):
        return Denial(0.0, "pixels that grow with exposure time stand out below at none: they jump")
    if len({exposure.exposure_time_s for exposure in state.setting.layout.uniform}) > 1:
        return None
    jumping = sum(e.pixel_fraction for e in state.camera.effect if isinstance(e, Rts))
    if jumping < effect.pixel_fraction:
        return None
    why = "pixels that jump may stay in one state, and all exposures take the same time"
    return Denial(0.0, why)


def turned(state: State) -> bool:
    """Return whether most of the pixels that stand out with time do so below without any."""
    images = state.setting.seen.images
    out = below = 0
    for channel in sorted({own for own, name in images if name == "time"}):
        if (channel, "offset") in images:
            grow = heights(*images[channel, "time"]) > _CLEAR
            out += int(grow.sum())
            below += int((grow & (heights(*images[channel, "offset"]) < _BELOW)).sum())
    return below > _MOST * out
