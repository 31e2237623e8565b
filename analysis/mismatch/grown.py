"""Offsets of pixels, lines or frames that grow with exposure time, as no offset does."""

from math import exp

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from analysis.mismatch.bank.key import MOSAIC
from analysis.mismatch.contradicted import Denial
from analysis.mismatch.rank import TOLD_APART
from analysis.mismatch.state import State

Array = NDArray[np.float64]
_OFFSETS = {
    "dsnu": "fixed_pixel_variance",
    "row_fpn": "fixed_row_variance",
    "column_fpn": "fixed_column_variance",
    "black_level_drift": "frame_variance",
}
LEAST_NUMBER = 0.5  # of a cube root of a variance: below, its error is another's


def grown(state: State, kind: str, without: Array) -> Denial | None:
    """Return how offsets are denied by exposure times; None: they are not.

    Offsets are the same at all times. Where what pixels, lines or frames differ by in single
    exposures goes with the square of the times instead, at odds of 20, and offsets beside that gain
    nothing at such odds, something that needs time makes them differ: trails of pixels that
    overflow, say, or a sensor that warms up. No channel by itself decides it. What moves a frame
    moves all of its channels: of a mosaic one number an exposure says so.

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
    growing = alike * np.square([times[key.exposure] for _, key in asked])
    channels = [key.channel for _, key in asked]
    some = [np.array([own != one for own in channels]) for one in dict.fromkeys(channels)]
    chosen = [np.ones(len(asked), bool), *(some if len(some) > 1 else ())]
    odds = [_odds(seen[own], alike[own], growing[own]) for own in chosen]
    if not all(behind > TOLD_APART >= beside for behind, beside in odds):
        return None
    behind = odds[0][0]
    why = "it grows with exposure time, as no offset does"
    return Denial(1 / (1 + exp(min(behind, 700.0))), why)


def _odds(seen: Array, alike: Array, growing: Array) -> tuple[float, float]:
    """Return by how much what grows explains more, and what does not beside it, nats."""
    both = _left(seen, growing)
    return (_left(seen, alike) - both) / 2, (both - _left(seen, growing, alike)) / 2


def _left(seen: Array, *shapes: Array) -> float:
    """Return the square sum that shapes of the best sizes, none below 0, leave."""
    largest = [max(float(np.abs(shape).max()), 1e-300) for shape in shapes]
    design = np.stack([shape / size for shape, size in zip(shapes, largest, strict=True)], 1)
    return float(nnls(design, seen)[1]) ** 2
