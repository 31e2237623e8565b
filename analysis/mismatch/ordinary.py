"""Whether ordinary pixels differ in how noisy they are, whatever few of them do besides.

Pixels that jump make up all sums over pixels of how noise is spread, and their number by chance
makes those scatter: read noise of all others that spreads as well is lost in them. Ranks know
nothing of sizes. Of three parts of a dark's frames one says which pixels are ordinary, and the
ranks of the noise in the other two are alike only where pixels differ for good.
"""

from collections.abc import Sequence
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
_SPREADS = np.linspace(0.0, 1.0, 41)
_DRAWN = 1 << 16  # pixels
_ALIKE = 0.02  # correlation of ranks, that jumps which a part does not see may leave


@dataclass(frozen=True)
class Ordinary:
    """The correlation of ranks of ordinary pixels' noise in different frames of darks.

    `frames` are how many a part has.
    """

    alike: float = 0.0
    error: float = np.inf
    frames: tuple[int, ...] = ()

    @property
    def differ(self) -> bool:
        """Whether ordinary pixels differ in how noisy they are, for certain."""
        return self.alike > max(_SURE * self.error, _ALIKE)

    @property
    def gain(self) -> float:
        """By how much frames are likelier with pixels that differ, nats: of a normal score."""
        return (self.alike / self.error) ** 2 / 2

    def spread(self) -> tuple[float, float]:
        """Return the standard deviation of the logarithm of the noise, and its standard error.

        That which makes ranks as much alike: of pixels whose noise is log-normal, drawn once, by
        as many frames, of which the same part says which are ordinary.
        """
        rng = np.random.default_rng(0)
        height = rng.standard_normal(_DRAWN)
        chance = [rng.chisquare(count - 1, _DRAWN) for count in self.frames]
        made = [_alike([np.exp(2 * s * height) * own for own in chance]) for s in _SPREADS]
        alike = np.maximum.accumulate(made)  # of none at all chance may have more
        low, own, high = np.interp(
            [self.alike - self.error, self.alike, self.alike + self.error], alike, _SPREADS
        )
        return float(own), float(high - low) / 2


def _alike(noise: Sequence[Array]) -> float:
    """Return the correlation of ranks of two parts, of pixels that a first says are ordinary."""
    calm = noise[0] <= np.quantile(noise[0], _ORDINARY)
    one, other = (scipy.stats.rankdata(own[calm]) for own in noise[1:])
    return float(np.corrcoef(one, other)[0, 1]) if np.ptp(one) > 0 < np.ptp(other) else np.nan


def ordinary_pixels(layout: Layout, frames_of: FramesOf) -> Ordinary:
    """Return how alike the noise of ordinary pixels is in parts of a dark's frames.

    In the mean over darks of six frames and more, each as many pixels.
    """
    found: list[tuple[float, float]] = []
    each: list[tuple[int, ...]] = []
    for exposure in layout.uniform:
        count = len(exposure.numbers)
        if exposure.kind != "dark" or count < _PARTS * _LEAST:
            continue
        frames = np.stack([np.asarray(own, np.float64) for own in frames_of(exposure.name)])
        frames -= frames.mean((1, 2), keepdims=True)
        # Neighbours in time share a jump: every part has frames from everywhere.
        parts = [frames[part::_PARTS] for part in range(_PARTS)]
        alike = _alike([own.var(0).reshape(-1) for own in parts])
        if np.isfinite(alike):
            found.append((alike, frames[0].size * _ORDINARY))
            each.append(tuple(len(own) for own in parts))
    if not found:
        return Ordinary()
    seen, pixels = np.transpose(found)
    return Ordinary(float(seen.mean()), float(1 / np.sqrt(pixels.sum())), min(each))
