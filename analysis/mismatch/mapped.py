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
from analysis.mismatch.rank import Ranked, alike
from analysis.mismatch.state import State
from dsis.effects import Effect
from dsis.effects.shading import Shading
from dsis.effects.tap_mismatch import TapMismatch

Array = NDArray[np.float64]
_SURE = 3.0  # of log-likelihood: odds of 20
_AXIS = {"left_right": 0, "top_bottom": 1}  # over which lines are averaged


def as_maps_show(state: State, fitted: Sequence[Ranked]) -> list[Ranked]:
    """Return ranked effects, the best first, where maps of the gain had their say.

    Asked where the best is uneven light or halves that differ, and the other of both explains the
    same numbers: the map's likelihood then tells how far they are apart, if it is sure.
    """
    if not fitted or not _shapes_known(fitted[0].proposal.effect):
        return list(fitted)
    best, *others = fitted
    rival = next((one for one in others if _rivals(state, best, one)), None)
    if rival is None:
        return list(fitted)
    ahead = _gain(state, best) - _gain(state, rival)
    if not abs(ahead) > _SURE:
        return list(fitted)
    others.remove(rival)
    first, second = (best, rival) if ahead > 0 else (rival, best)
    placed = [replace(first, gain=best.gain), replace(second, gain=best.gain - abs(ahead)), *others]
    return sorted(placed, key=lambda one: -one.gain)


def _rivals(state: State, best: Ranked, other: Ranked) -> bool:
    known = _shapes_known(other.proposal.effect)
    return (
        known and other.kind != best.kind and alike(state, best.polished.mean, other.polished.mean)
    )


def _shapes_known(effect: Effect) -> bool:
    return isinstance(effect, Shading) or (
        isinstance(effect, TapMismatch) and effect.regions in _AXIS
    )


def _gain(state: State, ranked: Ranked) -> float:
    """Return what an effect gains of the log-likelihood of all maps, less its free parameters."""
    clues = state.clues()
    names = [name for name in ranked.proposal.free if name in SURFACES]
    moments, square, count = 0.0, 0.0, 0
    for channel, (image, noise) in clues.image("gain").items():
        scale = 100 / clues.scale("gain", channel)
        rest = scale * (image - image.mean()) - had(clues, channel).reshape(image.shape)
        shapes = _shapes(ranked.proposal.effect, names, image.shape)
        count = len(shapes)
        weights = [
            max(_variance(rest.mean(axis)), (scale * noise) ** 2 / image.shape[axis]) ** -0.5
            for axis in (0, 1)
        ]
        own, *design = (
            np.concatenate([weights[axis] * one.mean(axis) for axis in (0, 1)])
            for one in (rest, *shapes)
        )
        columns = np.stack(design)
        moments = moments + columns @ own
        square = square + columns @ columns.T
    if not count:
        return 0.0
    found = np.linalg.lstsq(np.asarray(square), np.asarray(moments), rcond=None)[0]
    return float(moments @ found) / 2 - count


def _variance(lines: Array) -> float:
    """Return the variance of means of lines beside smooth curves and the step of halves."""
    rest, (step, _) = beyond_smooth(lines), seam_shapes(lines.size)
    return float((rest - step * (step @ rest)).var())


def _shapes(effect: Effect, names: Sequence[str], shape: tuple[int, ...]) -> Array:
    """Return what an effect does to the gain for 1 % of each number: (number, row, column)."""
    if isinstance(effect, TapMismatch):
        axis = _AXIS[effect.regions]
        line = np.arange(shape[1 - axis]) >= shape[1 - axis] / 2
        step = np.broadcast_to(line if axis == 0 else line[:, np.newaxis], shape)
        return np.asarray(step - step.mean())[np.newaxis]
    return surfaces(shape, names).reshape(len(names), *shape)
