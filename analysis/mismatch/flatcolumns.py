"""Columns that vary alike at all frequencies: no 1/f noise of a sensor read column by column."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy import fft
from scipy.linalg import matmul_toeplitz

from analysis.mismatch.bank.linemeans import PARTS, LineMeans
from analysis.mismatch.contradicted import Denial, rival
from analysis.mismatch.rowlaw import pink_lines
from analysis.mismatch.rowpower import Size
from analysis.mismatch.state import State
from dsis.effects import Effect
from dsis.effects.pink_noise import PinkNoise

Array = NDArray[np.float64]
_SIZES = np.geomspace(0.1, 10, 41)  # of 1/f noise, beside what is named
_STEPS = 40


@dataclass(frozen=True)
class _Powers:
    """Power of an exposure's columns about their mean frame: of slow waves, and of all others.

    Attributes
    ----------
    seen
        Mean square of a degree of freedom: (wave and rest,), DN^2.
    shape
        Half of the degrees of freedom: (wave and rest,).
    """

    seen: Array
    shape: Array

    def likelihood(self, expected: Array) -> float:
        """Return the log-likelihood but for a constant."""
        return -float(self.shape @ (np.log(expected) + self.seen / expected))


def flat_columns(state: State, effect: Effect) -> Denial | None:
    """Return how 1/f noise along columns is denied by columns that vary alike; None: it is not.

    Its means of columns fall with frequency, beside what does not: the noise of pixels, and columns
    that move each by itself. Denied is what gains less than odds of 20 by falling: of slow waves
    across the columns, and all others together, by Whittle's likelihood (1953).
    """
    if not isinstance(effect, PinkNoise) or effect.along != "columns":
        return None
    seen, layout = state.setting.seen, state.setting.layout
    lines = [seen.lines.get((exposure.name, "column")) for exposure in layout.uniform]
    powers = [one for own in lines if own is not None and (one := _powers(own)) is not None]
    if not powers:
        return None
    falling = effect.sigma_dn**2 * _falling(Size(layout.columns, layout.rows))
    flat = sum(one.likelihood(np.full_like(one.seen, _level(one))) for one in powers)
    best = max(_both(powers, size * falling) for size in _SIZES)
    return rival(flat - best, "columns vary alike at all frequencies, as no 1/f noise does")


def _powers(own: LineMeans) -> _Powers | None:
    """Return the powers of an exposure; None: it has too few frames or columns."""
    free, columns = own.frames - 1, own.moving.size
    if free < 1 or columns < 2 * PARTS or own.parts.shape[1] != PARTS:
        return None
    moved = own.parts - own.parts.mean(0)
    waves = (fft.dct(moved, axis=1, norm="ortho")[:, 1:] ** 2).sum(0) * (columns / PARTS)
    rest = columns - PARTS
    others = float(own.moving.sum()) * free - float(waves.sum())
    seen = np.append(waves / free, others / (free * rest))
    return _Powers(seen, free / 2 * np.append(np.ones(PARTS - 1), rest)) if others > 0 else None


@lru_cache(maxsize=4)
def _falling(size: Size) -> Array:
    """Return what noise of unit variance makes of the same powers: (wave and rest,)."""
    lines = pink_lines(size)
    ends = np.arange(PARTS + 1) * size.rows // PARTS
    means = np.zeros((size.rows, PARTS))
    for i, (first, last) in enumerate(pairwise(ends)):
        means[first:last, i] = 1 / (last - first)
    basis = means @ fft.dct(np.eye(PARTS), axis=0, norm="ortho")[1:].T
    waves = (basis * matmul_toeplitz(lines, basis)).sum(0) * (size.rows / PARTS)
    common = float(matmul_toeplitz(lines, np.ones(size.rows)).mean())
    others = size.rows * lines[0] - common - waves.sum()
    return np.append(waves, others / (size.rows - PARTS))


def _level(own: _Powers) -> float:
    """Return the likeliest level of powers that are alike."""
    return float(own.shape @ own.seen / own.shape.sum())


def _both(powers: Sequence[_Powers], falling: Array) -> float:
    """Return the log-likelihood of noise that falls, beside what does not: each its likeliest."""
    total = 0.0
    for own in powers:
        level = max(_level(own) - float(own.shape @ falling / own.shape.sum()), 1e-3 * _level(own))
        for _ in range(_STEPS):  # Fisher scoring
            expected = level + falling
            weight = own.shape / expected**2
            step = float(weight @ (own.seen - expected)) / float(weight.sum())
            new = max(level + step, level / 2)
            if abs(new - level) < 1e-9 * level:
                break
            level = new
        total += own.likelihood(level + falling)
    return total
