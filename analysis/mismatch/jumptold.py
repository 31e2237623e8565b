"""Pixels whose read noise differs and pixels that jump: which of them whole frames show."""

from collections.abc import Sequence
from dataclasses import replace

from analysis.mismatch.phase import WholeFrames
from analysis.mismatch.rank import LEAST_GAIN, SURE_GAIN, TOLD_APART, Ranked

_OTHER = {"read_noise_spread": "rts", "rts": "read_noise_spread"}


def as_pixels_show(frames: WholeFrames | None, fitted: Sequence[Ranked]) -> list[Ranked]:
    """Return ranked effects, the best first, where the frames of single pixels had their say.

    They are asked where the best is one of both, and numbers, which are sums over pixels, do not
    tell it from the other.
    """
    first = fitted[0] if fitted else None
    if frames is None or first is None or first.kind not in _OTHER:
        return list(fitted)
    near = [
        one
        for one in fitted
        if one.kind == _OTHER[first.kind] and one.gain > first.gain - TOLD_APART
    ]
    odds = frames.spread_rather(SURE_GAIN) if near else 0.0
    if odds == 0:
        return list(fitted)
    preferred = "read_noise_spread" if odds > 0 else "rts"
    top = next(one for one in (first, *near) if one.kind == preferred)
    limit = max(first.gain - abs(odds), LEAST_GAIN)
    placed = [
        replace(one, gain=min(one.gain, limit)) if one.kind == _OTHER[preferred] else one
        for one in fitted
        if one is not top
    ]
    return sorted([replace(top, gain=first.gain), *placed], key=lambda one: -one.gain)
