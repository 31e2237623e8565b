"""A field of gains or a few patches: which of them the maps of gains show, by their likelihoods.

Dust throws shadows: few, round, and nothing between. A normal field has its power everywhere. Both
are smooth, so that what neighbours have in common does not tell them apart; their likelihoods do.
"""

from collections.abc import Iterator
from functools import lru_cache
from math import log

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from analysis.mismatch.candidates.patterns import had
from analysis.mismatch.contradicted import Denial, rival
from analysis.mismatch.fewpatches import spectrum, white_of
from analysis.mismatch.rank import TOLD_APART
from analysis.mismatch.state import State
from dsis.effects import Effect
from dsis.effects.smooth_prnu import SmoothPrnu
from dsis.measures.fixed_pattern import Smooth

Array = NDArray[np.float64]
_RADII = (1.0, 1.5, 2.2, 3.2, 4.7, 7.0, 10.0)  # pixels of a plane
_SOFT = 0.2  # of a radius, over which a patch ends
_MOST = 40  # patches: more are few no longer
_LEAST = 1.0  # nats for how deep a patch is
_SCALES = 2.0 ** np.arange(-1, 1.25, 0.25)  # of the field's size and length, as they may be as well
_OF_TWO = 2.0  # nats for both
_LIGHT = 2  # degree of what light may do besides
_MOST_LINES = 256  # of the shorter side: a larger plane is asked in means over squares


def as_patches(state: State, effect: Effect) -> Denial | None:
    """Return how a field of gains is denied by few patches that are as likely; None: it is not.

    Where there are such patches rather than nothing, and the field is not likelier, at odds of 20;
    see `of_patches` and `of_field`.
    """
    if not isinstance(effect, SmoothPrnu):
        return None
    found = _plane(state)
    if found is None:
        return None
    image, step = found
    gained = of_patches(image)
    if gained <= TOLD_APART:
        return None
    behind = gained - of_field(image, effect.length_pixels / step)
    return rival(behind, "few patches, as dust throws them, are as likely")


def of_field(image: Array, length: float) -> float:
    """Return what a normal field gains over white noise, nats: Whittle's likelihood (1953).

    Of any size, and of the likeliest length near the one given, pixels.
    """
    white = white_of(image)
    power = np.abs(fft.rfft2(image)) ** 2 / image.size / white
    counts = np.full(power.shape, 2.0)
    counts[:, 0] = counts[:, -1] = 1.0
    counts[0, 0] = 0.0
    size = max(float(image.var()) / white - 1, 1e-3)
    best = 0.0
    for one in length * _SCALES:
        shape = size * spectrum(image.shape, float(one))
        for scale in _SCALES**2:
            whole = 1 + scale * shape
            gained = float((counts * (power * (1 - 1 / whole) - np.log(whole))).sum()) / 2
            best = max(best, gained - _OF_TWO)
    return best


def of_patches(image: Array) -> float:
    """Return what round patches gain over white noise, nats: see `patches_of`."""
    return sum((gained for gained, _ in patches_of(image)), 0.0)


def patches_of(image: Array) -> Iterator[tuple[float, Array]]:
    """Yield what each round patch gains over white noise, nats, and the patch: (row, column).

    The best one after the other. Each pays for where it lies, of all places that patches of its
    size have, and for its depth.
    """
    white, rest = white_of(image), image - image.mean()
    shapes, waves = _patches(image.shape)
    prices = [log(2 * len(_RADII) * max(image.size / r**2, 1.0)) + _LEAST for r in _RADII]
    for _ in range(_MOST):
        seen = fft.rfft2(rest)
        along = [fft.irfft2(seen * one, image.shape) for one in waves]
        tops = [float((one**2).max()) / (2 * white) for one in along]
        best = int(np.argmax(np.subtract(tops, prices)))
        if tops[best] <= prices[best]:
            return
        y, x = np.unravel_index(int((along[best] ** 2).argmax()), image.shape)
        patch = along[best][y, x] * np.roll(shapes[best], (y, x), (0, 1))
        yield tops[best] - prices[best], patch
        rest = rest - patch


def in_squares(image: Array) -> tuple[Array, int]:
    """Return an image in means over squares, if it is large, and their side in pixels."""
    side = max(min(image.shape) // _MOST_LINES, 1)
    rows, columns = image.shape[0] // side, image.shape[1] // side
    squares = image[: rows * side, : columns * side].reshape(rows, side, columns, side)
    return squares.mean((1, 3)), side


def _plane(state: State) -> tuple[Array, int] | None:
    """Return the map of gains that all channels share, %, and how many pixels one of it spans.

    Channels count by the inverse variance of their noise; what the camera's own effects do, and
    what light makes lean or bow, is taken off.
    """
    clues = state.clues()
    images = clues.image("gain")
    if set(images) != set(clues.layout.sites):
        return None
    rows, columns = np.min([image.shape for image, _ in images.values()], 0)
    total, weights = np.zeros((rows, columns)), 0.0
    for channel, (image, noise) in images.items():
        scale = 100 / clues.scale("gain", channel)
        weight = 1 / (noise * scale) ** 2
        beyond = scale * image - had(clues, channel).reshape(image.shape)
        total += weight * beyond[:rows, :columns]
        weights += weight
    plane, side = in_squares(total / weights)
    smooth = Smooth.of(*plane.shape)
    found = smooth.coefficients(plane)
    order = np.arange(len(found))[:, np.newaxis] + np.arange(len(found))
    step = 1 if len(images) == 1 else 2
    return plane - smooth.surface(np.where(order <= _LIGHT, found, 0.0)), step * side


@lru_cache(maxsize=1)  # maps of one recording are all asked
def _patches(shape: tuple[int, ...]) -> tuple[list[Array], list[NDArray[np.complex128]]]:
    """Return a round patch of each radius about the first pixel, and what lifts it out of noise."""
    shapes = [_patch(shape, radius) for radius in _RADII]
    return shapes, [np.conj(fft.rfft2(one)) for one in shapes]


def _patch(shape: tuple[int, ...], radius: float) -> Array:
    """Return a round patch about the first pixel, on a torus, of mean 0 and norm 1."""
    y, x = (np.minimum(np.arange(size), size - np.arange(size)) for size in shape)
    apart = np.hypot(y[:, np.newaxis], x)
    made = 1 / (1 + np.exp(np.clip((apart - radius) / (_SOFT * radius), -30, 30)))
    made -= made.mean()
    return np.asarray(made / np.linalg.norm(made))
