"""Variance of raw noise against signal: how many straight pieces, and where they meet.

Where the levels scatter more than their errors allow, a further relative error common to all levels
(Mandel & Paule's) makes up for it, so that no single level of many frames rules the fit.
A further segment must pass two tests: the deviance that the best of all gaps gains must be too
large for chance, chance being allowed every gap (Bonferroni's bound on the scanned switch), and the
step must explain the points better than a smooth bend (a cubic, a kink) does, by Schwarz's
penalty: a bent response is no read-out path. The switch is known as an interval between levels:
all gaps whose deviance is within `GAP_DEVIANCE` of the best.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy import optimize, stats

from analysis.photon_transfer.lines import (
    Floats,
    Line,
    Points,
    affine,
    cubic,
    deviance_of,
    kink,
    line_through,
    pair,
)

MAX_SEGMENTS = 4
P_INVENTED = 0.006  # chance of one more segment where there is none
P_SCALED = 0.01  # scatter rarer than this is real and widens the errors
GAP_DEVIANCE = 7.4  # exp(-7.4 / 2) = 2.5 %: a gap so much worse is left out of the interval
_GAP_ERRORS = 5.0  # levels closer than this many errors of the mean are one level


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
        Misfit beside the points' own errors, and what chance gives.
    scatter
        Further relative error of the variance that explains a misfit too large for chance, else 0;
        the lines' errors include it.
    p_segments
        For each number of segments tried beyond the first: how likely chance gains as much.
    bends
        Whether one line does not do, but a smooth bend explains the points as well as a switch.
    forced
        Whether the user fixed the number of segments.
    """

    lines: tuple[Line, ...]
    switches: tuple[Switch, ...]
    deviance: float
    dof: int
    scatter: float
    p_segments: tuple[float, ...]
    bends: bool
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
    bends = False
    if segments is not None:
        search, cuts = _settled(points, segments)
    else:
        search, _ = _settled(points, 1)
        for number in range(2, min(MAX_SEGMENTS, most) + 1):
            larger, found = _settled(points, number)
            chances.append(larger.chance(cuts, found))
            bends = number == 2 and chances[-1] <= P_INVENTED and larger.bends(found)
            if chances[-1] > P_INVENTED or bends:
                break
            search, cuts = larger, found
    plain = _result(search, cuts, black_se_dn)
    return replace(
        plain,
        deviance=_Search(points).total(cuts),
        p_segments=tuple(chances),
        bends=bends,
        forced=segments is not None,
    )


def _settled(points: Points, number: int) -> tuple["_Search", tuple[int, ...]]:
    """Return the best `number` pieces with the scatter that they leave unexplained."""
    search = _Search(points)
    _, cuts = search.best(number)
    dof = points.x_dn.size - 2 * number
    if dof < 1 or stats.chi2.sf(search.total(cuts), dof) > P_SCALED:
        return search, cuts
    for _ in range(2):  # the scatter moves the cuts a little, the cuts the scatter
        search = _Search(points, _scatter(points, cuts, dof))
        cuts = search.best(number)[1]
    return search, cuts


def _scatter(points: Points, cuts: tuple[int, ...], dof: int) -> float:
    """Return the further relative error that brings the deviance of the pieces down to `dof`."""

    def excess(relative: float) -> float:
        return _Search(points, relative).total(cuts) - dof

    high = 0.01
    while excess(high) > 0 and high < 1e3:
        high *= 3
    return float(optimize.brentq(excess, 0.0, high, rtol=1e-3)) if excess(high) < 0 else high


class _Search:
    """Pieces over runs of levels, each fitted once."""

    def __init__(self, points: Points, scatter: float = 0.0) -> None:
        self.scatter = scatter
        self.points = points.scattered(scatter) if scatter else points
        # The first point of each distinct level; no switch is sought inside a level.
        apart = np.diff(points.x_dn) > _GAP_ERRORS * np.hypot(
            points.x_se_dn[1:], points.x_se_dn[:-1]
        )
        self.starts = np.concatenate([[0], 1 + np.flatnonzero(apart)])
        self.cost: Callable[[int, int], float] = cache(self._cost)

    def bend(self) -> float:
        """Return the least deviance of a smooth bend: a cubic, or a kink without a step."""
        x = self.points.x_dn
        if x.size < 5:
            return np.nan
        bends = [cubic, *(kink(float(x[start])) for start in self.starts[1:-1])]
        return min(deviance_of(self.points, bend) for bend in bends)

    def range(self, first: int, last: int) -> slice:
        """Return the points of levels first..last-1."""
        ends = [*self.starts, self.points.x_dn.size]
        return slice(int(ends[first]), int(ends[last]))

    def _cost(self, first: int, last: int) -> float:
        return deviance_of(self.points.part(self.range(first, last)), affine)

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

    def chance(self, cuts: tuple[int, ...], more: tuple[int, ...]) -> float:
        """Return how likely chance gains what `more` gains on `cuts`, one piece fewer."""
        number = len(more) + 1
        deviance = self.total(more)
        gain = self.total(cuts) - deviance
        gaps = max(len(self.starts) - 2 * number + 1, 1)
        dof = self.points.x_dn.size - 2 * number
        single = stats.f.sf(gain / 2, 2, dof) if self.scatter else stats.chi2.sf(gain, 2)
        return min(1.0, float(gaps * single))

    def bends(self, cuts: tuple[int, ...]) -> bool:
        """Return whether a smooth bend explains the points as well as pieces that begin at `cuts`.

        A step has one parameter more than a bend: Schwarz's penalty for it.
        """
        return self.bend() - self.total(cuts) < float(np.log(self.points.x_dn.size))

    def interval(self, cuts: tuple[int, ...], which: int) -> tuple[Switch, Floats]:
        """Return the gaps that may hold a switch, and the weight of each level as its place."""
        bounds = (0, *cuts, len(self.starts))
        options = range(bounds[which] + 2, bounds[which + 2] - 1)
        misfits = np.array(
            [self.total((*cuts[:which], cut, *cuts[which + 1 :])) for cut in options]
        )
        above = misfits - misfits.min()
        kept = [cut for cut, more in zip(options, above, strict=True) if more < GAP_DEVIANCE]
        x = self.points.x_dn
        low, high = int(self.starts[min(kept)]) - 1, int(self.starts[max(kept)])
        weights = np.zeros(len(self.starts))
        weights[list(options)] = np.exp(-above / 2) / np.exp(-above / 2).sum()
        return Switch(float(x[low]), float(x[high])), weights


def _result(search: _Search, cuts: tuple[int, ...], black_se_dn: float) -> SegmentFit:
    """Return the pieces with their errors; what the choice was made by is added by the caller."""
    points, bounds = search.points, (0, *cuts, len(search.starts))
    dof = points.x_dn.size - 2 * (len(cuts) + 1)
    found = [search.interval(cuts, which) for which in range(len(cuts))]
    lines = []
    for piece, (first, last) in enumerate(pairwise(bounds)):
        line = line_through(points.part(search.range(first, last)), black_se_dn)
        for at, end in ((piece - 1, 0), (piece, 1)):
            if 0 <= at < len(cuts):
                line = _averaged(search, line, (first, last), found[at][1], end)
        lines.append(line)
    return SegmentFit(
        lines=tuple(lines),
        switches=tuple(switch for switch, _ in found),
        deviance=search.total(cuts),
        dof=dof,
        scatter=search.scatter,
        p_segments=(),
        bends=False,
        forced=False,
    )


def lines_between(
    points: Points, switches: tuple[Switch, ...]
) -> tuple[tuple[Line | None, ...], float, int]:
    """Return the pieces between given switches, their deviance and number of parameters.

    A piece with fewer than two distinct levels is None and adds no deviance.
    """
    ends = [-np.inf, *(switch.middle_dn for switch in switches), np.inf]
    lines: list[Line | None] = []
    deviance, parameters = 0.0, 0
    for low, high in pairwise(ends):
        part = points.part((points.x_dn >= low) & (points.x_dn < high))
        if part.x_dn.size < 2 or len(_Search(part).starts) < 2:
            lines.append(None)
            continue
        lines.append(line_through(part, 0.0))
        deviance += deviance_of(part, affine)
        parameters += 2
    return tuple(lines), deviance, parameters


def _averaged(
    search: _Search,
    line: Line,
    bounds: tuple[int, int],
    weights: Floats,
    end: int,
) -> Line:
    """Widen a line's errors by what other plausible places of its end would make of it."""
    spread = np.zeros((2, 2))
    for cut in np.flatnonzero(weights > 1e-3):
        first, last = (int(cut), bounds[1]) if end == 0 else (bounds[0], int(cut))
        if last - first < 2 or (first, last) == bounds:
            continue
        other = line_through(search.points.part(search.range(first, last)), 0.0)
        step = np.array([other.slope_dn - line.slope_dn, other.intercept_dn2 - line.intercept_dn2])
        spread += weights[cut] * (
            np.outer(step, step) + np.array(other.covariance) - np.array(line.covariance)
        )
    covariance = np.array(line.covariance) + spread
    for i in (0, 1):  # an error never shrinks for want of knowing the end
        covariance[i, i] = max(covariance[i, i], line.covariance[i][i])
    return Line(line.slope_dn, line.intercept_dn2, pair(covariance))
