"""How deep a comb of codes single electrons make, where that is known."""

from collections.abc import Sequence
from math import inf, pi

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.key import Key
from analysis.mismatch.bank.scalars import OF_CODES
from analysis.mismatch.layout import Layout
from dsis.camera import Camera, Segment

_KNOWN = 1.0  # error of the logarithm of the depth: a factor of e
_FLAT = 7.0  # minus that logarithm, from which no comb is seen
_LOW = 3.0  # standard errors by which read noise may be less


def unknown_combs(camera: Camera, layout: Layout, keys: Sequence[Key]) -> NDArray[np.bool_]:
    """Return which numbers are of codes whose comb a camera does not tell: (number,).

    Electrons of g DN each, in read noise of variance r, make codes g apart more frequent by a share
    2 exp(-2 pi^2 r / g^2). Where flats leave a segment's read noise unknown so is the comb.
    """
    none = np.zeros(len(keys), np.bool_)
    counts = any(effect.kind == "poisson_shot_noise" for effect in camera.effect)
    if not counts and camera.noise.shot != "poisson":
        return none
    segments = camera.noise.segment
    told = [_told(segment) for segment in segments]
    if all(told):
        return none
    ends = [inf if s.upper_dn is None else s.upper_dn for s in segments]
    for i, key in enumerate(keys):
        signal = layout.signal_dn.get(key.place)
        if key.statistic in OF_CODES and signal is not None:
            none[i] = not told[int(np.searchsorted(ends, signal))]
    return none


def _told(segment: Segment) -> bool:
    error = segment.intercept_se
    if error is None or not segment.slope > 0:
        return error is not None
    scale = 2 * pi**2 / segment.slope**2
    least = max(segment.intercept - _LOW * error, 0.0)
    return scale * error <= _KNOWN or scale * least >= _FLAT
