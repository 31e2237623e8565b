"""Fixed patterns over all exposures: an offset, a gain and a map that grows with exposure time.

The mean frames of all exposures are regressed, pixel by pixel, on 1, signal and exposure time. The
noise of each map is known from the pixel variances, so a map in units of its noise has mean square 1
where the sensor has no pattern; what single exposures hide stands out of the sum.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.scalars import Number, ratio_root
from dsis.measures.fixed_pattern import Smooth

Array = NDArray[np.float64]
MAPS = ("offset", "gain", "time")
ALONE = ("offset", "gain")
_LEAST_SPREAD = 0.02  # share of a regressor that the others leave, to be told from them


@dataclass(frozen=True)
class Regressors:
    """What each exposure's mean frame is regressed on, of one channel.

    Attributes
    ----------
    names
        Some of `MAPS`.
    rows
        Regressors by exposure, each scaled to a largest value of 1.
    scales
        What 1 stands for, by name: DN above black, s.
    weights
        By exposure: inverse variance of a pixel of the mean frame, DN^-2.
    """

    names: tuple[str, ...]
    rows: Mapping[str, Array]
    scales: Mapping[str, float]
    weights: Mapping[str, float]

    @classmethod
    def of(
        cls,
        exposures: Sequence[str],
        signal_dn: Mapping[str, float],
        time_s: Mapping[str, float],
        weights: Mapping[str, float],
    ) -> "Regressors":
        """Return those regressors that the exposures can tell apart."""
        w = np.sqrt([weights[name] for name in exposures])
        columns = {
            "offset": np.ones(len(exposures)),
            "gain": np.array([max(signal_dn[name], 0.0) for name in exposures]),
            "time": np.array([time_s[name] for name in exposures]),
        }
        kept: dict[str, Array] = {}
        scales = {}
        for name in MAPS:
            top = float(columns[name].max(initial=0.0))
            if top <= 0:
                continue
            column = columns[name] / top * w
            if kept:
                others = np.stack(list(kept.values()), 1)
                rest = column - others @ np.linalg.lstsq(others, column, rcond=None)[0]
            else:
                rest = column
            if (rest**2).sum() > _LEAST_SPREAD * (column**2).sum():
                kept[name], scales[name] = column, top
        rows = {
            name: np.array([kept[k][i] / w[i] for k in kept]) for i, name in enumerate(exposures)
        }
        return cls(tuple(kept), rows, scales, weights)


class PatternSums:
    """Sums over exposures from which the maps of one channel follow."""

    def __init__(self, regressors: Regressors, shape: tuple[int, int]) -> None:
        count = len(regressors.names)
        self.regressors = regressors
        self.moments = np.zeros((count, *shape))
        self.gram = np.zeros((count, count))
        self.noise = np.zeros((count, count))

    def add(self, exposure: str, mean_frame: Array, variance_dn2: float, frames: int) -> None:
        """Take the mean frame of an exposure and the variance of a pixel over time."""
        row, weight = self.regressors.rows[exposure], self.regressors.weights[exposure]
        flat = mean_frame - mean_frame.mean()
        self.moments += weight * row[:, None, None] * flat
        self.gram += weight * np.outer(row, row)
        self.noise += weight**2 * np.outer(row, row) * variance_dn2 / frames

    def maps(self) -> dict[str, tuple[Array, float]]:
        """Return each map (row, column) in DN at the regressor's largest value, and its noise.

        Those of `offset` and `gain` also alone, as if there were no other: less noise, but what is
        in one shows in the other.
        """
        inverse = np.linalg.inv(self.gram)
        solved = np.tensordot(inverse, self.moments, 1)
        noise = inverse @ self.noise @ inverse
        found = {
            name: (solved[i], sqrt(max(float(noise[i, i]), 1e-300)))
            for i, name in enumerate(self.regressors.names)
        }
        for i, name in enumerate(self.regressors.names):
            if name in ALONE and len(found) > 1:
                own = float(self.gram[i, i])
                found[f"{name} alone"] = (
                    self.moments[i] / own,
                    sqrt(max(float(self.noise[i, i]), 1e-300)) / own,
                )
        return found


@dataclass(frozen=True)
class Parts:
    """A map split by the hierarchy pixel -> row and column -> smooth surface.

    Attributes
    ----------
    pixels
        What is left of the map: (row, column).
    rows, columns
        Line means beyond smooth ones: (row), (column).
    square
        Mean square of the pixels per degree of freedom.
    numbers
        The statistics.
    """

    pixels: Array
    rows: Array
    columns: Array
    square: float
    numbers: Mapping[str, Number]


def parts(image: Array, noise: float) -> Parts:
    """Return the hierarchy of a map (row, column) whose noise per pixel is known."""
    n, m = image.shape
    smooth = Smooth.of(n, m)
    unit = (image - image.mean()) / noise
    coefficients = smooth.coefficients(unit)
    mixed = int(smooth.mixed.sum())
    by_row, by_column = unit.mean(1), unit.mean(0)
    pixels = unit - by_row[:, None] - by_column
    pixels = pixels - smooth.surface(np.where(smooth.mixed, coefficients, 0.0))
    dof = (n - 1) * (m - 1) - mixed
    square = float((pixels**2).sum()) / dof
    rows = by_row - smooth.along_rows @ (smooth.along_rows.T @ by_row)
    columns = by_column - smooth.along_columns @ (smooth.along_columns.T @ by_column)
    degree = smooth.degree
    row = m * float((rows**2).sum()) / (n - 1 - degree)
    column = n * float((columns**2).sum()) / (m - 1 - degree)
    surface = (coefficients[smooth.mixed] ** 2).sum()
    lines = (coefficients[1:, 0] ** 2).sum() * square / max(row, square) + (
        coefficients[0, 1:] ** 2
    ).sum() * square / max(column, square)
    kinds = mixed + 2 * degree
    numbers = {
        "fixed_pixel_variance": ratio_root(square, dof),
        "fixed_row_variance": ratio_root(row / square, n - 1 - degree, dof),
        "fixed_column_variance": ratio_root(column / square, m - 1 - degree, dof),
        "fixed_smooth_variance": ratio_root((surface + lines) / kinds / square, kinds, dof),
        **_correlations(pixels),
        "outlying_pixels": _outlying(pixels, square),
        **_seams(by_row, by_column, (row, column)),
    }
    return Parts(pixels, rows, columns, square, numbers)


def _correlations(pixels: Array) -> dict[str, Number]:
    square = float((pixels**2).mean())
    sd = 1 / sqrt(pixels.size)
    return {
        "fixed_correlation_0_1": (float((pixels[:, 1:] * pixels[:, :-1]).mean()) / square, sd),
        "fixed_correlation_1_0": (float((pixels[1:] * pixels[:-1]).mean()) / square, sd),
    }


def _outlying(pixels: Array, square: float) -> Number:
    """Return the excess kurtosis of a map: few pixels that stand far out."""
    fourth = float((pixels**4).mean()) / square**2
    return float(np.log(max(fourth, 0.1) / 3)), sqrt(24 / pixels.size) / 3


def _seams(by_row: Array, by_column: Array, squares: tuple[float, float]) -> dict[str, Number]:
    """Return the step between halves, and between even and odd lines, in its own noise."""
    found: dict[str, Number] = {}
    for axis, means, square, across in (
        ("rows", by_row, squares[0], by_column.size),
        ("columns", by_column, squares[1], by_row.size),
    ):
        size = means.size
        sd = sqrt(square / across)
        step = np.where(np.arange(size) < size / 2, -0.5, 0.5)
        comb = np.where(np.arange(size) % 2 == 0, -0.5, 0.5)
        for name, shape in (("half_seam", step), ("parity", comb)):
            found[f"{name} of {axis}"] = _projected(means, shape, sd)
    return found


def _projected(means: Array, shape: Array, sd: float) -> Number:
    """Return the coefficient of a shape beside smooth polynomials, over its error."""
    place = np.linspace(-1, 1, means.size)
    smooth = np.polynomial.legendre.legvander(place, min(4, means.size - 3))
    rest = shape - smooth @ np.linalg.lstsq(smooth, shape, rcond=None)[0]
    return float(rest @ means) / (sd * float(np.linalg.norm(rest))), 1.0
