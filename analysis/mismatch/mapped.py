"""Uneven light or amplifiers of two halves: which of them the gain's map itself shows.

The bank's numbers of both are much alike: halves that differ lean, and a lean parts the halves. Of
the map their likelihoods are known: means of lines, whose noise is what smooth curves and the step
leave of them.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.seams import beyond_smooth, seam_shapes
from analysis.mismatch.candidates.patterns import SURFACES, had, surfaces
from analysis.mismatch.clues import Clues
from analysis.mismatch.rank import LEAST_GAIN, Ranked, alike
from analysis.mismatch.state import State
from dsis.effects import Effect
from dsis.effects.shading import Shading
from dsis.effects.tap_mismatch import TapMismatch

Array = NDArray[np.float64]
_SURE = 3.0  # of log-likelihood: odds of 20
_AXIS = {"left_right": 0, "top_bottom": 1}  # over which lines are averaged
_SHARE = 0.5  # of the best's gain, below which numbers need no second opinion
_STEPPED = 0.5  # of the step of halves, that must be seen beside smooth curves
_LEAST = 1e-12  # variance, %^2


def as_maps_show(state: State, fitted: Sequence[Ranked]) -> list[Ranked]:
    """Return ranked effects, the best first, where maps of the gain had their say.

    Asked where the best is uneven light or halves that differ, and the other of both explains the
    same numbers nearly as well. What the map denies surely falls behind by as much as it says;
    halves are preferred only where half of their step is seen beside any smooth light.
    """
    if not fitted or not _shapes_known(fitted[0].proposal.effect):
        return list(fitted)
    best = fitted[0]
    rivals = [one for one in fitted[1:] if _rivals(state, best, one)]
    if all(one.kind == best.kind for one in rivals):
        return list(fitted)
    clues = state.clues()
    gains = {id(one): _gain(clues, one) for one in (best, *rivals)}
    first = max((best, *rivals), key=lambda one: gains[id(one)])
    if _step(clues, first.proposal.effect) < _STEPPED:
        return list(fitted)
    placed = []
    for one in fitted:
        behind = gains[id(first)] - gains.get(id(one), np.inf)
        if id(one) in gains and one.kind != first.kind and behind > _SURE:
            placed.append(replace(one, gain=max(min(one.gain, best.gain - behind), LEAST_GAIN)))
        elif one is first and one.kind != best.kind and gains[id(one)] > gains[id(best)] + _SURE:
            placed.append(replace(one, gain=best.gain))
        else:
            placed.append(one)
    return sorted(placed, key=lambda one: -one.gain)


def _rivals(state: State, best: Ranked, other: Ranked) -> bool:
    """Return whether an effect is one of both, and explains the same numbers nearly as well."""
    near = other.gain >= max(LEAST_GAIN, _SHARE * best.gain)
    if not near or not _shapes_known(other.proposal.effect):
        return False
    return alike(state, best.polished.mean, other.polished.mean)


def _shapes_known(effect: Effect) -> bool:
    return isinstance(effect, Shading) or (
        isinstance(effect, TapMismatch) and effect.regions in _AXIS
    )


def _gain(clues: Clues, ranked: Ranked) -> float:
    """Return what an effect gains of the log-likelihood of all maps, less its free parameters."""
    names = [name for name in ranked.proposal.free if name in SURFACES]
    found, value = _fitted(clues, ranked.proposal.effect, names)
    if "falloff_percent" in names and found[names.index("falloff_percent")] < 0:
        names.remove("falloff_percent")  # light that rises to all ends is none
        value = _fitted(clues, ranked.proposal.effect, names)[1]
    return value


def _fitted(clues: Clues, effect: Effect, names: Sequence[str]) -> tuple[Array, float]:
    """Return the coefficients that fit all maps best, %, and what they gain."""
    count = 1 if isinstance(effect, TapMismatch) else len(names)
    moments, square = np.zeros(count), np.zeros((count, count))
    for channel, (image, noise) in clues.image("gain").items():
        rest, scale = _rest(clues, channel, image)
        shapes = _shapes(clues, effect, names, channel, image.shape)
        weights = [_precision(rest, axis, scale * noise) ** 0.5 for axis in (0, 1)]
        own, *design = (
            np.concatenate([weights[axis] * one.mean(axis) for axis in (0, 1)])
            for one in (rest, *shapes)
        )
        if design:
            columns = np.stack(design)
            moments += columns @ own
            square += columns @ columns.T
    if not count:
        return moments, 0.0
    found = np.asarray(np.linalg.lstsq(square, moments, rcond=None)[0])
    return found, float(moments @ found) / 2 - count


def _step(clues: Clues, effect: Effect) -> float:
    """Return how much of the step of halves is seen beside smooth curves, a share of it."""
    if not isinstance(effect, TapMismatch):
        return 1.0
    top = bottom = 0.0
    for channel, (image, noise) in clues.image("gain").items():
        rest, scale = _rest(clues, channel, image)
        axis = _AXIS[effect.regions]
        lines = rest.mean(axis)
        weight = _precision(rest, axis, scale * noise)
        own = beyond_smooth(_halves(clues, effect, channel, image.shape).mean(axis))
        top += weight * float(own @ lines)
        bottom += weight * float(own @ own)
    expected = float(_fitted(clues, effect, ())[0][0]) * bottom
    return top / expected if expected else 0.0


def _rest(clues: Clues, channel: str, image: Array) -> tuple[Array, float]:
    """Return the gain beyond the camera's own, %, and what the map is scaled by to that."""
    scale = 100 / clues.scale("gain", channel)
    return scale * (image - image.mean()) - had(clues, channel).reshape(image.shape), scale


def _precision(image: Array, axis: int, noise: float) -> float:
    """Return one over the variance of means of lines beside smooth curves and the step of halves.

    It is at most that of white noise of a pixel.
    """
    lines = image.mean(axis)
    rest, (step, _) = beyond_smooth(lines), seam_shapes(lines.size)
    scatter = float((rest - step * (step @ rest)).var())
    return float(1 / max(scatter, noise**2 / image.shape[axis], _LEAST))


def _shapes(
    clues: Clues, effect: Effect, names: Sequence[str], channel: str, shape: tuple[int, ...]
) -> Array:
    """Return what an effect does to the gain for 1 % of each number: (number, row, column)."""
    if isinstance(effect, TapMismatch):
        return _halves(clues, effect, channel, shape)[np.newaxis]
    if not names:
        return np.zeros((0, *shape))
    return surfaces(shape, names).reshape(len(names), *shape)


def _halves(clues: Clues, effect: TapMismatch, channel: str, shape: tuple[int, ...]) -> Array:
    """Return the second part of the sensor beside the first, as a channel's pixels see it."""
    axis = 1 - _AXIS[effect.regions]
    size = (clues.layout.rows, clues.layout.columns)[axis]
    step = 1 if len(clues.layout.sites) == 1 else 2
    lines = clues.layout.sites[channel][axis] + step * np.arange(shape[axis])
    second = lines >= effect.seam * size
    whole = np.broadcast_to(second if axis == 1 else second[:, np.newaxis], shape)
    return np.asarray(whole - whole.mean())
