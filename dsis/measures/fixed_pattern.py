"""The fixed pattern as a hierarchy: pixel -> row and column -> smooth surface.

The mean frame is split by orthogonal projections: polynomials in row and column of total degree 6
at most (smooth), what rows and columns have left, what pixels have left. The finer leaks into the
coarser, as 1/columns, 1/rows and per polynomial, and so does 1/T of the temporal noise; both are
taken off (Searle, Casella & McCulloch, "Variance components", 1992, chapter 4).
"""

from dataclasses import dataclass

import numpy as np
from numpy.polynomial.legendre import legvander
from numpy.typing import NDArray

from dsis.measures import kernels
from dsis.measures.estimate import Estimate, estimate
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

    @property
    def mixed(self) -> NDArray[np.bool_]:
        """Which products (row degree, column degree) are smooth and neither rows nor columns."""
        i = np.arange(self.degree + 1)
        return (i[:, None] >= 1) & (i >= 1) & (i[:, None] + i <= self.degree)

    def coefficients(self, image: NDArray[np.floating]) -> Array:
        """Return the coefficients (row degree, column degree) of an image (row, column)."""
        product: Array = kernels.project(image, self.along_rows) @ self.along_columns
        return product

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


@dataclass(frozen=True)
class _Lines:
    """Mean squares of rows (or columns) beyond smooth ones: of the mean frame, and temporal / T."""

    size: int  # pixels a line
    dof: int
    spatial: float
    temporal: float


def fixed_pattern(
    mean: Array,
    smooth: Smooth,
    surfaces: Array,
    row_means: Array,
    column_means: Array,
    c: Components,
) -> FixedPattern:
    """Return the fixed pattern of a mean frame (row, column), DN.

    Parameters
    ----------
    mean
        The mean frame.
    smooth, surfaces
        Basis and its coefficients for each frame: (frame, row degree, column degree).
    row_means, column_means
        Of each frame: (frame, row), (frame, column), DN.
    c
        Components of the temporal noise.
    """
    n, m = mean.shape
    coefficients = smooth.coefficients(mean)
    pixels = mean - mean.mean(1)[:, None] - mean.mean(0) + mean.mean()
    pixels = pixels - smooth.surface(np.where(smooth.mixed, coefficients, 0.0))
    mixed = int(smooth.mixed.sum())
    dof = (n - 1) * (m - 1) - mixed
    square = float((pixels**2).sum()) / dof if dof > 0 else np.nan
    noise = c.ms_pixel / c.frames
    spatial_error = float((pixels**2).var()) / pixels.size * (pixels.size / dof) ** 2 if dof else 0
    pixel = square - noise
    rows = _lines(mean.mean(1), row_means, smooth.along_rows, m)
    columns = _lines(mean.mean(0), column_means, smooth.along_columns, n)
    # Chi-squared of the mean frame, and of the temporal noise that is taken off.
    pixel_null = 2 * noise**2 / dof * (1 + 1 / (c.frames - 1)) if dof > 0 else np.nan
    estimates = {
        "fixed_pixel_variance": estimate(
            pixel, spatial_error + c.var_ms_pixel / c.frames**2, 0.0, pixel_null
        )
    }
    variances = []
    for name, lines in (("row", rows), ("column", columns)):
        value = (lines.spatial - square - lines.temporal + noise) / lines.size
        error = 2 * lines.spatial**2 / (lines.dof + 2) + spatial_error
        error += 2 * lines.temporal**2 / ((c.frames - 1) * lines.dof + 2)
        null = 2 * noise**2 / lines.dof * (1 + 1 / (c.frames - 1)) + pixel_null
        variances.append(value)
        estimates[f"fixed_{name}_variance"] = estimate(
            value, error / lines.size**2, 0.0, null / lines.size**2
        )
    estimates["fixed_smooth_variance"] = _smooth_variance(
        coefficients, surfaces, smooth, (square, rows, columns), (noise, c.frames), (n, m)
    )
    return FixedPattern(estimates, pixels, square)


def _lines(means: Array, series: Array, basis: Array, size: int) -> _Lines:
    frames, dof = len(series), len(means) - basis.shape[1]
    rest = means - basis @ (basis.T @ means)
    wander = series - series.mean(0)
    wander = wander - (wander @ basis) @ basis.T
    temporal = size * float((wander**2).sum()) / ((frames - 1) * dof) / frames
    return _Lines(size, dof, size * float((rest**2).sum()) / dof, temporal)


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
    tau = np.where(smooth.mixed, square, 0.0)
    tau[1:, 0], tau[0, 1:] = rows.spatial, columns.spatial
    use = smooth.mixed.copy()
    use[1:, 0] = use[0, 1:] = True
    # Temporal noise may have smooth parts of its own: what each leaves is measured, not assumed.
    left = surfaces.var(0, ddof=1) / frames
    expected = tau.copy()
    expected -= np.where(smooth.mixed, noise, 0.0)
    expected[1:, 0] -= rows.temporal
    expected[0, 1:] -= columns.temporal
    value = (coefficients**2 - left - expected)[use].sum()
    # 4 tau (coefficient^2 - tau) estimates the second term without bias.
    error = max((4 * tau * coefficients**2 - 2 * tau**2)[use].sum(), (tau**2)[use].sum())
    error += (2 * left**2 / (frames + 1))[use].sum()
    lines_error = sum(
        smooth.degree**2 * 2 * (part.spatial**2 + part.temporal**2 / (frames - 1)) / (part.dof + 2)
        for part in (rows, columns)
    )
    kinds = int(use.sum()) + smooth.degree**2 * (1 / rows.dof + 1 / columns.dof)
    null = 2 * noise**2 * (1 + 1 / (frames - 1)) * kinds
    size = shape[0] * shape[1]
    return estimate(float(value) / size, (error + lines_error) / size**2, 0.0, null / size**2)
