"""Second read-out paths that variances only seem to need."""

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.contradicted import Denial
from analysis.mismatch.resolved import FAR_OFF
from analysis.mismatch.state import State

Array = NDArray[np.float64]
_TAILS = frozenset({"kurtosis", "kurtosis_within_pixels", "one_off_outliers"})
_MOST = 0.5  # of what variances are off without the path, that may be left with it


def no_path(state: State, without: Array) -> Denial | None:
    """Return how a second read-out path is denied by what it leaves open; None: it is not.

    A path scales the noise of every sample above a level. Where frames of one exposure are not
    equally noisy, or samples lie far out, and that is left unexplained, variances are those of few
    frames or samples. Nor is there one where variances are left off by half of what they are off
    without it, and far.

    Parameters
    ----------
    state
        With the path.
    without
        The numbers predicted without it.
    """
    left = {m.statistic: m.z for m in state.mismatches}
    if left.get("frame_noise", 0.0) > FAR_OFF:
        return Denial(0.0, "frames of one exposure are not equally noisy, whatever the level")
    if max((left.get(name, 0.0) for name in _TAILS), default=0.0) > FAR_OFF:
        return Denial(0.0, "samples far out are left unexplained, and make variances larger")
    own = np.array([key.statistic == "pixel_variance" for key in state.vector.keys])
    own &= state.null.known & np.isfinite(without)
    before, after = (
        float(np.abs((state.vector.values - mean)[own] / state.null.sd[own]).max(initial=0.0))
        for mean in (without, state.null.mean)
    )
    if after <= FAR_OFF or after < _MOST * before:
        return None
    return Denial(1 - after / max(before, after), "it leaves most of what variances are off by")
