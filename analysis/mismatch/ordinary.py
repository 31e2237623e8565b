"""Whether ordinary pixels differ in how noisy they are, whatever few of them do besides.

Pixels that jump make up all sums over pixels of how noise is spread, and their number by chance
makes those scatter: read noise of all others that spreads as well is lost in them. Ranks know
nothing of sizes. Of three parts of a dark's frames one says which pixels are ordinary, and the
ranks of the noise in the other two are alike only where pixels differ for good.
"""

from dataclasses import dataclass

import numpy as np
import scipy.stats
from numpy.typing import NDArray

from analysis.mismatch.layout import Layout
from analysis.mismatch.projections import FramesOf

Array = NDArray[np.float64]
_PARTS, _LEAST = 3, 2  # of a dark's frames; frames of each
_ORDINARY = 0.9  # of the pixels: the least noisy ones of a part
_SURE = 6.0  # standard errors
_ALIKE = 0.02  # correlation of ranks, that jumps which a part does not see may leave


@dataclass(frozen=True)
class Ordinary:
    """The correlation of ranks of ordinary pixels' noise in different frames of darks."""

    alike: float = 0.0
    error: float = np.inf

    @property
    def differ(self) -> bool:
        """Whether ordinary pixels differ in how noisy they are, for certain."""
        return self.alike > max(_SURE * self.error, _ALIKE)


def ordinary_pixels(layout: Layout, frames_of: FramesOf) -> Ordinary:
    """Return how alike the noise of ordinary pixels is in parts of a dark's frames.

    In the mean over darks of six frames and more, each as many pixels.
    """
    found = []
    for exposure in layout.uniform:
        count = len(exposure.numbers)
        if exposure.kind != "dark" or count < _PARTS * _LEAST:
            continue
        frames = np.stack([np.asarray(own, np.float64) for own in frames_of(exposure.name)])
        frames -= frames.mean((1, 2), keepdims=True)
        # Neighbours in time share a jump: every part has frames from everywhere.
        noise = [frames[part::_PARTS].var(0).reshape(-1) for part in range(_PARTS)]
        calm = noise[0] <= np.quantile(noise[0], _ORDINARY)
        one, other = (scipy.stats.rankdata(own[calm]) for own in noise[1:])
        if np.ptp(one) > 0 and np.ptp(other) > 0:
            found.append((float(np.corrcoef(one, other)[0, 1]), int(calm.sum())))
    if not found:
        return Ordinary()
    alike, pixels = np.transpose(found)
    return Ordinary(float(alike.mean()), float(1 / np.sqrt(pixels.sum())))
