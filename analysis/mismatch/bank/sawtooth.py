"""A converter's residue, of samples and the codes before them: the sawtooth that explains most."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from math import nan, sqrt

import numpy as np
from numpy.typing import NDArray

from dsis.compiled import kernel

PERIODS = (8, 16, 32, 64, 128, 256, 512, 1024)
"""Codes of a residue's period that are looked at: the steps of converters are powers of two."""

PLACES = 32
"""Places of a step in its period that are looked at."""

FOLDED = PERIODS[-1]
_FINER = 8  # places of a step between two of `PLACES`
Array = NDArray[np.float64]
Frame = NDArray[np.int32]


@dataclass(frozen=True, eq=False)
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
    square_dn2
        Sum of the squares of `before`.
    follows
        What was taken off, in proportion to `before`.
    """

    one: Frame
    other: Frame
    moved: Array
    before: Array
    variance_dn2: float
    square_dn2: float
    follows: float = 0.0


@dataclass(frozen=True)
class Sawtooth:
    """The residue that explains what samples have from those before: see `AdcMemory`."""

    step_dn: float
    period: int
    at_code: float
    chi2: float


@lru_cache(maxsize=8)  # of the recorded ones, which are asked again whatever the model
def sawteeth(samples: tuple[Samples, ...], *, whole: bool = False) -> tuple[Sawtooth, ...]:
    """Return for each of `PERIODS` the sawtooth that explains most, by least squares.

    `whole`: of what goes in proportion too. Between its steps a residue is nothing else.
    """
    found = []
    for period in PERIODS:
        best, coarse = Sawtooth(0.0, period, 0.0, 0.0), period / PLACES
        best = _best(samples, best, coarse * np.arange(PLACES), whole=whole)
        finer = best.at_code + coarse / _FINER * np.arange(1 - _FINER, _FINER)
        found.append(_best(samples, best, finer % period, whole=whole))
    return tuple(found)


def _best(
    samples: tuple[Samples, ...], best: Sawtooth, places: NDArray[np.floating], *, whole: bool
) -> Sawtooth:
    """Return the best of a sawtooth and those of its period which fall at some places."""
    sums = _sums(samples, best.period, tuple(places.tolist()))
    for k, at in enumerate(places.tolist()):
        top = bottom = 0.0
        for own, of_places in zip(samples, sums, strict=True):
            square, moved, before = of_places[:, k].tolist()
            top += moved / sqrt(own.variance_dn2)
            top += whole * own.follows * before / own.variance_dn2
            bottom += (square - (not whole) * before**2 / own.square_dn2) / own.variance_dn2
        if bottom > 0 and top**2 / bottom > best.chi2:
            best = Sawtooth(top / bottom, best.period, at, top**2 / bottom)
    return best


def explained(samples: Sequence[Samples], period: int, at_code: float, step_dn: float) -> float:
    """Return by how much a residue of some step lessens chi-squared of what samples have.

    Beyond what goes in proportion to the sample before.
    """
    some = tuple(samples)
    total = 0.0
    for own, of_place in zip(some, _sums(some, period, (at_code % period,)), strict=True):
        square, moved, before = of_place[:, 0].tolist()
        bottom = (square - before**2 / own.square_dn2) / own.variance_dn2
        total += 2 * step_dn * moved / sqrt(own.variance_dn2) - step_dn**2 * bottom
    return total


@lru_cache(maxsize=64)
def _sums(
    samples: tuple[Samples, ...], period: int, places: tuple[float, ...]
) -> tuple[Array, ...]:
    """Return of each exposure's samples what `_against` does, of residues at some places."""
    phases = (np.arange(FOLDED)[:, np.newaxis] - np.array(places)) / period
    # Of a code, whose cell a step may part: the mean over it.
    residues = (_risen(phases + 0.5 / period) - _risen(phases - 0.5 / period)) * period - 0.5
    return tuple(_against(residues, o.one, o.other, o.moved, o.before) for o in samples)


def _risen(phases: Array) -> Array:
    """Return the integral of what phases have beyond whole ones, from 0 on."""
    whole = np.floor(phases)
    return np.asarray((whole + (phases - whole) ** 2) / 2)


def profile(samples: Sequence[Samples], period: int, parts: int) -> tuple[Array, Array]:
    """Return what samples have from the codes before them, over a period, and its error, DN.

    By least squares over equal parts of the period: (part,), about their mean; nan where codes did
    not occur.
    """
    normal, score = np.zeros((parts, parts)), np.zeros(parts)
    for own in samples:
        one, other = (code % period * parts // period for code in (own.one, own.other))
        both = np.bincount(one * parts + other, minlength=parts * parts).reshape(parts, parts)
        # Of a design of 1 where the first frame's code lies and -1 where the second one's does.
        square = np.diag(both.sum(0) + both.sum(1)) - both - both.T
        before, moved = (
            np.bincount(one, what, parts) - np.bincount(other, what, parts)
            for what in (own.before, own.moved)
        )
        # What goes in proportion to the change before is taken off the design.
        along = before / own.square_dn2
        normal += (square - np.outer(before, along)) / own.variance_dn2
        score += (moved - float(own.before @ own.moved) * along) / sqrt(own.variance_dn2)
    inverse = np.linalg.pinv(normal, rcond=1e-6, hermitian=True)
    errors = np.sqrt(np.maximum(np.diag(inverse), 0.0))
    met = np.diag(normal) > 0
    return np.where(met, inverse @ score, nan), np.where(met, errors, nan)


@kernel
def _against(residues: Array, one: Frame, other: Frame, moved: Array, before: Array) -> Array:
    """Return the sums of a residue's change squared, times what moved, and what moved before.

    Of residues at some places, (code, place), each: (3, place). All at once: a vector instruction
    takes several places.
    """
    places = np.uintp(residues.shape[1])
    sums = np.zeros(3 * residues.shape[1])
    for i in range(np.uintp(one.size)):
        here, there = residues[np.uintp(one[i])], residues[np.uintp(other[i])]
        change, earlier = moved[i], before[i]
        for k in range(places):
            apart = here[k] - there[k]
            sums[k] += apart * apart
            sums[places + k] += apart * change
            sums[places + places + k] += apart * earlier
    return sums.reshape(3, -1)
