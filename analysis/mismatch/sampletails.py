"""How many samples lie far out, and on which side: of heavy tails, of rare faults, of spikes."""

from collections.abc import Iterator
from dataclasses import dataclass
from math import sqrt

import numpy as np
from numpy.typing import NDArray
from scipy.stats import binomtest, norm, t

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
_SIDES = np.array([4.0, 5.0, 6.5, 9.0])  # such deviations, beyond which both sides are compared
_AS_MANY = 0.5  # of what is above, that is below where noise has tails
_BY_CHANCE = 0.05  # that tails alone are as far from even
_TAILED = frozenset({"heavy_tailed_read_noise", "read_noise_spread", "rts"})  # on both sides
_FRAMES = 16  # of a dark, of which both sides are compared, at most
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
    above, below
        How many of `compared` are so far above and below the median of others: see `_SIDES`.
    """

    seen: int = 0
    samples: int = 0
    variance_dn2: float = 0.0
    above: tuple[int, ...] = (0,) * _SIDES.size
    below: tuple[int, ...] = (0,) * _SIDES.size
    compared: int = 0

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

    def even(self, kind: str, there: frozenset[str]) -> Denial | None:
        """Return how spikes are denied by samples that are as far below; None: they are not.

        Spikes add charge: what they leave below is chance. Where more is, and there nearly as much
        as above, and nowhere so much more is above that tails of both sides would have it by
        chance, noise has tails; so it is unless the model has noise of such tails already, `there`.
        """
        if kind != "impulse" or there & _TAILED:
            return None
        chance = self.compared * norm.sf(_SIDES)
        above, below = np.array(self.above) - chance, np.array(self.below) - chance
        sure = below > _SURE * np.sqrt(np.array(self.below) + 1)
        if not (sure & (below > _AS_MANY * above)).any():
            return None
        odds = [
            binomtest(up, up + down, alternative="greater").pvalue
            for up, down in zip(self.above, self.below, strict=True)
            if up + down
        ]
        if min(odds) < _BY_CHANCE:
            return None
        return Denial(0.0, "as many samples are as far below as above: spikes add charge")


def ring_of(layout: Layout, frames_of: FramesOf) -> Ring:
    """Return the samples of the first darks that are moderately far out.

    Not of colours of which samples are clipped, nor whose noise is narrower than a few codes; of
    large recordings nothing is asked.
    """
    darks = [e for e in layout.uniform if e.kind == "dark" and len(e.numbers) >= _LEAST_FRAMES]
    darks.sort(key=lambda e: e.exposure_time_s)
    seen = samples = compared = 0
    largest = 0.0
    sides = np.zeros((2, _SIDES.size), np.int64)
    for exposure in [] if layout.large else darks[:_DARKS]:
        for rest, about in _rests(layout, frames_of, exposure.name, len(exposure.numbers)):
            low, high = np.percentile(rest, [25, 75])
            spread = sqrt(variance_of_quartiles(float(low), float(high)))
            if spread < _NARROW:
                continue
            far = np.abs(rest) / spread
            seen += int(((far > _NEAR) & (far < _FAR)).sum())
            samples += rest.size
            largest = max(largest, spread**2)
            low, high = np.percentile(about, [25, 75])
            ends = _SIDES * sqrt(variance_of_quartiles(float(low), float(high)))
            compared += about.size
            sides += [[int((own > end).sum()) for end in ends] for own in (about, -about)]
    above, below = (tuple(int(one) for one in own) for own in sides)
    return Ring(seen, samples, largest, above, below, compared)


def _rests(
    layout: Layout, frames_of: FramesOf, name: str, count: int
) -> Iterator[tuple[Array, Array]]:
    """Yield samples of each colour less means of their pixel, and of their lines, DN.

    And some of them less the median of the pixel's other frames: spikes leave nothing there.
    """
    step = 1 if len(layout.sites) == 1 else 2
    frames = np.stack([np.asarray(frame, np.float64) for frame in frames_of(name)])
    for y, x in layout.sites.values():
        plane = frames[:, y::step, x::step]
        if ((plane <= 0) | (plane >= layout.white_dn)).mean() > CLIPPED_SHARE:
            continue
        own = plane - plane.mean(0)
        own -= own.mean(1, keepdims=True)
        yield (own - own.mean(2, keepdims=True)) / sqrt(1 - 1 / count), _about(plane[:_FRAMES])


def _about(plane: Array) -> Array:
    """Return frames less the median of all others, and their own."""
    others = [np.median(np.delete(plane, i, 0), 0) for i in range(len(plane))]
    own = plane - np.stack(others)
    return np.asarray(own - np.median(own, (1, 2), keepdims=True))


def _of_student(tail_df: float) -> float:
    """Return which share of Student's t is that far out, beside its own quartiles."""
    scale = float(t.isf(0.25, tail_df) / norm.isf(0.25))
    return float(2 * (t.sf(_NEAR * scale, tail_df) - t.sf(_FAR * scale, tail_df)))
