"""Frames that come in pairs: what every second frame shares with the one before, and no other."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.contradicted import Denial
from analysis.mismatch.layout import Layout
from analysis.mismatch.projections import FramesOf

Array = NDArray[np.float64]
STEADY = frozenset({"image_lag", "rts"})  # of any frame and the next alike
_MOST = 0.5  # of what successive frames share, by which pairs may differ
_SURE = 4.0  # standard deviations


@dataclass(frozen=True)
class Pairs:
    """Correlations of successive frames.

    Attributes
    ----------
    shared
        Of all pairs, in the mean over frames of even and of odd numbers.
    apart, error
        Half of what the former have more than the latter, and its standard error.
    """

    shared: float
    apart: float
    error: float

    def denial(self, kind: str) -> Denial | None:
        """Return how what lasts from frame to frame is denied; None: it is not."""
        sure = abs(self.apart) > _SURE * self.error
        if kind not in STEADY or not sure or abs(self.apart) < _MOST * self.shared:
            return None
        why = "every second frame shares more with the one before than the others do"
        return Denial(max(1 - abs(self.apart) / max(self.shared, 1e-12), 0.0), why)


def pairs_of(layout: Layout, frames_of: FramesOf) -> Pairs:
    """Return the correlations of frames and the next, of all darks and flats that have both kinds.

    What a pixel keeps is taken off with the mean frame, what a frame has in common with its mean.
    Products of one row scatter as chance makes them, whatever its samples share: their scatter
    from row to row is the error.
    """
    shared = apart = weight = 0.0
    for exposure in layout.uniform:
        found = _pairs(layout, frames_of, exposure.name, exposure.numbers)
        if found is None:
            continue
        own = 1 / max(found.error, 1e-12) ** 2
        shared, apart, weight = (
            shared + own * found.shared,
            apart + own * found.apart,
            weight + own,
        )
    if weight == 0:
        return Pairs(0.0, 0.0, np.inf)
    return Pairs(shared / weight, apart / weight, weight**-0.5)


def _pairs(
    layout: Layout, frames_of: FramesOf, name: str, numbers: tuple[int, ...]
) -> Pairs | None:
    """Return those of one exposure; None: it lacks pairs of one kind, or has no noise."""
    count = len(numbers)
    if {a % 2 for a, b in pairwise(numbers) if b == a + 1} != {0, 1}:
        return None
    mean = np.zeros((layout.rows, layout.columns))
    for frame in frames_of(name):
        mean += np.asarray(frame, np.float64) / count
    products: tuple[list[Array], list[Array]] = ([], [])
    square, before = 0.0, None
    for number, frame in zip(numbers, frames_of(name), strict=True):
        rest = np.asarray(frame, np.float64) - mean
        rest -= rest.mean()
        square += float((rest**2).mean()) / (count - 1)
        if before is not None and before[0] == number - 1:
            products[before[0] % 2].append((rest * before[1]).mean(1))
        before = number, rest
    if not square > 0:
        return None
    even, odd = (np.mean(own, axis=0) / square for own in products)
    error = float(np.std((even - odd) / 2, ddof=1)) / layout.rows**0.5
    bias = 1 / count  # the mean frame has a share of each
    return Pairs(float((even + odd).mean()) / 2 + bias, float((even - odd).mean()) / 2, error)
