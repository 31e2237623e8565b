"""Frames of single pixels about their mean, and which pixels say most of those that jump."""

from collections.abc import Iterator, Sequence
from math import sqrt

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from analysis.mismatch.layout import Layout
from analysis.mismatch.pixellaw import MOST_FRAMES
from analysis.mismatch.projections import FramesOf

Array = NDArray[np.float64]
_LEAST_FRAMES = 3  # of which a median pixel tells the noise
_COARSE = 1.0  # step between codes, in standard deviations, from which on codes jump by themselves
_MOST_LINES = 160
_NOISY = 2.5  # standard deviations: all such pixels are looked at
_RARE = 0.02  # and those noisier in one block than this share of pixels is by chance in any


def blocks_of(layout: Layout, frames_of: FramesOf) -> Iterator[tuple[Array, Array, float]]:
    """Yield frames of each exposure, a few at a time: (pixel, frame), their noise, DN^2, and time.

    Less what rows and columns of a frame have in common. Noise is that of the median pixel.
    """
    window = tuple(_middle(size) for size in (layout.rows, layout.columns))
    for exposure in layout.uniform:
        if any((exposure.name, channel) in layout.still for channel in layout.channels):
            continue
        frames = [np.asarray(own[window], np.float64) for own in frames_of(exposure.name)]
        stack = np.stack(frames)
        parts = -(-len(stack) // MOST_FRAMES)
        for some in np.array_split(stack, parts):
            block = _noise(layout, some) if len(some) >= _LEAST_FRAMES else None
            if block is not None:
                yield *block, exposure.exposure_time_s


def _middle(size: int) -> slice:
    """Return the lines in the middle of a sensor: so many pixels tell as much as is asked."""
    first = max(size - _MOST_LINES, 0) // 4 * 2  # cells of a mosaic stay whole
    return slice(first, first + _MOST_LINES)


def _noise(layout: Layout, stack: Array) -> tuple[Array, Array] | None:
    """Return a stack about its mean (pixel, frame), and the noise of each pixel; None: coarse."""
    rest = stack - stack.mean(0)
    noise = np.empty(rest.shape[1:])
    step = 1 + (len(layout.sites) > 1)
    dof = len(stack) - 1
    for y, x in layout.sites.values():
        plane = rest[:, y::step, x::step]
        plane -= plane.mean(2, keepdims=True)
        plane -= plane.mean(1, keepdims=True)
        square = float(np.median((plane**2).sum(0))) / chi2.median(dof)
        codes = np.unique(stack[:, y::step, x::step])
        step_dn = float(np.median(np.diff(codes))) if codes.size > 1 else np.inf
        if not (square > 0 and square >= (_COARSE * step_dn) ** 2):
            return None
        noise[y::step, x::step] = square
    return rest.reshape(len(rest), -1).T, noise.reshape(-1)


def chosen(
    blocks: Sequence[tuple[Array, Array, float]], least: float, count: int
) -> tuple[NDArray[np.intp], Array]:
    """Return the noisy pixels and `count` of the others, about, and for how many each stands.

    Noisy in all exposures together, or rarely so in one: there a jump would count as often as the
    pixel stands for others. The others are taken evenly along how noisy they are. `blocks` are
    those of `blocks_of`, `least` the least of their noises, DN^2.
    """
    score, norm = np.zeros(len(blocks[0][0])), 0.0
    noisy = np.zeros(len(score), bool)
    for x, noise, _ in blocks:
        dof, trust = x.shape[1] - 1, least / noise
        square = (x**2).sum(1) / noise
        score += trust * (square - dof)
        norm += 2 * dof * float((trust**2).mean())
        noisy |= square > chi2.isf(_RARE / len(blocks), dof)
    noisy |= score > _NOISY * sqrt(norm)
    others = np.flatnonzero(~noisy)
    others = others[np.argsort(score[others], kind="stable")]  # each stands for its like
    every = max(others.size // count, 1)
    some = others[every // 2 :: every]
    which = np.concatenate([np.flatnonzero(noisy), some])
    weight = np.ones(which.size)
    weight[which.size - some.size :] = others.size / max(some.size, 1)
    return which, weight
