"""What a sample has from the code of the one read before it: memory of a converter of steps.

The residue of a converter's coarse decision rises and falls with the code, period by period. Waves
over the code before a sample tell it from all that couples neighbours in proportion: what a line
through that code explains is taken off.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from math import pi, sqrt

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.scalars import UNKNOWN, Number
from dsis.compiled import kernel

PERIODS = (8, 16, 32, 64, 128, 256, 512, 1024)
"""Codes of a residue's period that are looked at: the steps of converters are powers of two."""

AXES = ("rows", "columns")
PHASES = ("cosine", "sine")
_BEFORE = {"rows": (0, 1), "columns": (1, 0)}
_FRAMES = 16  # of an exposure: a memory is the same in all
_FOLDED = PERIODS[-1]
_LEAST = 4.0  # times what means of lines take: what must be left of a wave, to say anything
_KEPT = 2**13  # samples of a difference of frames that are kept one by one
_PLACES = 32  # of a step in its period that are looked at
Array = NDArray[np.float64]
Frame = NDArray[np.int32]


@dataclass(frozen=True)
class Samples:
    """Samples of one exposure, and what was read before each: a column each.

    Attributes
    ----------
    one, other
        Codes of the sample before, of two frames, folded at `PERIODS[-1]`.
    moved
        Change of the sample between the frames, what goes with that of the one before taken off,
        in standard deviations.
    before
        Change of the sample before, DN.
    variance_dn2
        Of the change.
    """

    one: Frame
    other: Frame
    moved: Array
    before: Array
    variance_dn2: float


@dataclass(frozen=True)
class Sawtooth:
    """The residue that explains what samples have from those before: see `AdcMemory`."""

    step_dn: float
    period: int
    at_code: float
    chi2: float


def detail(axis: str, period: int, phase: str) -> str:
    """Return what tells one of the numbers from the others."""
    return f"{axis}, {phase} over {period} codes"


class CarryOver:
    """Sums over successive frames of one exposure, by the code before, folded at `PERIODS[-1]`.

    By axis: how often codes, their differences and sums occur; sums of the sample's own change from
    frame to frame and of that of the one before; count, squares and product of the changes.
    """

    def __init__(self, *, keep: bool = False) -> None:
        self.keep = keep
        self.kept: dict[str, list[Array]] = {axis: [] for axis in AXES}
        self.by_code = {axis: np.zeros((5, _FOLDED)) for axis in AXES}
        self.squares = {axis: np.zeros(4) for axis in AXES}
        self.frames, self.size = 0, {"rows": 1, "columns": 1}

    def watching(self, frames: Iterable[NDArray[np.generic]]) -> Iterator[NDArray[np.generic]]:
        """Yield frames (row, column) as they come, and take their differences."""
        last: Frame | None = None
        for frame in frames:
            if self.frames < _FRAMES:
                own = np.ascontiguousarray(frame, np.int32)
                if last is not None:
                    self._take(last, own)
                last = own
                self.frames += 1
            yield frame

    def _take(self, one: Frame, other: Frame) -> None:
        moved = (one - other).astype(np.float32)
        self.size = {"rows": one.shape[1], "columns": one.shape[0]}
        for k, axis in enumerate(AXES):
            still = moved - moved.mean(1 - k, keepdims=True)  # whole lines move for other reasons
            down, right = _BEFORE[axis]
            _add(one, other, still, down, right, self.by_code[axis], self.squares[axis])
            if self.keep:
                rows, columns = one.shape[0] - down, one.shape[1] - right
                parts = (one, other, still[down:, right:], still)
                flat = [part[:rows, :columns].reshape(-1) for part in parts]
                step = max(flat[0].size // _KEPT, 1) | 1  # odd: no colour is left out
                self.kept[axis].append(np.stack([part[::step] for part in flat]).astype(float))

    def samples(self, axis: str) -> Samples | None:
        """Return the samples kept; None: there are none."""
        if not self.kept[axis]:
            return None
        one, other, moved, before = np.concatenate(self.kept[axis], 1)
        square = float(before @ before)
        if square <= 0:
            return None
        rest = moved - before * float(before @ moved) / square
        variance = float(rest.var())
        if variance <= 0:
            return None
        codes = (part.astype(np.int32) & (_FOLDED - 1) for part in (one, other))
        return Samples(*codes, rest / sqrt(variance), before, variance)


class CarryOverSums:
    """Amplitudes of the waves over all exposures, by weighted least squares, DN."""

    def __init__(self) -> None:
        shape = (len(PERIODS), len(PHASES))
        self.top = {axis: np.zeros(shape) for axis in AXES}
        self.bottom = {axis: np.zeros(shape) for axis in AXES}

    def add(self, own: CarryOver) -> None:
        """Take one exposure."""
        if own.frames < 2:
            return
        # n - 1 differences of successive frames, which share frames, say as much as fewer apart.
        weight = (2 * own.frames - 2) / (3 * own.frames - 4)
        waves = _waves()
        for axis in AXES:
            count, square, product, before = own.squares[axis]
            if min(square, before) <= 0:
                continue
            codes, differences, sums, moved, itself = own.by_code[axis]
            variance = max(square - product**2 / before, 1e-12) / count
            for k, (wave, sign) in enumerate(zip(waves, (1.0, -1.0), strict=True)):
                # Of cosines (cos a - cos b)^2, of sines (sin a - sin b)^2, from a - b and a + b.
                cosine = waves[0]
                whole = count + sign * (_doubled() @ codes) / 2
                whole -= cosine @ differences + sign * (cosine @ sums)
                through = wave @ itself
                left = whole - through**2 / before
                known = left > _LEAST / own.size[axis] * np.abs(whole)
                top = wave @ moved - through * product / before
                scale = weight / variance
                self.top[axis][:, k] += np.where(known, top * scale, 0.0)
                self.bottom[axis][:, k] += np.where(known, left * scale, 0.0)

    def numbers(self) -> dict[str, Number]:
        """Return amplitudes and their errors in white noise, DN, by name."""
        found: dict[str, Number] = {}
        for axis in AXES:
            for p, period in enumerate(PERIODS):
                for k, phase in enumerate(PHASES):
                    top, bottom = self.top[axis][p, k], self.bottom[axis][p, k]
                    name = f"carry_over along {detail(axis, period, phase)}"
                    known = bottom > 0
                    found[name] = (float(top / bottom), 1 / sqrt(bottom)) if known else UNKNOWN
        return found


def sawtooth(samples: Sequence[Samples], period: int) -> Sawtooth:
    """Return the sawtooth of a period that explains most, by least squares."""
    best = Sawtooth(0.0, period, 0.0, 0.0)
    for place in range(_PLACES):
        at = period * place / _PLACES
        phase = (np.arange(_FOLDED) - at) / period
        residue = phase - np.floor(phase) - 0.5
        top = bottom = 0.0
        for own in samples:
            apart = residue[own.one] - residue[own.other]
            along = float(apart @ own.before) / float(own.before @ own.before)
            apart -= along * own.before
            top += float(apart @ own.moved) / sqrt(own.variance_dn2)
            bottom += float(apart @ apart) / own.variance_dn2
        if bottom > 0 and top**2 / bottom > best.chi2:
            best = Sawtooth(top / bottom, period, at, top**2 / bottom)
    return best


@cache
def _waves() -> tuple[Array, Array]:
    """Return cosines and sines over the folded codes: (period, code)."""
    angle = 2 * pi * np.arange(_FOLDED) / np.array(PERIODS)[:, None]
    return np.cos(angle), np.sin(angle)


@cache
def _doubled() -> Array:
    """Return cosines of twice the angle: (period, code)."""
    return np.asarray(2 * _waves()[0] ** 2 - 1)


@kernel
def _add(
    one: Frame,
    other: Frame,
    moved: NDArray[np.float32],
    down: int,
    right: int,
    by_code: Array,
    squares: Array,
) -> None:
    rows, columns = one.shape
    mask = by_code.shape[1] - 1
    count = square = product = before = 0.0
    for y in range(down, rows):
        for x in range(right, columns):
            a, b = one[y - down, x - right], other[y - down, x - right]
            d, own = float(moved[y, x]), float(moved[y - down, x - right])
            by_code[0, a & mask] += 1
            by_code[0, b & mask] += 1
            by_code[1, (a - b) & mask] += 1
            by_code[2, (a + b) & mask] += 1
            by_code[3, a & mask] += d
            by_code[3, b & mask] -= d
            by_code[4, a & mask] += own
            by_code[4, b & mask] -= own
            count += 1
            square += d * d
            product += d * own
            before += own * own
    squares[0] += count
    squares[1] += square
    squares[2] += product
    squares[3] += before
