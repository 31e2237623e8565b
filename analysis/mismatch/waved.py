"""Lines that differ as a wave that stands still makes them."""

from math import hypot, log

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.seams import beyond_smooth
from analysis.mismatch.bank.standing import NAME
from analysis.mismatch.contradicted import Denial
from analysis.mismatch.state import State

Array = NDArray[np.float64]
_AXES = {"row_fpn": 1, "row_prnu": 1, "column_fpn": 0, "column_prnu": 0}
_GAINS = frozenset({"row_prnu", "column_prnu"})
_BESIDE = 1  # bins to each side that a wave between them is seen in
_LEAST_BINS = 16
_LITTLE, _SURE = 0.1, 3.0  # of what lines differ by, that no wave makes; standard errors


def waved(state: State, kind: str) -> Denial | None:
    """Return how lines that differ are denied by a wave that stands still; None: they are not.

    Offsets and gains that are drawn for each line have the same power at all frequencies. A wave
    nearly along an axis, as a display throws it on a sensor, is left in the means of lines too:
    where one is left unexplained, and without the highest bin of these means and those beside it
    little is surely left of what they differ by, lines may be alike but for it.
    """
    if kind not in _AXES or all(m.statistic != NAME for m in state.mismatches):
        return None
    name, whole, rest = "gain" if kind in _GAINS else "offset", 0.0, 0.0
    error = 0.0
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
        expected = left.size + 1 - log(power.size) - np.euler_gamma
        whole += float(power.mean()) - 1
        level = float(left.sum()) / expected
        rest += level - 1
        error = hypot(error, level / left.size**0.5)
    if whole <= 0 or rest - _SURE * error > _LITTLE * whole:
        return None
    return Denial(max(rest / whole, 0.0), "a wave that stands still makes most of it")
