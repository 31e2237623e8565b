"""Offsets of pixels, lines or frames that grow with exposure time, as no offset does."""

from collections.abc import Mapping, Sequence
from functools import partial
from math import exp

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from analysis.mismatch.bank.key import MOSAIC
from analysis.mismatch.contradicted import Denial
from analysis.mismatch.framewalk import FrameMeans, growing, means_of, shown
from analysis.mismatch.layout import Place
from analysis.mismatch.rank import TOLD_APART
from analysis.mismatch.state import State
from dsis.effects import Effect
from dsis.effects.black_level_drift import BlackLevelDrift

Array = NDArray[np.float64]
_OFFSETS = {
    "dsnu": "fixed_pixel_variance",
    "row_fpn": "fixed_row_variance",
    "column_fpn": "fixed_column_variance",
    "black_level_drift": "frame_variance",
}
_TIMES = 2  # that something grows with
LEAST_NUMBER = 0.5  # of a cube root of a variance: below, its error is another's


def grown(state: State, kind: str, without: Array) -> Denial | None:
    """Return how offsets are denied by exposure times; None: they are not.

    Offsets are the same at all times. Where what pixels, lines or frames differ by in single
    exposures goes with the square of the times instead, at odds of 20, and offsets beside that gain
    nothing at such odds, something that needs time makes them differ: trails of pixels that
    overflow, say, or a sensor that warms up. No channel by itself decides it. What moves a frame
    moves all of its channels: of a mosaic one number an exposure says so, and where the means of
    frames are known these do, by their own likelihood: few of them scatter by no normal law.

    Parameters
    ----------
    state
        With the effect.
    kind
        The effect.
    without
        The numbers predicted without it.
    """
    if kind not in _OFFSETS:
        return None
    times = {e.name: e.exposure_time_s for e in state.setting.layout.exposures}
    asked = [(i, key) for i, key in enumerate(state.vector.keys)
             if key.statistic == _OFFSETS[kind] and key.exposure in times and not key.detail
             and state.null.known[i] and np.isfinite(without[i])]  # fmt: skip
    walks = _walks(state) if kind == "black_level_drift" else {}
    of_time = np.array([times[name] for name in walks])
    if len(set(of_time.tolist())) >= _TIMES:
        return _denial([growing(list(walks.values()), of_time)])
    common = kind == "black_level_drift" and any(key.scope == MOSAIC for _, key in asked)
    asked = [(i, key) for i, key in asked if key.scope == (MOSAIC if common else "exposure")]
    if not asked:
        return None
    places = [i for i, _ in asked]
    # Numbers are cube roots of variances relative to noise.
    mean, before = state.null.mean[places], without[places]
    error = 3 * np.maximum(mean, LEAST_NUMBER) ** 2 * state.null.sd[places]
    seen = (state.vector.values[places] ** 3 - before**3) / error
    alike = (mean**3 - before**3) / error
    rising = alike * np.square([times[key.exposure] for _, key in asked])
    channels = [key.channel for _, key in asked]
    some = [np.array([own != one for own in channels]) for one in dict.fromkeys(channels)]
    chosen = [np.ones(len(asked), bool), *(some if len(some) > 1 else ())]
    return _denial([_odds(seen[own], alike[own], rising[own]) for own in chosen])


def _denial(odds: Sequence[tuple[float, float]]) -> Denial | None:
    if not all(behind > TOLD_APART >= beside for behind, beside in odds):
        return None
    why = "it grows with exposure time, as no offset does"
    return Denial(1 / (1 + exp(min(odds[0][0], 700.0))), why)


def _walks(state: State) -> dict[str, FrameMeans]:
    """Return the means of the frames of exposures whose pixels see the same, by name."""
    signal = partial(_of_mosaic, state, state.calibrated.fit.signal_dn)
    seen, layout = state.setting.seen, state.setting.layout
    return means_of(seen.lines, layout.uniform, state.camera.effect, signal)


def _of_mosaic(state: State, of: Mapping[Place, float], exposure: str) -> float:
    return float(np.mean([of.get((exposure, c), 0.0) for c in state.setting.layout.channels]))


def warmed(state: State, effect: Effect) -> Denial | None:
    """Return how a wander of whole frames is denied by darks that grow with time; None: it is not.

    An offset that stays for long moves the levels of exposures, and so does a dark current. Where
    frames within exposures do not show that they wander, and levels of darks, beyond the camera's
    own, rise with exposure time as well as by chance, at odds of 20, there may be no wander.
    """
    layout = state.setting.layout
    darks = {e.name: e.exposure_time_s for e in layout.uniform if e.kind == "dark"}
    if not isinstance(effect, BlackLevelDrift) or len(set(darks.values())) < _TIMES:
        return None
    over = partial(_of_mosaic, state, state.calibrated.offsets.level_dn)
    means = _walks(state)
    own = {name: means[name] for name in darks if name in means}
    times = np.array([darks[name] for name in own])
    if len(set(times.tolist())) < _TIMES or shown(list(means.values())) >= TOLD_APART:
        return None
    levels = np.array([float(one.means.mean()) - over(n) for n, one in own.items()])
    square = np.array([one.new_dn2 / one.means.size for one in own.values()])
    plain, rising = (_likely(levels, square, shape) for shape in (None, times))
    wandering = max(_likely(levels, square + size**2, None) for size in _offsets(levels))
    if rising - plain < TOLD_APART or wandering > rising + TOLD_APART:
        return None
    why = "the levels of darks may as well grow with exposure time, and no frames wander within one"
    return Denial(0.0, why)


def _offsets(levels: Array) -> Array:
    """Return standard deviations of offsets that are tried, DN."""
    return np.asarray(np.ptp(levels) * np.geomspace(0.05, 2.0, 40))


def _likely(levels: Array, square: Array, shape: Array | None) -> float:
    """Return the log-likelihood of levels of some variances about their mean, or what rises."""
    weights = 1 / square
    seen = (levels - np.average(levels, weights=weights)) * np.sqrt(weights)
    rest = seen
    if shape is not None:
        rise = (shape - np.average(shape, weights=weights)) * np.sqrt(weights)
        rest = seen - max(float(rise @ seen), 0.0) / float(rise @ rise) * rise
    return -float(rest @ rest + np.log(square).sum()) / 2


def _odds(seen: Array, alike: Array, growing: Array) -> tuple[float, float]:
    """Return by how much what grows explains more, and what does not beside it, nats."""
    both = _left(seen, growing)
    return (_left(seen, alike) - both) / 2, (both - _left(seen, growing, alike)) / 2


def _left(seen: Array, *shapes: Array) -> float:
    """Return the square sum that shapes of the best sizes, none below 0, leave."""
    largest = [max(float(np.abs(shape).max()), 1e-300) for shape in shapes]
    design = np.stack([shape / size for shape, size in zip(shapes, largest, strict=True)], 1)
    return float(nnls(design, seen)[1]) ** 2
