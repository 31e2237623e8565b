"""A field of gains that new noise leaves in means: light in grains, which neighbours share."""

import numpy as np

from analysis.mismatch.bank.parts import parts
from analysis.mismatch.contradicted import Denial
from analysis.mismatch.leftopen import left_open
from analysis.mismatch.state import State
from dsis.effects import Effect
from dsis.effects.smooth_prnu import SmoothPrnu

_ALONG = {"correlation_0_1": 1, "correlation_1_0": 0}
_MOST = 0.5  # of what neighbours have in common, that new noise may make


def of_new_grains(state: State, effect: Effect) -> Denial | None:
    """Return how a field of gains is denied by noise that neighbours share anew; None: it is not.

    Noise that is new in each frame has, in a mean of frames, the correlations that it has in one.
    Where what is unexplained of them makes half or more of what pixels side by side have in common
    in the map of gains, both in units of the map's noise, there may be no field.
    """
    if not isinstance(effect, SmoothPrnu):
        return None
    left, layout = left_open(state, _ALONG), state.setting.layout
    seen = fake = 0.0
    for (channel, kind), (image, noise) in state.setting.seen.images.items():
        if kind != "gain" or not left:
            continue
        pixels = parts(image, noise).pixels
        weights = {  # of exposures in the map
            e.name: len(e.numbers)
            * max(layout.signal_dn[e.name, channel], 0.0) ** 2
            / layout.variance_dn2[e.name, channel]
            for e in layout.uniform
            if (e.name, channel) in layout.signal_dn
        }
        total = sum(weights.values())
        for name, axis in _ALONG.items():
            if total <= 0:
                continue
            one, other = np.moveaxis(pixels, axis, 0)[:-1], np.moveaxis(pixels, axis, 0)[1:]
            seen += float((one * other).mean())
            rest = {e: left.get(((e, channel), name), (0.0, 0.0))[0] for e in weights}
            fake += sum(weight * rest[e] for e, weight in weights.items()) / total
    if seen <= 0 or fake <= _MOST * seen:
        return None
    why = "noise that neighbours share anew in each frame leaves as much in means of frames"
    return Denial(max(1 - fake / seen, 0.0), why)
