"""The fixed pattern as a hierarchy: pixel -> row and column -> smooth surface.

The mean frame is split by orthogonal projections: polynomials in row and column of total degree 6
at most (smooth), what rows and columns have left, what pixels have left. The finer leaks into the
coarser, as 1/columns, 1/rows and per polynomial, and so does 1/T of the temporal noise; both are
taken off (Searle, Casella & McCulloch, "Variance components", 1992, chapter 4).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from math import nan
from typing import NamedTuple

import numpy as np
from numpy.polynomial.legendre import legvander
from numpy.typing import NDArray

from dsis.compiled import kernel
from dsis.measures import kernels
from dsis.measures.estimate import Estimate, estimate
from dsis.measures.residuals import line_residuals, pixel_residuals
from dsis.measures.variance_components import Components

DEGREE = 6
Array = NDArray[np.float64]


@dataclass(frozen=True)
class Smooth:
    """Smooth surfaces on a plane: products of polynomials orthonormal on its rows and columns.

    Attributes
    ----------
    along_rows, along_columns
        Polynomials of degree 0, 1 ..: (row, degree), (column, degree).
    """

    along_rows: Array
    along_columns: Array

    @classmethod
    @lru_cache(maxsize=64)
    def of(cls, rows: int, columns: int) -> "Smooth":
        """Return the basis of degree 6, or less where a plane has fewer than 14 rows or columns."""
        degree = min(DEGREE, (min(rows, columns) - 2) // 2)
        bases = [
            np.linalg.qr(legvander(np.linspace(-1, 1, size), degree))[0] for size in (rows, columns)
        ]
        return cls(bases[0], bases[1])

    @property
    def degree(self) -> int:
        """Largest total degree."""
        return int(self.along_rows.shape[1]) - 1

    @cached_property
    def mixed(self) -> NDArray[np.bool_]:
        """Which products (row degree, column degree) are smooth and neither rows nor columns."""
        i = np.arange(self.degree + 1)
        return (i[:, None] >= 1) & (i >= 1) & (i[:, None] + i <= self.degree)

    @cached_property
    def kinds(self) -> int:
        """How many products are smooth and neither rows nor columns."""
        return int(self.mixed.sum())

    @cached_property
    def across(self) -> Array:
        """Polynomials along columns, (degree, column), rows of it contiguous."""
        return np.ascontiguousarray(self.along_columns.T)

    def coefficients(self, images: NDArray[np.floating]) -> Array:
        """Return the coefficients (.., row degree, column degree) of images (.., row, column)."""
        n, m = images.shape[-2:]
        first = kernels.project(images.reshape(-1, n, m), self.along_rows)
        product: Array = first @ self.along_columns
        return product.reshape(*images.shape[:-2], *product.shape[1:])

    def weights(self, coefficients: Array) -> Array:
        """Return those of `across` in each row, (.., row, degree), of what is smooth in both."""
        weights: Array = self.along_rows @ np.where(self.mixed, coefficients, 0.0)
        return weights

    def surface(self, coefficients: Array) -> Array:
        """Return the image (row, column) of coefficients."""
        made: Array = self.along_rows @ coefficients @ self.along_columns.T
        return made


@dataclass(frozen=True)
class FixedPattern:
    """The fixed pattern of one channel.

    Attributes
    ----------
    estimates
        fixed_pixel_variance, fixed_row_variance, fixed_column_variance, fixed_smooth_variance.
    pixels
        What pixels have left of the mean frame: (row, column), temporal noise / T included.
    mean_square
        Its mean square per degree of freedom, DN^2.
    """

    estimates: dict[str, Estimate]
    pixels: Array
    mean_square: float


class _Lines(NamedTuple):
    """Mean squares of rows (or columns) beyond smooth ones: of the mean frame, and temporal / T."""

    size: int  # pixels a line
    dof: int
    spatial: float
    temporal: float


def fixed_patterns(
    means: Array,
    smooth: Smooth,
    surfaces: Array,
    row_means: Array,
    column_means: Array,
    parts: Sequence[Components],
    threads: int = 1,
) -> list[FixedPattern]:
    """Return the fixed patterns of mean frames (plane, row, column), DN.

    Parameters
    ----------
    means
        The mean frames.
    smooth, surfaces
        Basis and its coefficients for each frame: (frame, plane, row degree, column degree).
    row_means, column_means
        Of each frame: (plane, frame, row), (plane, frame, column), DN.
    parts
        Components of the temporal noise of each plane.
    threads
        Threads that may be used.
    """
    _, n, m = means.shape
    coefficients = smooth.coefficients(means)
    left = [
        pixel_residuals(mean, weights, smooth.across, threads)
        for mean, weights in zip(means, smooth.weights(coefficients), strict=True)
    ]
    by_row, by_column = np.array([one[0] for one in left]), np.array([one[1] for one in left])
    rows = _lines(by_row, row_means, smooth.along_rows, m)
    columns = _lines(by_column, column_means, smooth.along_columns, n)
    return [
        _fixed_pattern(left[k][2:], smooth, coefficients[k], surfaces[:, k], rows[k], columns[k], c)
        for k, c in enumerate(parts)
    ]


def _fixed_pattern(
    left: tuple[Array, float, float],
    smooth: Smooth,
    coefficients: Array,
    surfaces: Array,
    rows: _Lines,
    columns: _Lines,
    c: Components,
) -> FixedPattern:
    """Return the fixed pattern from what is left of the pixels, sums of squares, and lines."""
    pixels, squares, scatter = left
    n, m = pixels.shape
    dof = (n - 1) * (m - 1) - smooth.kinds
    square = squares / dof if dof > 0 else nan
    noise = c.ms_pixel / c.frames
    spatial_error = scatter / pixels.size * (pixels.size / dof) ** 2 if dof else 0
    pixel = square - noise
    # Chi-squared of the mean frame, and of the temporal noise that is taken off.
    pixel_null = 2 * noise**2 / dof * (1 + 1 / (c.frames - 1)) if dof > 0 else nan
    estimates = {
        "fixed_pixel_variance": estimate(
            pixel, spatial_error + c.var_ms_pixel / c.frames**2, 0.0, pixel_null
        )
    }
    for name, lines in (("row", rows), ("column", columns)):
        value = (lines.spatial - square - lines.temporal + noise) / lines.size
        error = 2 * lines.spatial**2 / (lines.dof + 2) + spatial_error
        error += 2 * lines.temporal**2 / ((c.frames - 1) * lines.dof + 2)
        null = 2 * noise**2 / lines.dof * (1 + 1 / (c.frames - 1)) + pixel_null
        estimates[f"fixed_{name}_variance"] = estimate(
            value, error / lines.size**2, 0.0, null / lines.size**2
        )
    estimates["fixed_smooth_variance"] = _smooth_variance(
        coefficients, surfaces, smooth, (square, rows, columns), (noise, c.frames), (n, m)
    )
    return FixedPattern(estimates, pixels, square)


def _lines(means: Array, series: Array, basis: Array, size: int) -> list[_Lines]:
    """Return the mean squares of lines of `size` pixels, of each plane."""
    frames, dof = series.shape[1], means.shape[1] - basis.shape[1]
    spatial, temporal = line_residuals(means, series, basis)
    return [
        _Lines(size, dof, size * still / dof, size * moving / ((frames - 1) * dof) / frames)
        for still, moving in zip(spatial.tolist(), temporal.tolist(), strict=True)
    ]


def _smooth_variance(
    coefficients: Array,
    surfaces: Array,
    smooth: Smooth,
    finer: tuple[float, _Lines, _Lines],
    temporal: tuple[float, int],
    shape: tuple[int, int],
) -> Estimate:
    """Return the mean square of the smooth surface beyond what finer patterns and noise leave.

    Each squared coefficient is non-central chi-squared: var = 2 tau^2 + 4 c^2 tau, tau its noise.
    """
    square, rows, columns = finer
    noise, frames = temporal
    value, error, known = _smooth_sums(
        coefficients,
        surfaces,
        (square, rows.spatial, columns.spatial),
        (noise, rows.temporal, columns.temporal),
    )
    lines_error = sum(
        smooth.degree**2 * 2 * (part.spatial**2 + part.temporal**2 / (frames - 1)) / (part.dof + 2)
        for part in (rows, columns)
    )
    kinds = known + smooth.degree**2 * (1 / rows.dof + 1 / columns.dof)
    null = 2 * noise**2 * (1 + 1 / (frames - 1)) * kinds
    size = shape[0] * shape[1]
    return estimate(value / size, (error + lines_error) / size**2, 0.0, null / size**2)


@kernel
def _smooth_sums(
    coefficients: Array,
    surfaces: Array,
    spatial: tuple[float, float, float],
    temporal: tuple[float, float, float],
) -> tuple[float, float, int]:
    """Return the sum of squared coefficients beyond finer patterns, its variance, their number.

    `spatial`, `temporal`: mean squares of pixels, rows, columns.
    """
    frames, top, _ = surfaces.shape
    value, error, null, again = 0.0, 0.0, 0.0, 0.0
    count = 0
    for i in range(top):
        for j in range(top):
            kind = (0 if i else 2) if j else 1
            if i + j == 0 or (i and j and i + j >= top):
                continue
            count += 1
            tau = spatial[kind]
            # Temporal noise may have smooth parts of its own: measured, not assumed.
            mean, left = 0.0, 0.0
            for t in range(frames):
                mean += surfaces[t, i, j] / frames
            for t in range(frames):
                left += (surfaces[t, i, j] - mean) ** 2
            left /= (frames - 1) * frames
            square = coefficients[i, j] ** 2
            value += square - left - (tau - temporal[kind])
            # 4 tau (coefficient^2 - tau) estimates the second term without bias.
            error += 4 * tau * square - 2 * tau * tau
            null += tau * tau
            again += 2 * left * left / (frames + 1)
    return value, max(error, null) + again, count
