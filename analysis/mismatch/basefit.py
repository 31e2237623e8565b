"""The base model's numbers from levels and variances: black level, light, slope and intercept.

Fast enough to be repeated for every simulated recording, so that what the fit itself takes out of
the residuals is in their null. What rounding, clipping and the camera's own effects add to level
and variance is handed in as `Offsets`, found by simulation.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.robust import drawn_in_mean
from analysis.mismatch.layout import Layout, Place
from analysis.mismatch.observe import Level
from dsis.measures.median import median

Array = NDArray[np.float64]
CLIPPED_SHARE = 1e-3
_ROUNDS = 8
_PLAIN = 2.0  # growth of an error below which rounding hides nothing
_MOST_ERROR = 0.5  # of a variance before rounding
_UNTOLD = 1e3  # growth of a level's error at most: rounding has hidden it
_CUT, _UNMOVED = 0.2, 0.05  # share of samples; standard deviations that half of it moves a mean by
_HUBER = 4.0  # standard deviations from which a level counts less


@dataclass(frozen=True)
class Offsets:
    """What the simulated camera adds to level (DN) and pixel variance (DN^2), by place.

    `stretch` is by how much an error of the recorded variance grows on the way back, `wider` by how
    much that of a level. Where spikes dominate the variances, `bulk_dn2` is what is added to the
    variance of the many, and that is fitted: the base numbers are theirs.
    """

    level_dn: Mapping[Place, float] = field(default_factory=dict)
    variance_dn2: Mapping[Place, float] = field(default_factory=dict)
    stretch: Mapping[Place, float] = field(default_factory=dict)
    bulk_dn2: Mapping[Place, float] = field(default_factory=dict)
    wider: Mapping[Place, float] = field(default_factory=dict)

    def fitted(self, levels: Mapping[Place, Level]) -> tuple[Mapping[Place, Level], "Offsets"]:
        """Return levels and offsets that the base numbers are fitted to."""
        if not self.bulk_dn2:
            return levels, self
        own = {
            place: replace(level, variance_dn2=level.bulk_dn2, dof=level.bulk_dof)
            for place, level in levels.items()
        }
        return own, replace(self, variance_dn2=self.bulk_dn2)


@dataclass(frozen=True)
class Piece:
    """One read-out segment: slope (DN), intercept (DN^2), their errors, from which signal on."""

    from_dn: float
    slope: float
    intercept: float
    slope_error: float
    intercept_error: float


@dataclass(frozen=True)
class BaseFit:
    """The base model's numbers, and what they leave.

    Attributes
    ----------
    black_dn, black_error_dn
        By channel, above the nominal black; the error is nan where no dark says.
    light_dn
        Signal per unit of light, by channel (both greens alike); empty where light is unknown.
    pieces
        Read-out segments.
    signal_dn
        By place: level above black.
    expected_dn2
        Variance expected at each place, offsets included.
    """

    black_dn: Mapping[str, float]
    black_error_dn: Mapping[str, float]
    light_dn: Mapping[str, float]
    pieces: tuple[Piece, ...]
    signal_dn: Mapping[Place, float]
    expected_dn2: Mapping[Place, float]

    def line_dn2(self, signal_dn: Array) -> Array:
        """Return the variance of the base model at a signal, rounding not included."""
        table = np.array([[p.slope, p.intercept] for p in self.pieces])
        starts = np.array([p.from_dn for p in self.pieces[1:]])
        slope, intercept = table[np.searchsorted(starts, signal_dn, side="right")].T
        return np.asarray(slope * np.maximum(signal_dn, 0.0) + intercept)


def fit_base(
    layout: Layout,
    levels: Mapping[Place, Level],
    switches: Sequence[float],
    offsets: Offsets,
    *,
    black_dn: float,
    left_out: frozenset[str] = frozenset(),
    slopes: Sequence[float] = (),
    intercept: float | None = None,
    cut: frozenset[str] = frozenset(),
) -> BaseFit:
    """Return the numbers of the base model.

    Parameters
    ----------
    layout, levels
        What was observed.
    switches
        Where read-out segments change, DN above black, ascending.
    offsets
        Taken off levels and variances before the fit.
    black_dn
        Above the nominal black, where no dark says.
    left_out
        Exposures that are not fitted.
    slopes
        Of each segment, for segments whose levels cannot tell it.
    intercept
        Of the first segment, where it is not fitted.
    cut
        Darks that are fitted though the lowest code cuts some of their noise off.
    """
    added_in_all = offsets.variance_dn2
    levels, offsets = offsets.fitted(levels)
    black, black_error = _black(layout, levels, offsets, black_dn)
    signal = _signals(layout, levels, offsets, black)
    light = _light(layout, levels, signal, left_out)
    used = [
        place
        for place, own in levels.items()
        if place[0] not in left_out and not _hidden(own, offsets, place)
        if _sound(own) or (place[0] in cut and _some_cut(own))
    ]
    x = np.array([signal[place] for place in used])
    v = np.array(
        [levels[place].variance_dn2 - offsets.variance_dn2.get(place, 1 / 12) for place in used]
    )
    relative = np.array(
        [sqrt(2 / levels[place].dof) * offsets.stretch.get(place, 1.0) for place in used]
    )
    added = np.array([offsets.variance_dn2.get(place, 1 / 12) for place in used])
    starts = [-np.inf, *switches]
    ends = [*switches, np.inf]
    pieces = []
    for number, (low, high) in enumerate(zip(starts, ends, strict=True)):
        inside = (x >= low) & (x < high)
        known = slopes[number] if number < len(slopes) else None
        own = x[inside], v[inside], relative[inside], added[inside]
        pieces.append(_piece(low, *own, known, None if number else intercept))
    fit = BaseFit(black, black_error, light, tuple(pieces), signal, {})
    line = fit.line_dn2(np.array([signal[place] for place in levels]))
    expected = {
        place: float(value) + added_in_all.get(place, 1 / 12)
        for place, value in zip(levels, line, strict=True)
    }
    return BaseFit(black, black_error, light, tuple(pieces), signal, expected)


def _some_cut(level: Level) -> bool:
    """Return whether the lowest code cuts off few samples, of what is known: see `unrounded`."""
    clipped = level.clipped_low > _CUT or level.clipped_high > CLIPPED_SHARE
    return not clipped and level.variance_dn2 > 0


def _hidden(level: Level, offsets: Offsets, place: Place) -> bool:
    """Return whether rounding has all but hidden a variance: it is known to half of itself."""
    stretch = offsets.stretch.get(place, 1.0)
    if stretch < _PLAIN:
        return False
    before = level.variance_dn2 - offsets.variance_dn2.get(place, 0.0)
    return stretch * sqrt(2 / level.dof) * level.variance_dn2 > _MOST_ERROR * before


def _sound(level: Level) -> bool:
    shares = (level.clipped_low, level.clipped_high)
    clipped = any(share > CLIPPED_SHARE for share in shares)  # none of those that are unknown
    return not clipped and level.variance_dn2 > 0


def cut_off(level: Level, offsets: Offsets, place: Place) -> bool:
    """Return whether noise is cut off where the model's is not: its mean says nothing of black."""
    if not level.clipped_low > _CUT:
        return False
    return offsets.level_dn.get(place, 0.0) < _UNMOVED * sqrt(max(level.variance_dn2, 0.0))


def _black(
    layout: Layout, levels: Mapping[Place, Level], offsets: Offsets, nominal: float
) -> tuple[dict[str, float], dict[str, float]]:
    black, error = {}, {}
    for channel in layout.channels:
        places = [
            place
            for e in layout.exposures
            if e.kind == "dark" and not cut_off(levels[place := (e.name, channel)], offsets, place)
        ]
        if not places:
            black[channel], error[channel] = nominal, np.nan
            continue
        errors = [
            max(levels[p].level_error_dn, 1e-9) * min(offsets.wider.get(p, 1.0), _UNTOLD)
            for p in places
        ]
        weight = np.array([1 / error**2 for error in errors])
        value = np.array([levels[p].level_dn - offsets.level_dn.get(p, 0.0) for p in places])
        black[channel] = float((weight * value).sum() / weight.sum())
        error[channel] = float(1 / sqrt(weight.sum()))
    return black, error


def _signals(
    layout: Layout, levels: Mapping[Place, Level], offsets: Offsets, black: Mapping[str, float]
) -> dict[Place, float]:
    """Return level above black; where darks have several times, above the dark of that time."""
    signal: dict[Place, float] = {}
    uniform = layout.uniform
    for channel in layout.channels:
        darks: dict[float, list[float]] = {}
        for e in uniform:
            if e.kind == "dark":
                place = (e.name, channel)
                if cut_off(levels[place], offsets, place):
                    continue
                own = levels[place].level_dn - offsets.level_dn.get(place, 0.0)
                darks.setdefault(e.exposure_time_s, []).append(own)
        times = sorted(darks)
        means = [sum(darks[t]) / len(darks[t]) for t in times]
        grounds = [black[channel]] * len(uniform)
        if len(times) > 1:
            grounds = np.interp([e.exposure_time_s for e in uniform], times, means).tolist()
        for e, ground in zip(uniform, grounds, strict=True):
            place = (e.name, channel)
            if e.kind == "dark":
                signal[place] = 0.0
                continue
            signal[place] = levels[place].level_dn - offsets.level_dn.get(place, 0.0) - ground
    return signal


def colour(channel: str) -> str:
    """Return the colour of a channel: both greens are one."""
    return "G" if channel in ("Gr", "Gb") else channel


def _light(
    layout: Layout,
    levels: Mapping[Place, Level],
    signal: Mapping[Place, float],
    left_out: frozenset[str],
) -> dict[str, float]:
    """Return DN per unit of light by colour: the weighted median of the ratios of the flats."""
    ratios: dict[str, list[tuple[float, float]]] = {}
    for e in layout.uniform:
        if e.kind != "flat" or e.light is None or e.light <= 0 or e.name in left_out:
            continue
        for channel in layout.channels:
            level = levels[e.name, channel]
            x = signal[e.name, channel]
            if not _sound(level) or x <= 0:
                continue
            error = sqrt(level.level_error_dn**2 + (2e-4 * x) ** 2) / e.light
            ratios.setdefault(colour(channel), []).append((x / e.light, 1 / error**2))
    light = {}
    for name, pairs in ratios.items():
        if len(pairs) < 2:
            continue
        light[name] = drawn_in_mean(np.array(pairs), _HUBER, _ROUNDS)
    return light


def _line(design: Array, w: Array, v: Array) -> tuple[Array, Array]:
    """Return slope and intercept by weighted least squares, and their covariance."""
    normal = (design * w[:, None]).T @ design
    size = np.sqrt(np.diag(normal))
    sizes = size * size[:, np.newaxis]
    inverse = np.linalg.pinv(normal / sizes) / sizes
    return inverse @ (design.T @ (w * v)), inverse


def _through(held: float, x: Array, w: Array, v: Array) -> tuple[Array, Array]:
    """Return the same of a line whose intercept is held, and not known."""
    square = float((w * x * x).sum())
    slope = float((w * x * (v - held)).sum()) / square
    return np.array([slope, held]), np.array([[1 / square, 0.0], [0.0, np.inf]])


def _piece(
    low: float,
    x: Array,
    v: Array,
    relative: Array,
    added: Array,
    slope: float | None,
    held: float | None,
) -> Piece:
    """Return the line through the variances of one segment, by reweighting.

    `slope` where these do not tell it. An intercept that is `held` is not fitted to a slope.
    """
    if x.size == 0:
        return Piece(low, slope or 0.0, held or 0.0, np.inf, np.inf)
    rounded = np.round(x / max(np.abs(x).max(), 1e-12), 3)
    free = bool((rounded != rounded[0]).any())
    if not free and slope is None:
        slope = 0.0
    # Weights need a variance: start from the observed, go on with the fitted.
    total = np.maximum(v + added, 1e-9)
    design = np.stack([x, np.ones_like(x)], 1)
    parameters = np.zeros(2)
    inverse = np.zeros((2, 2))
    for _ in range(_ROUNDS):
        sd = relative * total
        w = 1 / sd**2
        if free:
            rest = (v - parameters[0] * x - parameters[1]) / sd if parameters.any() else 0 * v
            spread = max(1.0, median(np.abs(rest)) * 1.4826)
            w = w * np.minimum(1, _HUBER * spread / np.maximum(np.abs(rest), 1e-12))
            parameters, inverse = _line(design, w, v) if held is None else _through(held, x, w, v)
        else:
            rest_v = v - (slope or 0.0) * x
            parameters = np.array([slope or 0.0, float((w * rest_v).sum() / w.sum())])
            inverse = np.array([[np.inf, 0.0], [0.0, 1 / w.sum()]])
        total = np.maximum(
            parameters[0] * x + parameters[1] + added, 0.05 * np.maximum(v + added, 1e-9)
        )
    return Piece(
        low,
        float(parameters[0]),
        float(parameters[1]),
        sqrt(inverse[0, 0]),
        sqrt(inverse[1, 1]),
    )
