"""Fixed patterns over all exposures: an offset, a gain and a map that grows with exposure time.

The mean frames of all exposures are regressed, pixel by pixel, on 1, signal and exposure time. The
noise of each map is known from the pixel variances, so a map in units of its noise has a mean
square of 1 where the sensor has no pattern; what single exposures hide stands out of the sum.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from math import log, sqrt

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.scalars import Number, ratio_root
from dsis.compiled import kernel
from dsis.measures.fixed_pattern import Smooth
from dsis.measures.residuals import pixel_residuals

Array = NDArray[np.float64]
MAPS = ("offset", "gain", "time")
ALONE = ("offset", "gain")
LOW = "low order"
WHOLE = "halves as a whole"
STANDING_OUT = (3.5, 5)  # standard deviations of a map above its middle
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
        for i, share in enumerate(weight * row):
            if share:  # darks have no gain
                self.moments[i] += share * flat
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
    coefficients
        Of smooth polynomials (row degree, column degree), in units of the map's noise.
    numbers
        The statistics.
    """

    pixels: Array
    rows: Array
    columns: Array
    square: float
    coefficients: Array
    numbers: Mapping[str, Number]


def parts(image: Array, noise: float) -> Parts:
    """Return the hierarchy of a map (row, column) whose noise per pixel is known."""
    n, m = image.shape
    smooth = Smooth.of(n, m)
    unit = (image - image.mean()) / noise
    coefficients = smooth.coefficients(unit)
    by_row, by_column, pixels, squares, scatter = pixel_residuals(
        unit, smooth.weights(coefficients), smooth.across
    )
    dof = (n - 1) * (m - 1) - smooth.kinds
    square = squares / dof
    rows = by_row - smooth.along_rows @ (smooth.along_rows.T @ by_row)
    columns = by_column - smooth.along_columns @ (smooth.along_columns.T @ by_column)
    degree = smooth.degree
    row = m * float(rows @ rows) / (n - 1 - degree)
    column = n * float(columns @ columns) / (m - 1 - degree)
    mean_square = squares / pixels.size
    numbers = {
        "fixed_pixel_variance": ratio_root(square, dof),
        "fixed_row_variance": ratio_root(row / square, n - 1 - degree, dof),
        "fixed_column_variance": ratio_root(column / square, m - 1 - degree, dof),
        **surfaces(coefficients, (row, column, square), dof),
        **slopes(coefficients, (row, column, square), image.shape),
        **_correlations(pixels, mean_square),
        "outlying_pixels": _outlying(scatter + mean_square**2, square, pixels.size),
        **_standing_out(pixels, square),
        **_seams(by_row, by_column, (row, column)),
    }
    return Parts(pixels, rows, columns, square, coefficients, numbers)


def surfaces(
    coefficients: Array, squares: tuple[float, float, float], dof: float
) -> dict[str, Number]:
    """Return the power of smooth surfaces: of all, and of those of second degree at most.

    Parameters
    ----------
    coefficients
        (row degree, column degree), in units of the map's noise.
    squares
        Mean squares of rows, columns and pixels: lines that differ make polynomials along one axis.
    dof
        Of the pixels' mean square.
    """
    row, column, square = squares
    size = len(coefficients)
    order = np.arange(size)[:, None] + np.arange(size)
    share = np.ones_like(coefficients)
    share[:, 0], share[0, :] = square / max(row, square), square / max(column, square)
    power = coefficients**2 * share
    found = {}
    for name, most in (("fixed_smooth_variance", size - 1), (f"fixed_smooth_variance of {LOW}", 2)):
        taken = (order > 0) & (order <= most)
        kinds = int(taken.sum())
        found[name] = ratio_root(float(power[taken].sum()) / kinds / square, kinds, dof)
    return found


def slopes(
    coefficients: Array, squares: tuple[float, float, float], shape: tuple[int, ...]
) -> dict[str, Number]:
    """Return the tilt along each axis and the fall to the corners, each in its own noise.

    Parameters
    ----------
    coefficients
        (row degree, column degree), in units of the map's noise.
    squares
        Mean squares of rows, columns and pixels.
    shape
        Rows and columns: a fall with the distance from the centre bends along both.
    """
    row, column, square = squares
    if len(coefficients) < 3:
        return {}
    down, across = max(row, square), max(column, square)
    smooth = Smooth.of(shape[0], shape[1])
    # Orthonormal polynomials have any sign: here they rise towards the last line.
    signed = np.outer(np.sign(smooth.along_rows[-1]), np.sign(smooth.along_columns[-1]))
    signed = coefficients * signed[: len(coefficients), : len(coefficients)]
    n, m = float(shape[0]) ** 2, float(shape[1]) ** 2
    fall = n * signed[2, 0] + m * signed[0, 2]
    return {
        "fixed_smooth_tilt of rows": (float(signed[1, 0]) / sqrt(down), 1.0),
        "fixed_smooth_tilt of columns": (float(signed[0, 1]) / sqrt(across), 1.0),
        "fixed_smooth_falloff": (float(fall) / sqrt(n**2 * down + m**2 * across), 1.0),
    }


def _correlations(pixels: Array, square: float) -> dict[str, Number]:
    n, m = pixels.shape
    sd = 1 / sqrt(pixels.size)
    beside, below = _neighbours(pixels)
    return {
        "fixed_correlation_0_1": (float(beside) / (n * (m - 1)) / square, sd),
        "fixed_correlation_1_0": (float(below) / ((n - 1) * m) / square, sd),
    }


@kernel
def _neighbours(pixels: Array) -> tuple[float, float]:
    """Return the sums of products of neighbours in a row, and in a column."""
    rows, columns = pixels.shape
    beside, below = 0.0, 0.0
    for y in range(rows):
        line, total = pixels[y], 0.0
        for x in range(1, columns):
            total += line[x - 1] * line[x]
        beside += total
        if y:
            total, above = 0.0, pixels[y - 1]
            for x in range(columns):
                total += above[x] * line[x]
            below += total
    return beside, below


def _outlying(fourth: float, square: float, size: int) -> Number:
    """Return the excess kurtosis of a map: few pixels that stand far out."""
    return log(max(fourth / square**2, 0.1) / 3), sqrt(24 / size) / 3


def _standing_out(pixels: Array, square: float) -> dict[str, Number]:
    """Return how many pixels lie far above the others, as twice the root (Anscombe 1948)."""
    sd = sqrt(square)
    return {
        f"outlying_pixels of {limit:g}": (2 * sqrt((pixels > limit * sd).sum() + 3 / 8), 1.0)
        for limit in STANDING_OUT
    }


def _seams(by_row: Array, by_column: Array, squares: tuple[float, float]) -> dict[str, Number]:
    """Return the step between halves, and between even and odd lines, in its own noise.

    Each is the coefficient of its shape beside smooth polynomials, over its error; that of halves
    as a whole is not, and sees a tilt too.
    """
    found: dict[str, Number] = {}
    for axis, means, square, across in (
        ("rows", by_row, squares[0], by_column.size),
        ("columns", by_column, squares[1], by_row.size),
    ):
        sd = sqrt(square / across)
        for name, shape in zip(("half_seam", "parity"), _seam_shapes(means.size), strict=True):
            found[f"{name} of {axis}"] = (float(shape @ means) / sd, 1.0)
        half = np.where(np.arange(means.size) < means.size / 2, -1.0, 1.0)
        half = (half - half.mean()) / (sqrt(means.size) * half.std())
        found[f"half_seam of {axis}, {WHOLE}"] = (float(half @ means) / sd, 1.0)
    return found


@lru_cache(maxsize=64)
def _seam_shapes(size: int) -> tuple[Array, Array]:
    """Return the step between halves and the comb, less smooth polynomials, of norm 1."""
    place, line = np.linspace(-1, 1, size), np.arange(size)
    smooth = np.polynomial.legendre.legvander(place, min(4, size - 3))
    step, comb = np.where(line < size / 2, -0.5, 0.5), np.where(line % 2 == 0, -0.5, 0.5)
    both = np.stack([step, comb], 1)
    rest = both - smooth @ np.linalg.lstsq(smooth, both, rcond=None)[0]
    rest /= np.linalg.norm(rest, axis=0)
    return np.ascontiguousarray(rest[:, 0]), np.ascontiguousarray(rest[:, 1])
