"""Tails that are bursts: samples far from their mean that lie beside each other in a line."""

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.basefit import CLIPPED_SHARE
from analysis.mismatch.contradicted import Denial
from analysis.mismatch.layout import Layout
from analysis.mismatch.projections import FramesOf

Array = NDArray[np.float64]
TAILS = frozenset({"heavy_tailed_read_noise", "impulse"})  # of every sample by itself
_MOST = 0.5  # of an excess kurtosis, that lines of different noise may make
_SURE = 4.0  # standard errors
_LEAST_FRAMES = 3


@dataclass(frozen=True)
class Bursts:
    """How much of tails is noise that differs from line to line.

    Attributes
    ----------
    tails
        Excess kurtosis of samples less the means of their pixels and lines.
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
    """Return the bursts of the dark or flat that has the surest tails.

    Noise whose variance v differs from line to line of each frame has the excess kurtosis
    3 var(v) / mean(v)^2 where it is normal in each; var(v) is the mean product of squares of two
    samples of a line in one frame, less that of its mean square over all frames: lines that are
    always noisier are no bursts. Nor are lines whose means move: these are taken off. Samples far
    out that lie anywhere have no such product, however far out they are. Rows and columns are
    asked, of each colour by itself; the error is that of squares at random. None in a large
    recording: nothing is asked.
    """
    found = [] if layout.large else [
        own
        for exposure in layout.uniform
        for own in _of_exposure(layout, frames_of, exposure.name, len(exposure.numbers))
    ]  # fmt: skip
    return max(found, key=lambda one: one[0], default=(0.0, Bursts(0.0, 0.0, np.inf)))[1]


def _of_exposure(
    layout: Layout, frames_of: FramesOf, name: str, count: int
) -> Iterator[tuple[float, Bursts]]:
    """Yield how sure the tails of each colour of an exposure are, and its bursts.

    Nothing of colours of which samples are clipped, and of a single frame.
    """
    if count < _LEAST_FRAMES:
        return
    step, sums = 1 if len(layout.sites) == 1 else 2, {at: _Sums() for at in layout.sites.values()}
    total = np.zeros((layout.rows, layout.columns))
    for frame in frames_of(name):
        total += np.asarray(frame, np.float64) / count
    for frame in frames_of(name):
        for (y, x), own in sums.items():
            plane = np.asarray(frame[y::step, x::step], np.float64)
            own.clipped += float(((plane <= 0) | (plane >= layout.white_dn)).mean()) / count
            own.add(plane - total[y::step, x::step])
    for own in sums.values():
        if own.clipped <= CLIPPED_SHARE:
            yield from own.found()


@dataclass
class _Sums:
    """Sums over the frames of a plane: of each axis, squares and products of each line."""

    clipped: float = 0.0
    frames: int = 0
    squares: dict[int, Array] = field(default_factory=dict)
    products: dict[int, Array] = field(default_factory=dict)
    fourths: dict[int, float] = field(default_factory=dict)
    samples: int = 0

    def add(self, rest: Array) -> None:
        """Take a plane (row, column) less its mean over all frames."""
        self.frames += 1
        self.samples += rest.size
        for axis in (0, 1):
            square = (rest - rest.mean(1 - axis, keepdims=True)) ** 2
            size = square.shape[1 - axis]
            fourth = (square**2).sum(1 - axis)
            product = (square.sum(1 - axis) ** 2 - fourth) / (size * (size - 1))
            self.squares[axis] = self.squares.get(axis, 0.0) + square.mean(1 - axis)
            self.products[axis] = self.products.get(axis, 0.0) + product
            self.fourths[axis] = self.fourths.get(axis, 0.0) + float(fourth.sum())

    def found(self) -> Iterator[tuple[float, Bursts]]:
        """Yield how sure the tails are, in errors of those of normal noise, and the bursts."""
        along = []
        for axis, total in self.squares.items():
            lines = total / self.frames
            mean = float(lines.mean())
            if not mean > 0:
                return
            spread = self.fourths[axis] / self.samples / mean**2 - 1
            size = self.samples / self.frames / lines.size
            error = spread * (2 / (self.samples * (size - 1))) ** 0.5
            alike = float((self.products[axis] / self.frames - lines**2).mean()) / mean**2
            # Less their mean, frames share their variances, and the mean of these: of two all.
            share = (1 - 2 / self.frames) ** 2 / (1 - 1 / self.frames)
            along.append(Bursts(spread - 2, 3 * alike / share, 3 * error / share))
        most = max(along, key=lambda one: one.bursts - _SURE * one.error)
        yield most.tails / (24 / self.samples) ** 0.5, most
