"""Simulated recordings of a model as numbers; what much the same model was simulated for is kept.

Draws are counted: a recording of one model and that of another, of the same number, differ by what
the models differ by. Where few recordings show that this scatters little from one to the next, the
others are those of the first model, moved by the mean change (a control variate: Glasserman, Monte
Carlo Methods in Financial Engineering, 2003, section 4.1).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.key import Key
from analysis.mismatch.basefit import BaseFit
from analysis.mismatch.null import Null
from analysis.mismatch.vector import Vector
from dsis.camera import Camera

Array = NDArray[np.float64]
_SHARE, _LEAST = 4, 4  # one in so many is simulated anew, but not fewer
_STEADY = 0.5  # scatter of a statistic's change, beside its spread
_CHANCE = 2.0  # mean square of departures, 1 in a model's own recordings
_SINGLE, _RARE = 1.0, 6.0  # of a single number: squared scatter, and such a mean square
Simulate = Callable[[range], Sequence[tuple[BaseFit, Vector]]]
"""Gives base numbers and numbers of a model's recordings, by their numbers."""


@dataclass(frozen=True)
class Replicates:
    """Simulated recordings of one model.

    Attributes
    ----------
    vectors
        Numbers of each; those that are not the model's own are moved ones.
    fits
        Base numbers fitted to some, all of one model: how far they scatter.
    own
        How many of the first are the model's own.
    unsure
        By how much moved ones leave the mean of each number unsure, squared; empty: by nothing.
    moved_from
        Of the model that moved ones were made for: none is moved twice.
    """

    vectors: tuple[Vector, ...]
    fits: tuple[BaseFit, ...]
    own: int
    unsure: Array = field(default_factory=lambda: np.zeros(0))
    moved_from: "Known | None" = None


Known = tuple[Replicates, Null]
"""Recordings that are all of one model, and its null."""


def replicates(simulate: Simulate, count: int, near: Known | None = None) -> Replicates:
    """Return so many recordings of a model; `near`: those of one much the same, see `known`."""
    few = max(count // _SHARE, _LEAST)
    if near is None or count <= few or len(near[0].vectors) < count:
        return _of(simulate(range(count)))
    first = _of(simulate(range(few)))
    moved = _moved(first.vectors, near[0].vectors[:count], near[1])
    if moved is None:
        rest = _of(simulate(range(few, count)))
        return Replicates((*first.vectors, *rest.vectors), (*first.fits, *rest.fits), count)
    vectors, scatter = moved
    unsure = (len(vectors) / count) ** 2 * scatter / few
    return Replicates((*first.vectors, *vectors), near[0].fits, few, unsure, near)


def more(simulate: Simulate, count: int, made: Replicates) -> Replicates:
    """Return so many recordings of a model, all its own, of which some are made."""
    rest = _of(simulate(range(made.own, count)))
    fits = rest.fits if made.moved_from is not None else (*made.fits, *rest.fits)
    return Replicates((*made.vectors[: made.own], *rest.vectors), fits, count)


def known(own: Replicates, null: Null) -> Known:
    """Return what a model much the same may be made of: recordings that are none of them moved."""
    return (own, null) if own.moved_from is None else own.moved_from


def same_kinds(one: Camera, other: Camera) -> bool:
    """Return whether cameras have effects of the same kinds, and as many read-out segments."""
    first, second = (
        (sorted(effect.kind for effect in own.effect), own.noise.shot, len(own.noise.segment))
        for own in (one, other)
    )
    return first == second


def _of(made: Sequence[tuple[BaseFit, Vector]]) -> Replicates:
    return Replicates(tuple(own for _, own in made), tuple(fit for fit, _ in made), len(made))


def _moved(
    first: Sequence[Vector], near: Sequence[Vector], null: Null
) -> tuple[list[Vector], Array] | None:
    """Return the later ones of a near model, moved to this one, and how changes scatter, squared.

    None: they scatter too far. A change counts as far as the recordings agree on it.
    """
    if first[0].keys != near[0].keys:
        return None
    own = np.stack([one.values for one in first])
    before = np.stack([one.values for one in near[: len(first)]])
    finite = np.isfinite(own)
    if not np.array_equal(finite, np.isfinite(before)):
        return None
    change = np.where(finite, np.nan_to_num(own) - np.nan_to_num(before), 0.0)
    scatter, mean = change.var(0, ddof=1), change.mean(0)
    seen = np.asarray(finite.all(0))
    off = np.where(seen, (np.nan_to_num(own) - null.mean) / null.sd, 0.0)
    steady = np.where(seen, scatter / null.sd**2, 0.0)
    if not _alike(first[0].keys, seen, steady, (off**2).mean(0)):
        return None
    noise = scatter / len(first)
    kept = np.where(mean == 0, 0.0, mean**2 / np.maximum(mean**2 + noise, 1e-300))
    later = near[len(first) :]
    return [replace(one, values=one.values + kept * mean) for one in later], kept * scatter


def _alike(keys: Sequence[Key], seen: NDArray[np.bool_], scatter: Array, off: Array) -> bool:
    """Return whether every statistic changes alike in all recordings, or not to speak of.

    Parameters
    ----------
    keys, seen
        Of the numbers; which are numbers.
    scatter
        Of a change, beside the near model's spread: squared.
    off
        Mean square of departures from the near model: codes and pixels that little tips over are
        elsewhere by chance alone.
    """
    groups: dict[tuple[str, str], list[int]] = {}
    for i, key in enumerate(keys):
        if seen[i]:
            groups.setdefault((key.statistic, key.scope), []).append(i)
    return not bool(((scatter > _SINGLE) & (off > _RARE)).any()) and all(
        scatter[which].mean() <= _STEADY**2 or off[which].mean() <= _CHANCE
        for which in groups.values()
    )
