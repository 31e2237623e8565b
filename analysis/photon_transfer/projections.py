"""Orthogonal projections of a map: a smooth surface, rows, columns, pixels."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.polynomial.legendre import legvander
from numpy.typing import NDArray

from dsis.measures.fixed_pattern import Smooth

Floats = NDArray[np.float64]

MAX_DEGREE = 6  # of the smooth surface, in all
_LINES_PER_DEGREE = 16  # enough lines must be left to tell their variance
OUTLIER_SD = 6.0  # 2e-9 of Gaussian pixels: beyond, a pixel is a defect that no sigma describes
_SD_PER_MEDIAN = 1.4826  # of the absolute value of a Gaussian


@dataclass(frozen=True)
class Split:
    """Orthogonal parts of a map: mixed surface, rows and columns with their smooth part, pixels."""

    mixed: Floats
    row: Floats
    smooth_row: Floats
    column: Floats
    smooth_column: Floats
    rest: Floats

    @classmethod
    def of(cls, centred: Floats, basis: Smooth) -> Self:
        """Return the parts of a map (row, column) of mean 0."""
        mixed = basis.surface(np.where(basis.mixed, basis.coefficients(centred), 0.0))
        by_row, by_column = centred.mean(1), centred.mean(0) - centred.mean()
        smooth_row = basis.along_rows @ (basis.along_rows.T @ by_row)
        smooth_column = basis.along_columns @ (basis.along_columns.T @ by_column)
        rest = centred - mixed - by_row[:, None] - by_column
        row, column = by_row - smooth_row, by_column - smooth_column
        return cls(mixed, row, smooth_row, column, smooth_column, rest)


@dataclass(frozen=True)
class Part:
    """A projection of the map: mean square per degree of freedom, and what noise has of it."""

    square: float
    noise: float
    dof: int

    @classmethod
    def of(cls, values: Floats, size: int, noise: float, dof: int) -> Self:
        """Return the part of `values`, each of which stands for `size` pixels."""
        return cls(size * float((values**2).sum()) / dof if dof > 0 else 0.0, noise, max(dof, 0))

    @property
    def factor(self) -> float:
        """Wiener's factor: signal / (signal + noise)."""
        return max(1 - self.noise / self.square, 0.0) if self.square > 0 else 0.0

    @property
    def left(self) -> float:
        """Sum of squares by which the shrunk part misses the pattern: signal x noise / both."""
        return self.dof * self.factor * self.noise


def basis_of(rows: int, columns: int) -> Smooth:
    """Return the surfaces that a plane has lines enough for."""
    degree = min(MAX_DEGREE, min(rows, columns) // _LINES_PER_DEGREE)
    along = (np.linalg.qr(legvander(np.linspace(-1, 1, n), degree))[0] for n in (rows, columns))
    return Smooth(*along)


def outliers_of(rest: Floats) -> NDArray[np.bool_]:
    """Return which pixels lie further out than Gaussian ones do."""
    sd = _SD_PER_MEDIAN * float(np.median(np.abs(rest)))
    return np.abs(rest) > OUTLIER_SD * sd if sd > 0 else np.zeros(rest.shape, np.bool_)
