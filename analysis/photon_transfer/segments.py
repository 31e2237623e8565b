"""Variance of raw noise against signal: straight pieces, how many, and where they meet.

The points are gamma distributed about slope * x + intercept with known relative errors, so they are
fitted by iterated weighted least squares with the model's own variance and compared by deviance.
A further segment must pass two tests: the deviance that the best of all gaps gains must be too
large for chance, chance being allowed every gap (Bonferroni's bound on the scanned switch), and the
step must explain the points better than a smooth bend (a parabola) does: a bent response is no
read-out path. The switch is known as an interval between levels: all gaps whose deviance is within
`GAP_DEVIANCE` of the best. Errors in x enter the weights with the slope; they are small:
m^2 Var(mean) / Var(variance) = m^2 (T - 1) / (2 T v) for white noise.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy import stats

Floats = NDArray[np.float64]

MAX_SEGMENTS = 4
P_INVENTED = 0.003  # chance of one more segment where there is none
P_SCALED = 0.01  # scatter rarer than this is real: errors are scaled by it
GAP_DEVIANCE = 7.4  # exp(-7.4 / 2) = 2.5 %: a gap so much worse is left out of the interval
BEND_PENALTY = 2.0  # deviance that a step may lose to a bend per parameter it has more
_GAP_ERRORS = 5.0  # levels closer than this many errors of the mean are one level
_ITERATIONS = 12


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
        return cls(**{name: np.asarray(values)[order] for name, values in columns.items()})  # type: ignore[arg-type] # one type per column

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


@dataclass(frozen=True)
class Switch:
    """Where the next read-out path takes over: between two levels, DN above black."""

    low_dn: float
    high_dn: float

    @property
    def middle_dn(self) -> float:
        """Middle of the interval."""
        return (self.low_dn + self.high_dn) / 2


@dataclass(frozen=True)
class SegmentFit:
    """Straight pieces through the points.

    Attributes
    ----------
    lines, switches
        Ascending; one switch fewer than lines.
    deviance, dof
        Misfit and what chance gives; the errors carry `error_scale` = sqrt(deviance / dof) where
        the misfit is too large for chance, else 1.
    p_segments
        For each number of segments tried beyond the first: how likely chance gains as much.
    bend_deviance
        Misfit of a parabola through all points; nan with fewer than four points.
    forced
        Whether the user fixed the number of segments.
    """

    lines: tuple[Line, ...]
    switches: tuple[Switch, ...]
    deviance: float
    dof: int
    error_scale: float
    p_segments: tuple[float, ...]
    bend_deviance: float
    forced: bool

    def segment_of(self, x_dn: Floats) -> NDArray[np.intp]:
        """Return the number of the segment of each x."""
        return np.searchsorted([s.middle_dn for s in self.switches], x_dn, side="right")

    def variance_dn2(self, x_dn: Floats) -> Floats:
        """Return the fitted variance at x."""
        x = np.asarray(x_dn, float)
        table = np.array([[line.slope_dn, line.intercept_dn2] for line in self.lines])
        slope, intercept = table[self.segment_of(x)].T
        return np.asarray(slope * x + intercept)


def fit_segments(points: Points, segments: int | None, black_se_dn: float = 0.0) -> SegmentFit:
    """Return the pieces that the points need, or as many as `segments` says.

    Raises `ValueError` where the levels are too few: each piece needs two.
    """
    search = _Search(points)
    most = len(search.starts) // 2
    if most < 1 or (segments or 1) > most:
        message = f"{len(search.starts)} distinct levels, {2 * (segments or 1)} needed: "
        raise ValueError(message + f"{segments or 1} segment(s) need two levels each")
    chances: list[float] = []
    cuts: tuple[int, ...] = ()
    if segments is not None:
        cuts = search.best(segments)[1]
    else:
        for number in range(2, min(MAX_SEGMENTS, most) + 1):
            chance, found = search.one_more(cuts, number)
            chances.append(chance)
            if chance > P_INVENTED:
                break
            cuts = found
    return _result(search, cuts, tuple(chances), black_se_dn, forced=segments is not None)


class _Search:
    """Pieces over runs of levels, each fitted once."""

    def __init__(self, points: Points) -> None:
        self.points = points
        # The first point of each distinct level; no switch is sought inside a level.
        apart = np.diff(points.x_dn) > _GAP_ERRORS * np.hypot(
            points.x_se_dn[1:], points.x_se_dn[:-1]
        )
        self.starts = np.concatenate([[0], 1 + np.flatnonzero(apart)])
        self.bend = _deviance(points, _bend) if points.x_dn.size > 3 else np.nan
        self.cost: Callable[[int, int], float] = cache(self._cost)

    def range(self, first: int, last: int) -> slice:
        """Return the points of levels first..last-1."""
        ends = [*self.starts, self.points.x_dn.size]
        return slice(int(ends[first]), int(ends[last]))

    def _cost(self, first: int, last: int) -> float:
        return _deviance(self.points.part(self.range(first, last)), _affine)

    def total(self, cuts: tuple[int, ...]) -> float:
        """Return the deviance of pieces that begin at the levels `cuts`."""
        return sum(self.cost(a, b) for a, b in pairwise((0, *cuts, len(self.starts))))

    def best(self, number: int) -> tuple[float, tuple[int, ...]]:
        """Return the least deviance of `number` pieces and where they begin."""

        @cache
        def up_to(last: int, pieces: int) -> tuple[float, tuple[int, ...]]:
            if pieces == 1:
                return self.cost(0, last), ()
            options = []
            for cut in range(2 * (pieces - 1), last - 1):
                before, cuts = up_to(cut, pieces - 1)
                options.append((before + self.cost(cut, last), (*cuts, cut)))
            return min(options)

        return up_to(len(self.starts), number)

    def one_more(self, cuts: tuple[int, ...], number: int) -> tuple[float, tuple[int, ...]]:
        """Return how likely chance gains what the best `number` pieces gain, and where they begin.

        1 where a smooth bend explains the points as well.
        """
        deviance, found = self.best(number)
        dof = self.points.x_dn.size - 2 * number
        scale = _scale(deviance, dof) ** 2
        gain = (self.total(cuts) - deviance) / scale
        # The bend has one parameter more than a line; a step two and its place.
        if number == 2 and self.bend - deviance < BEND_PENALTY * 2 * scale:
            return 1.0, found
        gaps = max(len(self.starts) - 2 * number + 1, 1)
        single = stats.chi2.sf(gain, 2) if scale == 1 else stats.f.sf(gain / 2, 2, dof)
        return min(1.0, float(gaps * single)), found

    def interval(self, cuts: tuple[int, ...], which: int, scale: float) -> tuple[Switch, Floats]:
        """Return the gaps that may hold a switch, and the weight of each level as its place."""
        bounds = (0, *cuts, len(self.starts))
        options = range(bounds[which] + 2, bounds[which + 2] - 1)
        misfits = np.array(
            [self.total((*cuts[:which], cut, *cuts[which + 1 :])) for cut in options]
        )
        above = (misfits - misfits.min()) / scale**2
        kept = [cut for cut, more in zip(options, above, strict=True) if more < GAP_DEVIANCE]
        x = self.points.x_dn
        low, high = int(self.starts[min(kept)]) - 1, int(self.starts[max(kept)])
        weights = np.zeros(len(self.starts))
        weights[list(options)] = np.exp(-above / 2) / np.exp(-above / 2).sum()
        return Switch(float(x[low]), float(x[high])), weights


def _result(
    search: _Search,
    cuts: tuple[int, ...],
    chances: tuple[float, ...],
    black_se_dn: float,
    *,
    forced: bool,
) -> SegmentFit:
    points, bounds = search.points, (0, *cuts, len(search.starts))
    deviance = search.total(cuts)
    dof = points.x_dn.size - 2 * (len(cuts) + 1)
    scale = _scale(deviance, dof)
    switches, weights = [], []
    for which in range(len(cuts)):
        switch, weight = search.interval(cuts, which, scale)
        switches.append(switch)
        weights.append(weight)
    lines = []
    for piece, (first, last) in enumerate(pairwise(bounds)):
        line = _line(points.part(search.range(first, last)), scale, black_se_dn)
        for at, other in ((piece - 1, 0), (piece, 1)):
            if 0 <= at < len(cuts):
                line = _averaged(search, line, (first, last), weights[at], other, scale)
        lines.append(line)
    return SegmentFit(
        tuple(lines), tuple(switches), deviance, dof, scale, chances, search.bend, forced
    )


def _averaged(
    search: _Search,
    line: Line,
    bounds: tuple[int, int],
    weights: Floats,
    end: int,
    scale: float,
) -> Line:
    """Widen a line's errors by what other plausible places of its end would make of it."""
    spread = np.zeros((2, 2))
    for cut in np.flatnonzero(weights > 1e-3):
        first, last = (int(cut), bounds[1]) if end == 0 else (bounds[0], int(cut))
        if last - first < 2 or (first, last) == bounds:
            continue
        other = _line(search.points.part(search.range(first, last)), scale, 0.0)
        step = np.array(
            [other.slope_dn - line.slope_dn, other.intercept_dn2 - line.intercept_dn2]
        )
        spread += weights[cut] * (
            np.outer(step, step) + np.array(other.covariance) - np.array(line.covariance)
        )
    covariance = np.array(line.covariance) + spread
    for i in (0, 1):  # an error never shrinks for want of knowing the end
        covariance[i, i] = max(covariance[i, i], line.covariance[i][i])
    return Line(line.slope_dn, line.intercept_dn2, _pair(covariance))


def _scale(deviance: float, dof: int) -> float:
    """Return sqrt(deviance / dof) where it is too large for chance, else 1."""
    if dof < 1 or stats.chi2.sf(deviance, dof) > P_SCALED:
        return 1.0
    return float(np.sqrt(deviance / dof))


def _affine(x: Floats) -> Floats:
    return np.stack([x, np.ones_like(x)], 1)


def _bend(x: Floats) -> Floats:
    return np.stack([x, np.ones_like(x), (x / max(float(np.abs(x).max()), 1e-30)) ** 2], 1)


def _solve(points: Points, design: Floats) -> tuple[Floats, Floats, Floats]:
    """Return parameters, fitted variance and relative errors (x's included) by reweighting."""
    v = points.variance_dn2
    floor = 1e-3 * float(np.abs(v).max()) + 1e-12
    fitted = np.maximum(v, floor)
    relative = points.relative_se
    parameters = np.zeros(design.shape[1])
    for _ in range(_ITERATIONS):
        weight = 1 / (fitted * relative)
        scale = np.linalg.norm(design * weight[:, None], axis=0)
        solution, *_ = np.linalg.lstsq(design * weight[:, None] / scale, v * weight, rcond=None)
        before, parameters = parameters, solution / scale
        fitted = np.maximum(design @ parameters, np.minimum(np.maximum(v, floor), floor))
        relative = np.hypot(points.relative_se, parameters[0] * points.x_se_dn / fitted)
        if np.allclose(before, parameters, rtol=1e-10, atol=0):
            break
    return parameters, fitted, relative


def _deviance(points: Points, basis: Callable[[Floats], Floats]) -> float:
    """Return the gamma deviance of the best fit: 2 (v/mu - 1 - ln(v/mu)) / relative error^2."""
    _, fitted, relative = _solve(points, basis(points.x_dn))
    ratio = np.maximum(points.variance_dn2, 1e-12) / fitted
    return float((2 * (ratio - 1 - np.log(ratio)) / relative**2).sum())


def _line(points: Points, scale: float, black_se_dn: float) -> Line:
    """Return the line through points, its errors scaled, the black level's error included."""
    design = _affine(points.x_dn)
    parameters, fitted, relative = _solve(points, design)
    weight = 1 / (fitted * relative) ** 2
    normal = (design * weight[:, None]).T @ design
    size = np.sqrt(np.diag(normal))
    inverse = np.linalg.inv(normal / np.outer(size, size)) / np.outer(size, size)
    # x moves with the black level, the fit with x.
    moved = -inverse @ (design.T @ (weight * parameters[0] * points.black_share))
    covariance = inverse * scale**2 + np.outer(moved, moved) * black_se_dn**2
    return Line(float(parameters[0]), float(parameters[1]), _pair(covariance))


def _pair(matrix: Floats) -> tuple[tuple[float, float], tuple[float, float]]:
    (a, b), (c, d) = matrix.tolist()
    return ((a, b), (c, d))
