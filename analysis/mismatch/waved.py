"""Lines that differ as a wave that stands still makes them."""

from math import exp, log

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.seams import beyond_smooth
from analysis.mismatch.bank.standing import NAME
from analysis.mismatch.contradicted import Denial
from analysis.mismatch.state import State

Array = NDArray[np.float64]
_AXES = {"row_fpn": 1, "row_prnu": 1, "column_fpn": 0, "column_prnu": 0}
_GAINS = frozenset({"row_prnu", "column_prnu"})
_BESIDE = 2  # bins to each side that a wave between them is seen in
_LEAST_BINS = 16
_SURE = 3.0  # standard errors of what no wave makes
_CHANCE = 0.01  # that a bin of equal ones stands out so far


def waved(state: State, kind: str) -> Denial | None:
    """Return how lines that differ are denied by a wave that stands still; None: they are not.

    Offsets and gains that are drawn for each line have the same power at all frequencies. A wave
    nearly along an axis, as a display throws it on a sensor, is left in the means of lines too:
    where one is left unexplained, a bin of these means stands out for sure, and without it and
    those beside it nothing is surely left of what they differ by, lines may be alike but for it.
    """
    if kind not in _AXES or all(m.statistic != NAME for m in state.mismatches):
        return None
    name = "gain" if kind in _GAINS else "offset"
    levels, errors, clear = [], [], False
    images = state.setting.seen.images
    for channel in sorted({channel for channel, _ in images}):
        own = images.get((channel, f"{name} alone"), images.get((channel, name)))
        if own is None:
            continue
        image, noise = own
        across = image.shape[_AXES[kind]]
        means = beyond_smooth(image.mean(_AXES[kind])) * across**0.5 / noise
        power = np.abs(np.fft.rfft(means)[1:]) ** 2 / means.size
        if power.size < _LEAST_BINS:
            return None
        top = int(power.argmax())
        left = np.delete(power, slice(max(top - _BESIDE, 0), top + _BESIDE + 1))
        # What is left of n exponential variates without the highest and some others.
        level = float(left.sum()) / (left.size + 1 - log(power.size) - np.euler_gamma)
        clear |= power.size * exp(-float(power[top]) / max(level, 1.0)) < _CHANCE
        levels.append(level - 1)
        errors.append(left.size**-0.5)
    if not clear or sum(levels) > _SURE * float(np.linalg.norm(errors)):
        return None
    return Denial(0.0, "a wave that stands still makes most of it")
