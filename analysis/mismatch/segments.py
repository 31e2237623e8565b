"""A second read-out path that the camera model does not have: dual gain."""

from collections.abc import Container, Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from math import inf, isclose, log, nan, sqrt

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.basefit import BaseFit, fit_base
from analysis.mismatch.layout import Layout, Place
from analysis.mismatch.rank import TOLD_APART
from analysis.mismatch.recalibrate import Calibrated, with_numbers
from analysis.mismatch.scenes import SCENE
from analysis.mismatch.state import State
from analysis.mismatch.straight import polynomial
from analysis.mismatch.vector import expected_dn2, tells_segment
from dsis.camera import Camera
from dsis.effects.saturation import Saturation

Array = NDArray[np.float64]
_NU = 6.0
_SHAPES = frozenset({"skewness", "kurtosis", "kurtosis_within_pixels"})
_OFF, _CLEAR = 4.0, 10.0  # standard errors of a variance that departs, and of a shape
_AROUND, _PLACES = 3.0, 25  # standard deviations; switches between two levels
_SPIKY = 10.0  # standard errors from which tails bend the variances
_TAILS = frozenset({"kurtosis", "kurtosis_within_pixels", "one_off_outliers"})
_ROUNDS = 4  # of weights of a fit
_PENALTY = 4.0  # two numbers, and the choice among the gaps
_ALIKE, _LEAST_DN = 1.02, 1.0  # times a signal; both greens of a mosaic have one


@dataclass(frozen=True)
class Path:
    """A second segment: the camera with it, its switch and error, what it gains and predicts.

    `gap` are the signals between which the switch lies.
    """

    camera: Camera
    switch_dn: float
    error_dn: float
    gain: float
    mean: Array
    kind: str = "dual_gain"
    gap: tuple[float, float] = (0.0, 0.0)

    @property
    def name(self) -> str:
        """Its kind."""
        return self.kind


def second_path(state: State, beside: Array | None = None) -> Path | None:
    """Return the second segment that explains the variances best; None where levels are too few.

    Its switch lies anywhere in a gap between levels, and in other gaps as likely as those explain
    the variances: its error is the root mean square distance. None as well where noise that grows
    with the signal - a square beside a line, which has no gap - explains them better, at odds of
    20. `beside` are the numbers predicted with an effect that is there as well; None: none is.
    """
    mean = state.null.mean if beside is None else beside
    calibrated, layout = state.calibrated, state.setting.layout
    if len(calibrated.switches) > 0:
        return None
    misshapen, unfitted = _misshapen(state), calibrated.left_out | {name for name, _ in _cut(state)}
    # The exposure that is left out of fits tells where in a gap the switch lies.
    seen = [e.name for e in layout.uniform if e.name not in unfitted - {state.setting.interpolated}]
    signals = calibrated.fit.signal_dn
    levels = _apart(signals[name, channel] for name in seen for channel in layout.channels)
    paths = [
        path
        for low, high in pairwise(levels[1:-1])
        if not _elsewhere(state, misshapen, (low, high))
        and (path := _path(state, low, high, mean)) is not None
    ]
    if not paths:
        return None
    best = max(paths, key=lambda path: path.gain)
    if _squared(state, mean) > best.gain + TOLD_APART:
        return None
    chances = np.exp([path.gain - best.gain for path in paths])
    squares = [path.error_dn**2 + (path.switch_dn - best.switch_dn) ** 2 for path in paths]
    return replace(best, error_dn=sqrt(float(np.average(squares, weights=chances))))


def _apart(signals: Iterable[float]) -> list[float]:
    """Return signals, ascending, of those that are alike the least: colours differ."""
    found: list[float] = []
    for own in sorted(round(float(signal), 3) for signal in signals):
        if not found or own > max(found[-1], _LEAST_DN) * _ALIKE:
            found.append(own)
    return found


def explained(state: State, mean: Array) -> float:
    """Return the log-likelihood of the variances of exposures under predicted numbers."""
    own = _variances(state)
    return _loglik((state.vector.values[own] - mean[own]) / state.null.sd[own])


def _variances(state: State) -> list[int]:
    """Return which numbers are known variances of exposures that no limit of the camera cuts."""
    cut = _cut(state)
    return [
        i
        for i, key in enumerate(state.vector.keys)
        if key.statistic == "pixel_variance" and key.scope == "exposure" and state.null.known[i]
        if key.place not in cut
    ]


def _cut(state: State) -> frozenset[Place]:
    """Return where a full well of the camera cuts noise: shape and size tell the well there."""
    wells = [own.full_well_dn for own in state.camera.effect if isinstance(own, Saturation)]
    signals, levels = state.calibrated.fit.signal_dn, state.setting.seen.levels
    least = min(wells, default=inf)
    return frozenset(
        at
        for at, own in levels.items()
        if signals.get(at, 0.0) + _AROUND * sqrt(max(own.variance_dn2, 0.0)) > least
    )


def spiky(state: State, path: Path | None = None) -> bool:
    """Return whether the tails of the noise depart so far that its variances say nothing yet.

    Not where a second `path` makes them: pixels select theirs by their own signal, and about the
    switch some are of one and some of the other.
    """
    if not any(abs(m.z) > _SPIKY and m.statistic in _TAILS for m in state.mismatches):
        return False
    tails = _departing(state, _TAILS)
    return path is None or _elsewhere(state, [at for at, z in tails.items() if z > _OFF], path.gap)


def _departing(state: State, statistics: Container[str]) -> dict[Place, float]:
    """Return by how many standard errors an exposure's numbers depart, at most, by place."""
    found: dict[Place, float] = {}
    cut = _cut(state)
    for key, z in zip(state.null.keys, np.abs(state.departures), strict=True):
        if key.scope == "exposure" and key.statistic in statistics and key.place not in cut:
            found[key.place] = max(found.get(key.place, 0.0), float(z))
    return found


def _misshapen(state: State) -> list[Place]:
    """Return where noise has another shape while its variance departs, and more clearly so.

    A second path scales noise. What bends or clips the distribution bends its variance, too.
    """
    shape = _departing(state, _SHAPES)
    variance = _departing(state, frozenset({"pixel_variance"}))
    return [at for at, z in variance.items() if z > _OFF and shape.get(at, 0.0) > max(_CLEAR, z)]


def _elsewhere(state: State, places: Sequence[Place], gap: tuple[float, float]) -> bool:
    """Return whether some places are not about any switch in a gap between two signals."""
    signals, levels = state.calibrated.fit.signal_dn, state.setting.seen.levels
    of_both = [
        (signals.get(at, 0.0), _AROUND * sqrt(max(levels[at].variance_dn2, 0.0)))
        for at in places
        if at in levels
    ]
    if len(of_both) < len(places):
        return True
    return not any(
        all(abs(signal - switch) <= reach for signal, reach in of_both)
        for switch in np.linspace(*gap, _PLACES)
    )


def _path(state: State, low: float, high: float, beside: Array) -> Path | None:
    """Return the second segment that begins between two levels; None: no camera has it.

    What an effect leaves of variances is known but for a line, which two segments contain.
    """
    setting, calibrated = state.setting, state.calibrated
    layout, seen = setting.layout, setting.seen
    which = [i for i in _variances(state) if np.isfinite(beside[i])]
    added = beside - state.null.mean
    levels = dict(seen.levels)
    for i in which if added.any() else ():
        own = levels[state.vector.keys[i].place]
        without = own.variance_dn2 * float(np.exp(-added[i]))
        levels[state.vector.keys[i].place] = replace(own, variance_dn2=without)
    switch = sqrt(max(low, high / 50) * high)
    try:
        fit = fit_base(
            layout, levels, (switch,), calibrated.offsets,
            black_dn=calibrated.model.camera.black_level - layout.black_dn,
            left_out=calibrated.left_out | {name for name, _ in _cut(state)},
        )  # fmt: skip
    except (ValueError, np.linalg.LinAlgError):
        return None
    places = [state.vector.keys[i].place for i in which]
    expected = np.array([fit.expected_dn2[place] for place in places])
    if any(p.slope < 0 for p in fit.pieces) or (expected <= 0).any():
        return None
    left = np.log(np.array([levels[place].variance_dn2 for place in places]) / expected)
    before = _loglik((state.vector.values[which] - beside[which]) / state.null.sd[which])
    gain = _loglik(left / state.null.sd[which]) - before - _PENALTY
    camera = with_numbers(state.camera, fit, (switch,), layout.black_dn)
    # Anywhere between the levels: about the place that is taken, their geometric middle.
    error = _anywhere(low, high, switch)
    mean = beside.copy()
    mean[which] = state.null.mean[which] + state.vector.values[which] - left
    for i, key in enumerate(state.vector.keys):
        if key.statistic == "pixel_variance" and key.scope == SCENE and state.null.known[i]:
            mean[i] += _grown(layout, key.place, calibrated.residual, fit)
    return Path(camera, switch, error, gain, mean, gap=(low, high))


def as_settled(calibrated: Calibrated, switch_dn: float, error_dn: float) -> tuple[float, float]:
    """Return the switch of a second segment and its error as the final model has them.

    Levels of single colours may tell another gap than the means of exposures did: it lies anywhere
    between the two that are next to it, and is known no better than before.
    """
    switches, signals = calibrated.switches, calibrated.fit.signal_dn.values()
    if len(switches) != 1 or isclose(switches[0], switch_dn):
        return switch_dn, error_dn
    (own,) = switches
    low = max((s for s in signals if s <= own), default=0.0)
    high = min((s for s in signals if s > own), default=own)
    return own, max(_anywhere(low, high, own), error_dn)


def _anywhere(low: float, high: float, place: float) -> float:
    """Return the root mean square distance from a place to all that lies between two signals."""
    return sqrt((high - low) ** 2 / 12 + ((low + high) / 2 - place) ** 2)


def _squared(state: State, beside: Array) -> float:
    """Return what a term that goes with the square of the signal gains, less its number, nats."""
    fit, seen = state.calibrated.fit, state.setting.seen
    which = [i for i in _variances(state) if np.isfinite(beside[i])]
    places = [state.vector.keys[i].place for i in which]
    if any(place not in fit.signal_dn for place in places):
        return -inf
    sd, added = state.null.sd[which], np.exp(beside[which] - state.null.mean[which])
    variance = np.array([seen.levels[place].variance_dn2 for place in places]) / added
    signal = np.array([fit.signal_dn[place] for place in places])
    expected = variance
    for _ in range(_ROUNDS):
        _, expected = polynomial(signal, variance, 1 / (sd * expected), 2)
        if (expected <= 0).any():
            return -inf
    before = _loglik((state.vector.values[which] - beside[which]) / sd)
    return _loglik(np.log(variance / expected) / sd) - before - 1.0


def _grown(layout: Layout, place: Place, before: BaseFit, after: BaseFit) -> float:
    """Return the logarithm by which a scene's variance grows at a place; nan: nobody knows."""
    if not tells_segment(layout.range_dn(place), after):
        return nan
    variances = [expected_dn2(layout, place, fit) for fit in (before, after)]
    return log(variances[1] / variances[0]) if min(variances) > 0 else nan


def _loglik(z: np.ndarray) -> float:
    return float(-((_NU + 1) / 2 * np.log1p(z**2 / _NU)).sum())


def bent(base: State, final: State) -> Array:
    """Return what a second read-out path changes: the residuals of the variances."""
    own = np.array([key.statistic == "pixel_variance" for key in base.vector.keys])
    return np.where(own, base.vector.values - final.vector.values, 0.0)
