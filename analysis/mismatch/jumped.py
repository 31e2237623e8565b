"""Pixels that stand out in the dark, and may be some that jump but stay where they are."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm, poisson

from analysis.mismatch.bank.parts import parts
from analysis.mismatch.contradicted import Denial
from analysis.mismatch.hotlaw import around
from analysis.mismatch.jumping import NAME
from analysis.mismatch.standout import first_maps, heights
from analysis.mismatch.state import State
from dsis.effects import Effect
from dsis.effects.hot_pixels import HotPixels
from dsis.effects.rts import Rts

Array = NDArray[np.float64]
_CLEAR, _LESS, _BELOW = 5.0, 3.5, -4.0  # of a map's noise: far out, less far; below, of few
_MOST, _FEWEST = 0.5, 3  # of those that stand out
_CHANCE = 1e-3  # that noise alone has as many below
_SHORT, _SHARE = 0.2, 0.3  # of the longest time; of what a pixel grows by in that


def jumped(state: State, effect: Effect) -> Denial | None:
    """Return how hot pixels are denied by pixels that jump; None: they are not.

    A pixel that jumps rarely, or back at once, is in one of its two states through all frames of an
    exposure, and seems brighter than others; that it does not grow with exposure time only another
    time tells. Where all exposures take the same, and as many pixels jump as stand out, or more,
    there may be no hot ones. Nor where frames show that pixels jump, which nothing explains, and
    hot ones leave pixels that stand out; nor where most of those that grow with time are as far
    below the others at none: these changed their state from one exposure to the next; nor where
    half as many stand out below as above: no current is negative. Of pixels that are said to jump
    some stand out on both sides; beside them hot ones are told by time alone.
    """
    why = _why(state, effect) if isinstance(effect, HotPixels) else ""
    return Denial(0.0, why) if why else None


def _why(state: State, effect: HotPixels) -> str:
    """Return why there may be no hot pixels; empty: there may be."""
    if {m.statistic for m in state.mismatches} >= {NAME, "outlying_pixels"}:
        return "frames show pixels that jump, and others than hot ones stand out"
    if turned(state):
        return "pixels that grow with exposure time stand out below at none: they jump"
    times = {exposure.exposure_time_s for exposure in state.setting.layout.uniform}
    said = any(isinstance(one, Rts) for one in state.camera.effect)
    if not (said and len(times) > 1) and _both_ways(state):
        return "pixels stand out below the others as well as above"
    jumping = sum(e.pixel_fraction for e in state.camera.effect if isinstance(e, Rts))
    if len(times) > 1 or jumping < effect.pixel_fraction:
        return ""
    return "pixels that jump may stay in one state, and all exposures take the same time"


def _both_ways(state: State) -> bool:
    """Return whether pixels stand out on both sides of a map that hot ones would stand out of.

    Beyond lines and smooth surfaces, and beyond their neighbours too: a pixel of 1000 standard
    deviations makes the means of its lines higher, and the others seem lower.
    """
    maps = first_maps(state, ("time", "offset")).values()
    # Offsets may have tails; in what grows with time all that is below is noise, or jumped.
    most = _CHANCE if any(name == "time" for _, name in state.setting.seen.images) else 1.0
    return _in_both([heights(parts(*own).pixels, 1.0) for own in maps], most) and _in_both(
        [heights(_single(image), noise) for image, noise in maps], most
    )


def _in_both(maps: Sequence[Array], chance: float) -> bool:
    """Return whether heights are far below in half as many places as above, or in more.

    Where few are so far out that tells less than more that are less far, beyond what noise has;
    `chance` is the largest of that noise alone has so many below.
    """
    for clear in (_CLEAR, _LESS):
        noise = float(norm.sf(clear)) * sum(height.size for height in maps)
        above, below = (
            sum(int((sign * height > clear).sum()) for height in maps) for sign in (1, -1)
        )
        enough = below - noise >= max(_MOST * (above - noise), _FEWEST)
        if enough and poisson.sf(below - 1, noise) <= chance:
            return True
    return False


def _single(image: Array) -> Array:
    """Return what pixels of a map have beyond their neighbours, and what lines have in common."""
    own = image - around(image)
    own -= np.median(own, 1, keepdims=True)
    return np.asarray(own - np.median(own, 0))


def turned(state: State) -> bool:
    """Return whether most of the pixels that stand out with time do so below without any.

    By a share of what they grow by that no noise of their current has; a sample far out in a long
    exposure has less of it where the shortest one is far shorter, else nothing is said.
    """
    times = [exposure.exposure_time_s for exposure in state.setting.layout.uniform]
    images = state.setting.seen.images
    out = below = 0
    for channel in sorted({own for own, name in images if name == "time"}):
        if (channel, "offset") in images and min(times) <= _SHORT * max(times):
            grows, offset = images[channel, "time"], images[channel, "offset"]
            grow, first = (own[0] - np.median(own[0]) for own in (grows, offset))
            far = heights(*grows) > _CLEAR
            out += int(far.sum())
            under = (heights(*offset) < _BELOW) & (first < -_SHARE * grow)
            below += int((far & under).sum())
    return below > _MOST * out
