"""One line through points of variance against signal, and how badly it misses.

The points are gamma distributed about slope * x + intercept with known relative errors, so they are
fitted by iterated weighted least squares with the model's own variance and compared by deviance.
Errors in x enter the weights with the slope; they are small, for white noise
m^2 Var(mean) / Var(variance) = m^2 (T - 1) / (2 T v).
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_ITERATIONS = 12
_CONVERGED = 1e-9


@dataclass(frozen=True)
class Points:
    """Noise against signal, ascending in x; DN above black, DN^2, relative error of the variance.

    `black_share` is the derivative of x with respect to the black level: -1 where x is a mean code
    less black, 0 where x is known without it (darks).
    """

    x_dn: Floats
    variance_dn2: Floats
    relative_se: Floats
    x_se_dn: Floats
    channel: NDArray[np.str_]
    black_share: Floats

    @classmethod
    def of(cls, **columns: NDArray[np.generic]) -> "Points":
        """Return the points in ascending order of x."""
        order = np.argsort(columns["x_dn"], kind="stable")
        return cls(**{name: np.asarray(values)[order] for name, values in columns.items()})

    def scattered(self, relative: float) -> "Points":
        """Return the points with a further relative error of the variance."""
        return replace(self, relative_se=np.hypot(self.relative_se, relative))

    def part(self, keep: NDArray[np.bool_] | slice) -> "Points":
        """Return some of the points."""
        return Points(*(getattr(self, name)[keep] for name in self.__dataclass_fields__))


@dataclass(frozen=True)
class Line:
    """variance = slope * x + intercept, with covariance of (slope, intercept)."""

    slope_dn: float
    intercept_dn2: float
    covariance: tuple[tuple[float, float], tuple[float, float]]

    @property
    def slope_se_dn(self) -> float:
        """Standard error of the slope, DN."""
        return float(np.sqrt(self.covariance[0][0]))

    @property
    def intercept_se_dn2(self) -> float:
        """Standard error of the intercept, DN^2."""
        return float(np.sqrt(self.covariance[1][1]))

    def variance_dn2(self, x_dn: Floats) -> Floats:
        """Return the line at x."""
        return self.slope_dn * x_dn + self.intercept_dn2


def affine(x: Floats) -> Floats:
    """Return the design of a straight line: (points, 2)."""
    return np.stack([x, np.ones_like(x)], 1)


def cubic(x: Floats) -> Floats:
    """Return the design of a smooth bend: (points, 4)."""
    part = x / max(float(np.abs(x).max()), 1e-30)
    return np.stack([x, np.ones_like(x), part**2, part**3], 1)


def kink(at_dn: float) -> Callable[[Floats], Floats]:
    """Return the design of two lines that meet at `at_dn`, without a step: (points, 3)."""

    def basis(x: Floats) -> Floats:
        return np.stack([x, np.ones_like(x), np.maximum(x - at_dn, 0.0)], 1)

    return basis


def deviance_of(points: Points, basis: Callable[[Floats], Floats]) -> float:
    """Return the gamma deviance of the best fit: 2 (v/mu - 1 - ln(v/mu)) / relative error^2."""
    _, fitted, relative = _solve(points, basis(points.x_dn))
    ratio = np.maximum(points.variance_dn2, 1e-12) / fitted
    return float((2 * (ratio - 1 - np.log(ratio)) / relative**2).sum())


def line_through(points: Points, black_se_dn: float) -> Line:
    """Return the line through points, the black level's error included."""
    design = affine(points.x_dn)
    parameters, fitted, relative = _solve(points, design)
    weight = 1 / (fitted * relative) ** 2
    normal = (design * weight[:, None]).T @ design
    size = np.sqrt(np.diag(normal))
    inverse = np.linalg.inv(normal / np.outer(size, size)) / np.outer(size, size)
    # x moves with the black level, the fit with x.
    moved = -inverse @ (design.T @ (weight * parameters[0] * points.black_share))
    covariance = inverse + np.outer(moved, moved) * black_se_dn**2
    return Line(float(parameters[0]), float(parameters[1]), pair(covariance))


def _solve(points: Points, design: Floats) -> tuple[Floats, Floats, Floats]:
    """Return parameters, fitted variance and relative errors (x's included) by reweighting."""
    v = points.variance_dn2
    # A line that runs through zero would weigh its point without bound.
    floor = np.maximum(0.05 * v, 1e-12)
    fitted, relative = np.maximum(v, floor), points.relative_se
    size = np.maximum(np.abs(design).max(0), 1e-30)
    unit = design / size
    ridge = 1e-13 * np.eye(size.size)  # nearly collinear bends stay solvable
    for _ in range(_ITERATIONS):
        weight = 1 / (fitted * relative)
        whitened = unit * weight[:, None]
        norm = np.sqrt((whitened**2).sum(0))
        whitened /= norm
        gram = whitened.T @ whitened + ridge
        parameters = np.linalg.solve(gram, whitened.T @ (v * weight)) / norm / size
        before, fitted = fitted, np.maximum(design @ parameters, floor)
        relative = np.hypot(points.relative_se, parameters[0] * points.x_se_dn / fitted)
        if np.abs(fitted - before).max() <= _CONVERGED * fitted.max():
            break
    return parameters, fitted, relative


def pair(matrix: Floats) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return a matrix (2, 2) as plain numbers."""
    (a, b), (c, d) = matrix.tolist()
    return ((a, b), (c, d))
