"""How many samples lie moderately far out: heavy tails have many such, rare faults have none."""

from collections.abc import Iterator
from dataclasses import dataclass
from math import sqrt

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm, t

from analysis.mismatch.basefit import CLIPPED_SHARE
from analysis.mismatch.contradicted import Denial
from analysis.mismatch.layout import Layout
from analysis.mismatch.projections import FramesOf
from dsis.effects import Effect
from dsis.effects.heavy_tailed_read_noise import HeavyTailedReadNoise
from dsis.measures.spikes import variance_of_quartiles

Array = NDArray[np.float64]
_NEAR, _FAR = 3.5, 7.0  # standard deviations by quartiles, between which samples are counted
_NARROW = 1.5  # codes: quartiles of less say little of a spread
_LEAST_FRAMES = 4  # means of fewer are moved by what is far out
_LEAST, _LITTLE = 30.0, 0.2  # samples that tails must foretell, and the share that may be seen
_SURE = 3.0  # standard errors
_ALONE = 0.8  # of the darks' noise, that read noise must make
_DARKS = 4  # that are asked, at most: those of the shortest time


@dataclass(frozen=True)
class Ring:
    """Samples of darks that are moderately far from the mean of their pixel.

    Attributes
    ----------
    seen, samples
        How many, of how many.
    variance_dn2
        Of these, by quartiles: the largest of the exposures and colours.
    """

    seen: int = 0
    samples: int = 0
    variance_dn2: float = 0.0

    def denial(self, effect: Effect, read_dn2: float) -> Denial | None:
        """Return how heavy tails are denied by samples that they foretell; None: they are not.

        `read_dn2` is the variance of the read noise that has them: of darks that have other noise
        besides, which hides what is moderately far, nothing is said.

        Of Student's t of few degrees of freedom each sample far out comes with a hundred that are
        moderately far. Where next to none of these are there, what is far out is a rare fault, of
        whatever size, and the noise has no tails.
        """
        alone = read_dn2 >= _ALONE * self.variance_dn2
        if not isinstance(effect, HeavyTailedReadNoise) or not alone:
            return None
        by_chance = self.samples * 2 * float(norm.sf(_NEAR) - norm.sf(_FAR))
        beyond = self.samples * _of_student(effect.tail_df) - by_chance
        most = self.seen - by_chance + _SURE * sqrt(self.seen + 1)
        if beyond < _LEAST or most > _LITTLE * beyond:
            return None
        why = "samples far out are rare faults: hardly any are moderately far"
        return Denial(max(most, 0.0) / beyond, why)


def ring_of(layout: Layout, frames_of: FramesOf) -> Ring:
    """Return the samples of the first darks that are moderately far out.

    Not of colours of which samples are clipped, nor whose noise is narrower than a few codes; of
    large recordings nothing is asked.
    """
    darks = [e for e in layout.uniform if e.kind == "dark" and len(e.numbers) >= _LEAST_FRAMES]
    darks.sort(key=lambda e: e.exposure_time_s)
    seen = samples = 0
    largest = 0.0
    for exposure in [] if layout.large else darks[:_DARKS]:
        for rest in _rests(layout, frames_of, exposure.name, len(exposure.numbers)):
            low, high = np.percentile(rest, [25, 75])
            spread = sqrt(variance_of_quartiles(float(low), float(high)))
            if spread < _NARROW:
                continue
            far = np.abs(rest) / spread
            seen += int(((far > _NEAR) & (far < _FAR)).sum())
            samples += rest.size
            largest = max(largest, spread**2)
    return Ring(seen, samples, largest)


def _rests(layout: Layout, frames_of: FramesOf, name: str, count: int) -> Iterator[Array]:
    """Yield samples of each colour less means of their pixel, and of their lines, DN."""
    step = 1 if len(layout.sites) == 1 else 2
    frames = np.stack([np.asarray(frame, np.float64) for frame in frames_of(name)])
    for y, x in layout.sites.values():
        plane = frames[:, y::step, x::step]
        if ((plane <= 0) | (plane >= layout.white_dn)).mean() > CLIPPED_SHARE:
            continue
        own = plane - plane.mean(0)
        own -= own.mean(1, keepdims=True)
        yield (own - own.mean(2, keepdims=True)) / sqrt(1 - 1 / count)


def _of_student(tail_df: float) -> float:
    """Return which share of Student's t is that far out, beside its own quartiles."""
    scale = float(t.isf(0.25, tail_df) / norm.isf(0.25))
    return float(2 * (t.sf(_NEAR * scale, tail_df) - t.sf(_FAR * scale, tail_df)))
