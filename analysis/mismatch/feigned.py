"""Fixed patterns that correlated frames feign: a mean of frames that are alike varies more."""

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.contradicted import Denial
from analysis.mismatch.state import State

Array = NDArray[np.float64]
PATTERNS = frozenset({"dsnu", "prnu"})
_MOST = 0.5  # of a pattern's variance, that correlation may feign


def feigned(state: State, kind: str, without: Array) -> Denial | None:
    """Return how a pattern of single pixels is denied by what successive frames share; None: not.

    n frames of variance v, of correlation rho between neighbours (a mean over all, gaps included),
    have a mean frame of variance v / n (1 + 2 rho (n - 1) / n). Where that correlation is left
    unexplained, and feigns half of what the pattern would explain, there may be no pattern.

    Parameters
    ----------
    state
        With the effect.
    kind
        The effect.
    without
        The numbers predicted without it.
    """
    if kind not in PATTERNS or all(m.statistic != "frame_correlation" for m in state.mismatches):
        return None
    numbers = {e.name: e.numbers for e in state.setting.layout.exposures}
    left = {
        (key.exposure, key.channel): state.vector.values[i] - state.null.mean[i]
        for i, key in enumerate(state.vector.keys)
        if key.statistic == "frame_correlation" and state.null.known[i] and key.exposure in numbers
    }
    seen, fake = 0.0, 0.0
    for i, key in enumerate(state.vector.keys):
        place = (key.exposure, key.channel)
        if key.statistic != "fixed_pixel_variance" or place not in left:
            continue
        change = state.null.mean[i] - without[i]
        if not (state.null.known[i] and change > state.null.sd[i]):
            continue  # the pattern explains nothing here, or nothing is known
        frames = len(numbers[key.exposure])
        weight = 1 / state.null.sd[i] ** 2
        # Numbers are cube roots of variances relative to the noise of the mean frame.
        seen += weight * (state.vector.values[i] ** 3 - without[i] ** 3)
        fake += weight * 2 * left[place] * (frames - 1) / frames
    if fake <= _MOST * seen:
        return None
    share = 1 - fake / seen if seen > 0 else 0.0
    return Denial(
        share, "successive frames are alike for another reason, and feign a fixed pattern"
    )
