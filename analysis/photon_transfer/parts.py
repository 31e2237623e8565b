"""The parts of a fixed pattern - pixels, rows, columns, smooth - and its best linear estimate.

A map is the sensor's pattern plus temporal noise of known variance. Orthogonal projections split it
into a smooth surface (polynomials), what rows and columns have left, and what pixels have left; in
each the pattern is shrunk by signal / (signal + noise), Wiener's factor, which is the best linear
estimate (Searle, Casella & McCulloch, "Variance components", 1992, chapters 4 and 7).
"""

from dataclasses import dataclass
from typing import Self

import numpy as np
from scipy import stats

from analysis.photon_transfer.projections import Floats, Part, Split, basis_of, outliers_of

LEAST_LINES = 3  # of a plane, below which nothing can be split
P_SEEN = 1e-3  # a part that chance makes so rarely is real


@dataclass(frozen=True)
class Noise:
    """Temporal noise left in a map: variance of a pixel, of a row's and of a column's offset.

    Each rests on `dof` residual frames.
    """

    pixel: float
    row: float
    column: float
    dof: float

    def plus(self, other: "Noise") -> "Noise":
        """Return the sum of independent noises (degrees of freedom by Satterthwaite)."""
        total = self.pixel + other.pixel
        error = self.pixel**2 / self.dof + other.pixel**2 / other.dof
        dof = total**2 / error if error > 0 else self.dof + other.dof
        return Noise(total, self.row + other.row, self.column + other.column, dof)

    def times(self, factor: float) -> "Noise":
        """Return the noise with its variances times a factor."""
        return Noise(self.pixel * factor, self.row * factor, self.column * factor, self.dof)


@dataclass(frozen=True)
class Component:
    """Variance of one part of a pattern over all sensors like this one.

    Attributes
    ----------
    variance, standard_error
        Unbiased, so that it may come out below zero.
    p
        How often noise and finer parts alone look like it.
    square
        Mean square per degree of freedom, noise and finer parts included.
    """

    variance: float
    standard_error: float
    p: float
    square: float


@dataclass(frozen=True)
class Pattern:
    """The fixed pattern of a plane, in the unit of its map.

    Attributes
    ----------
    estimate
        Best linear estimate of the pattern about its mean: (row, column).
    left
        Mean square by which the estimate misses the pattern, per pixel.
    pixel, row, column
        Offsets of pixels (outliers left out), rows and columns, beyond the smooth surface.
    smooth
        The smooth surface: its mean square, beyond what noise and finer parts make of it.
    outliers
        Pixels more than 6 standard deviations out: kept as measured.
    mean_variance
        What pixels, rows and columns add to the variance of the plane's mean, over sensors.
    """

    estimate: Floats
    left: float
    pixel: Component
    row: Component
    column: Component
    smooth: Component
    outliers: int

    @classmethod
    def of(cls, plane: Floats, noise: Noise) -> Self:
        """Return the pattern of a map (row, column); ValueError where it is less than 3 x 3."""
        n, m = plane.shape
        if min(n, m) < LEAST_LINES:
            message = f"{n} x {m} pixels are too few to split, {LEAST_LINES} x {LEAST_LINES} needed"
            raise ValueError(message)
        centred = plane - plane.mean()
        basis = basis_of(n, m)
        rest = Split.of(centred, basis).rest
        outside = outliers_of(rest)
        # Defects must not pull the rows, columns and surface that they lie on.
        split = Split.of(np.where(outside, centred - rest, centred), basis)
        degree, terms, lost = basis.degree, int(basis.mixed.sum()), int(outside.sum())
        pixels = Part.of(split.rest, 1, noise.pixel, (n - 1) * (m - 1) - terms - lost)
        rows = Part.of(split.row, m, noise.pixel + m * noise.row, n - 1 - degree)
        columns = Part.of(split.column, n, noise.pixel + n * noise.column, m - 1 - degree)
        bends = (
            Part.of(split.mixed, 1, noise.pixel, terms),
            Part.of(split.smooth_row, m, rows.noise, degree),
            Part.of(split.smooth_column, n, columns.noise, degree),
        )
        by_row = rows.factor * split.row + bends[1].factor * split.smooth_row
        by_column = columns.factor * split.column + bends[2].factor * split.smooth_column
        estimate = pixels.factor * split.rest + bends[0].factor * split.mixed
        estimate = np.where(outside, centred, estimate + by_row[:, None] + by_column)
        left = sum(part.left for part in (pixels, rows, columns, *bends)) + lost * noise.pixel
        own = _pixel_component(pixels, split.rest[~outside], noise.dof)
        return cls(
            estimate,
            left / (n * m),
            own,
            _line_component(rows, m, pixels, own, noise.dof),
            _line_component(columns, n, pixels, own, noise.dof),
            _smooth_component(bends, (pixels, rows, columns), n * m),
            lost,
        )

    @property
    def mean_variance(self) -> float:
        """Variance of the plane's mean over sensors: pixels / N + rows / H + columns / W."""
        n, m = self.estimate.shape
        parts = ((self.pixel, n * m), (self.row, n), (self.column, m))
        # Each is unbiased and may come out below zero; their sum may not.
        return float(max(sum(part.variance / count for part, count in parts), 0.0))


def _pixel_component(part: Part, kept: Floats, frames: float) -> Component:
    # How the squares scatter holds the pixels' kurtosis; residuals are fewer than pixels.
    error = float((kept**2).var()) / kept.size * (kept.size / max(part.dof, 1)) ** 3
    error += 2 * part.noise**2 / (frames * max(part.dof, 1))
    ratio = part.square / max(part.noise, 1e-300)
    p = float(stats.f.sf(ratio, part.dof, frames * part.dof)) if part.dof else 1.0
    return Component(part.square - part.noise, float(np.sqrt(error)), p, part.square)


def _line_component(
    part: Part, size: int, pixels: Part, own: Component, frames: float
) -> Component:
    if part.dof < 1:
        return Component(0.0, 0.0, 1.0, pixels.square)
    variance = (part.square - part.noise - own.variance) / size
    error = 2 * part.square**2 / (part.dof + 2) + 2 * part.noise**2 / (frames * part.dof)
    finer = part.noise + max(own.variance, 0.0)
    p = float(stats.f.sf(part.square / max(finer, 1e-300), part.dof, max(pixels.dof, 1)))
    return Component(variance, float(np.sqrt(error + own.standard_error**2)) / size, p, part.square)


def _smooth_component(bends: tuple[Part, ...], finer: tuple[Part, ...], pixels: int) -> Component:
    dof = sum(part.dof for part in bends)
    if not dof:
        return Component(0.0, 0.0, 1.0, 0.0)
    found = sum(part.dof * part.square for part in bends)
    expected = sum(b.dof * f.square for b, f in zip(bends, finer, strict=True))
    # A few coefficients of any size over coefficients of noise: 4 c^2 tau + 2 tau^2 each.
    error = sum(
        b.dof * (4 * b.square * f.square - 2 * f.square**2)
        for b, f in zip(bends, finer, strict=True)
    )
    p = float(stats.f.sf(found / max(expected, 1e-300), dof, min(part.dof for part in finer)))
    variance = (found - expected) / pixels
    return Component(variance, float(np.sqrt(max(error, 0.0))) / pixels, p, found / dof)
