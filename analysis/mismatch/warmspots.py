"""A glow that few warm pixels feign: trails and clusters that lie near one edge."""

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.candidates.patterns import glowing
from analysis.mismatch.contradicted import Denial
from analysis.mismatch.leftopen import warm_left
from analysis.mismatch.state import State
from dsis.effects import Effect
from dsis.effects.amp_glow import AmpGlow

Array = NDArray[np.float64]
_FAR_OUT = 2.0  # standard deviations from the glow, beyond which a pixel counts as so far out
_ROUNDS = 50
_MOST = 0.5  # of a glow, that few pixels may make


def warm_spots(state: State, effect: Effect) -> Denial | None:
    """Return how a glow is denied by few pixels that grow with exposure time; None: it is not.

    Where such pixels are left unexplained, those of one corner lean the whole map. A glow is in the
    many pixels of its corner: where a fit that pixels far out do not bend (Huber, 1964) finds half
    of it, or less, there may be none.
    """
    if not isinstance(effect, AmpGlow) or not warm_left(state):
        return None
    plain = robust = 0.0
    for (_, name), (image, noise) in state.setting.seen.images.items():
        if name != "time":
            continue
        own = np.stack([np.ones(image.shape), glowing(image.shape, effect.place, effect.extent)])
        of_all, of_many = _heights(image / noise, own)
        plain += of_all / noise
        robust += of_many / noise
    if plain <= 0 or robust >= _MOST * plain:
        return None
    return Denial(max(robust / plain, 0.0), "few pixels that grow with time make most of it")


def _heights(image: Array, shapes: Array) -> tuple[float, float]:
    """Return the height of the second of two shapes, by least squares and by Huber's fit.

    `image` is in units of its noise: (row, column), the shapes (2, row, column).
    """
    one, two, seen = shapes[0].reshape(-1), shapes[1].reshape(-1), image.reshape(-1)
    weights = np.ones(seen.size)
    heights: list[float] = []
    for _ in range(_ROUNDS):  # reweighted: however far out a pixel is, it pulls as one that is not
        a, b, c = weights @ one**2, weights @ (one * two), weights @ two**2
        u, v = (weights * one) @ seen, (weights * two) @ seen
        level, height = (c * u - b * v) / (a * c - b * b), (a * v - b * u) / (a * c - b * b)
        heights.append(float(height))
        far = np.abs(seen - level * one - height * two)
        weights = _FAR_OUT / np.maximum(far, _FAR_OUT)
    return heights[0], heights[-1]
