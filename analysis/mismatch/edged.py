"""Surfaces and lines that a decay from an edge feigns: the read-out has not settled there."""

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.edges import decays
from analysis.mismatch.contradicted import Denial
from analysis.mismatch.state import State

Array = NDArray[np.float64]
STATISTIC = "fixed_edge"
# Where each kind is seen; of two maps of a gain the one that knows of no other.
_MAPS = {"shading": ("gain",), "tap_mismatch": ("gain",), "amp_glow": ("time", "gain")}
_MOST = 0.5  # of what the surfaces explain, that decays may feign


def decaying(state: State) -> bool:
    """Return whether a decay from an edge is left unexplained."""
    return any(m.statistic == STATISTIC for m in state.mismatches)


def edged(state: State, kind: str) -> Denial | None:
    """Return how uneven light, halves or a glow are denied by a decay from an edge; None: not.

    The few bright lines of an edge lean and bend the whole map, and part its halves. Where a decay
    is left unexplained, and tilts, bows and halves beside decays explain not half of what they
    explain alone, there may be none.
    """
    if kind not in _MAPS or not decaying(state):
        return None
    alone, beside = 0.0, 0.0
    images = state.setting.seen.images
    for (channel, name), (image, noise) in images.items():
        if name not in {one if (channel, f"{one} alone") not in images else f"{one} alone"
                        for one in _MAPS[kind]}:  # fmt: skip
            continue
        for axis in (0, 1):
            means = image.mean(1 - axis) / noise * image.shape[1 - axis] ** 0.5
            smooth, edge = _designs(means.size)
            level = np.ones((means.size, 1))
            alone += _left(means, level) - _left(means, np.hstack([level, smooth]))
            edge = np.hstack([level, edge])
            beside += _left(means, edge) - _left(means, np.hstack([edge, smooth]))
    if alone <= 0 or beside >= _MOST * alone:
        return None
    return Denial(beside / alone, "lines that decay from an edge make most of what it explains")


def _designs(size: int) -> tuple[Array, Array]:
    """Return tilt, bow and halves, and decays from both ends: (line, shape) each."""
    line = np.linspace(-1, 1, size)
    smooth = np.stack([line, line**2, np.where(line < 0, -1.0, 1.0)], 1)
    return smooth, np.asarray(decays(size).T)


def _left(values: Array, design: Array) -> float:
    """Return the square sum of what a design leaves of values."""
    rest = values - design @ np.linalg.lstsq(design, values, rcond=None)[0]
    return float(rest @ rest)
