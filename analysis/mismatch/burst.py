"""Tails that are bursts: samples far from their mean that lie beside each other in a line."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.contradicted import Denial
from analysis.mismatch.layout import Layout
from analysis.mismatch.projections import FramesOf

Array = NDArray[np.float64]
TAILS = frozenset({"heavy_tailed_read_noise", "impulse"})  # of every sample by itself
_MOST = 0.5  # of an excess kurtosis, that lines of different noise may make
_SURE = 4.0  # standard errors


@dataclass(frozen=True)
class Bursts:
    """How much of tails is noise that differs from line to line.

    Attributes
    ----------
    tails
        Excess kurtosis of samples less their pixels' and frames' means.
    bursts, error
        What of it lines have whose squares are alike, and its standard error.
    """

    tails: float
    bursts: float
    error: float

    def denial(self, kind: str) -> Denial | None:
        """Return how tails of single samples are denied; None: they are not."""
        sure = self.bursts > _SURE * self.error
        if kind not in TAILS or not sure or self.bursts < _MOST * self.tails:
            return None
        why = "samples far out lie beside each other in single lines of single frames"
        return Denial(max(1 - self.bursts / self.tails, 0.0) if self.tails > 0 else 0.0, why)


def bursts_of(layout: Layout, frames_of: FramesOf) -> Bursts:
    """Return the bursts of the darks and flats that have the surest tails.

    Noise whose variance v differs from line to line has the excess kurtosis 3 var(v) / mean(v)^2
    where it is normal in each; var(v) is the mean product of squares of two samples of a line, less
    that of all. Samples far out that lie anywhere have no such product, however far out they are.
    Rows and columns are asked, of each colour by itself; the error is that of squares at random.
    """
    found = [
        _bursts(partial(_plane, frames_of, exposure.name, place, len(layout.sites) > 1))
        for exposure in layout.uniform
        for place in layout.sites.values()
    ]
    sure = [(own.tails / chance, own) for own, chance in found if chance]
    return max(sure, key=lambda one: one[0], default=(0.0, Bursts(0.0, 0.0, np.inf)))[1]


def _plane(frames_of: FramesOf, name: str, place: tuple[int, int], mosaic: bool) -> Iterator[Array]:
    """Yield the samples of one colour of each frame of an exposure."""
    step = 2 if mosaic else 1
    for frame in frames_of(name):
        yield np.asarray(frame[place[0] :: step, place[1] :: step], np.float64)


def _bursts(planes: Callable[[], Iterator[Array]]) -> tuple[Bursts, float]:
    """Return the bursts of planes (row, column), and the error of their tails in normal noise."""
    count, total = 0, np.zeros(1)
    for plane in planes():
        count, total = count + 1, total + plane
    alike, squares, fourths = [0.0, 0.0], 0.0, 0.0
    for plane in planes():
        rest = plane - total / count
        square = (rest - rest.mean()) ** 2
        squares += float(square.mean()) / count
        fourths += float((square**2).mean()) / count
        for axis in (0, 1):
            alike[axis] += float(_products(square, axis).mean()) / count
    if not squares > 0:
        return Bursts(0.0, 0.0, np.inf), 0.0
    spread = fourths / squares**2 - 1  # of a square that is 1 on average
    found = []
    for product, size in zip(alike, total.shape[::-1], strict=True):
        error = spread * (2 / (count * total.size * (size - 1))) ** 0.5
        found.append((product / squares**2 - 1, error))
    most, error = max(found, key=lambda one: one[0] - _SURE * one[1])
    chance = (24 / (count * total.size)) ** 0.5
    return Bursts(spread - 2, 3 * most, 3 * error), chance


def _products(square: Array, axis: int) -> Array:
    """Return the mean product of two squares of each line across an axis."""
    size = square.shape[1 - axis]
    total, own = square.sum(1 - axis), (square**2).sum(1 - axis)
    return np.asarray((total**2 - own) / (size * (size - 1)))
