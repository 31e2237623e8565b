"""Whether neighbours are alike as charge that repels charge makes them: the more the brighter."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.contradicted import Denial, rival
from analysis.mismatch.layout import Layout, Place
from analysis.mismatch.rank import TOLD_APART
from analysis.mismatch.sharing import left_by
from analysis.mismatch.state import State
from analysis.mismatch.straight import misfits, straight_beside

Array = NDArray[np.float64]
_KIND = "brighter_fatter"
_NEXT = {"correlation_0_1": (0, 1), "correlation_1_0": (1, 0)}


def no_brighter_alike(state: State, kind: str, without: Array) -> Denial | None:
    """Return how charge that repels charge is denied; None: it is not, or it is another effect.

    Pixels p and n that give each other a share f of their charge have f (v_p + v_n) of their shot
    noise v in common; where the share is a S, S the signal, a (S_p v_p + S_n v_n). Next pixels
    along rows have one share, those along columns another. Noise of read-out may be alike for any
    reason of its own: beside that, of any size, both laws are judged, and denied is the second
    where the first is likelier at odds of 20, and the second beside it is not. What charge takes
    from variances counts, for it or against it, where they would lie on a line without. `without`
    are the numbers predicted without the effect.
    """
    if kind != _KIND:
        return None
    alike = light = besides = 0.0
    taken: dict[Place, float] = {}
    for pairs in _pairs(state, without):
        all_light, shape = pairs.shot.sum(1), (pairs.shot * pairs.signal).sum(1)
        light += _fitted(pairs, all_light)[1]
        factor, gain = _fitted(pairs, shape)
        alike += gain
        besides += _fitted(pairs, shape, all_light)[1]
        for place, one in zip(pairs.places, factor * shape / pairs.scale, strict=True):
            taken[place] = taken.get(place, 0.0) + 2 * float(one)
    if straight_beside(state, _KIND):
        before, after = misfits(state, lambda at, default: default + taken.get(at, 0.0))
        alike += (before - after) / 2
    behind = light - alike
    if behind <= TOLD_APART or besides > TOLD_APART:
        return None
    return rival(behind, "neighbours share noise of light alone, no more of it the brighter it is")


@dataclass(frozen=True)
class _Pairs:
    """Next pixels along one axis, and their correlations.

    Attributes
    ----------
    places
        Of the first of each pair.
    signal, shot
        DN and DN^2, of both: (pair, 2).
    read_dn2, scale
        Products of both pixels' standard deviations, of read-out and of all noise: (pair,).
    values, sd
        Correlations that are to be explained, and their errors: (pair,).
    """

    places: list[Place]
    signal: Array
    shot: Array
    read_dn2: Array
    scale: Array
    values: Array
    sd: Array


def _pairs(state: State, without: Array) -> list[_Pairs]:
    levels, clues = state.setting.seen.levels, state.clues()
    found = []
    left = left_by(state, without, frozenset(_NEXT))
    for statistic, step in _NEXT.items():
        every = [one for (name, _), own in left.items() if name == statistic for one in own]
        both = [(at, _beside(state.setting.layout, at, step)) for at, *_ in every]
        known = [k for k, (_, to) in enumerate(both) if to in levels]
        if not known:
            continue
        each = [both[k] for k in known]
        total = np.array([[levels[at].variance_dn2 for at in pair] for pair in each])
        share = np.array([[clues.shot_share(at) for at in pair] for pair in each])
        found.append(
            _Pairs(
                [at for at, _ in each],
                np.array([[clues.signal(at) for at in pair] for pair in each]),
                total * share,
                np.sqrt((total * (1 - share)).prod(1)),
                np.sqrt(total.prod(1)),
                np.array([every[k][1] for k in known]),
                np.array([every[k][2] for k in known]),
            )
        )
    return found


def _beside(layout: Layout, place: Place, step: tuple[int, int]) -> Place:
    """Return the place of the next pixel: in a mosaic another colour's."""
    if len(layout.sites) == 1:
        return place
    y, x = layout.sites[place[1]]
    at = ((y + step[0]) % 2, (x + step[1]) % 2)
    return place[0], next(name for name, own in layout.sites.items() if own == at)


def _fitted(pairs: _Pairs, covariance: Array, *others: Array) -> tuple[float, float]:
    """Return the factor of a covariance, none below zero, and what it gains, nats.

    Beside a covariance of the noise of read-out and others, of any size.
    """
    unit = pairs.scale * pairs.sd
    beside = np.stack([pairs.read_dn2, *others], 1) / unit[:, np.newaxis]
    own, values = covariance / unit, pairs.values / pairs.sd
    own = own - beside @ np.linalg.lstsq(beside, own, rcond=None)[0]
    values = values - beside @ np.linalg.lstsq(beside, values, rcond=None)[0]
    square, through = float(own @ own), max(float(own @ values), 0.0)
    return (through / square, through**2 / (2 * square)) if square > 0 else (0.0, 0.0)
