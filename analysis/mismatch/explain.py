"""Which effect explains which mismatch: by what each changes in the numbers that are off."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from math import nan

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.candidates import calls_of
from analysis.mismatch.finding import Mismatch
from analysis.mismatch.instance import kind_of
from analysis.mismatch.jumping import NAME as JUMPING
from analysis.mismatch.locate import FAMILY
from analysis.mismatch.named import Named
from analysis.mismatch.segments import bent
from analysis.mismatch.state import State
from dsis.camera import Camera

Array = NDArray[np.float64]
_LEFT = 0.4  # of a departure may be left where it is called explained


def explained(
    base: State, final: State, changes: Mapping[str, Array], *, whatever_left: bool = False
) -> dict[str, tuple[str | None, float]]:
    """Return the effect that explains each statistic of the base mismatches, and z afterwards.

    Parameters
    ----------
    base, final
        The re-calibrated base model and the final one.
    changes
        By effect's name: what it changes in the numbers, in deviations of the base null.
    whatever_left
        Whether an effect is returned as well of what is still there: that which explains most.
    """
    found: dict[str, tuple[str | None, float]] = {}
    matrix = base.null.contrasts.matrix
    both = {
        kind: np.concatenate([change, matrix @ change / base.null.contrast_sd])
        for kind, change in changes.items()
    }
    after = dict(zip(final.null.keys, final.departures, strict=True))
    for mismatch in base.mismatches:
        which = [
            i
            for i, key in enumerate(base.null.keys)
            if key.statistic == mismatch.statistic and base.chances[i] < FAMILY
        ]
        if mismatch.statistic == JUMPING:
            found[mismatch.statistic] = of_frames(mismatch, changes, final)
            continue
        z = base.departures[which]
        left = max((after.get(base.null.keys[i], 0.0) for i in which), key=abs, default=0.0)
        still = any(m.statistic == mismatch.statistic for m in final.mismatches)
        score = {
            kind: float((np.clip(change[which] / z, -1, 1) * np.abs(z)).sum() / np.abs(z).sum())
            for kind, change in both.items()
        }
        best = max(score, key=lambda kind: score[kind], default=None)
        top = float(np.abs(z).max())
        clear = whatever_left or not still or abs(left) < _LEFT * top
        clear &= best is not None and score[best] > 0
        found[mismatch.statistic] = (best if clear else None, left)
    return found


def of_frames(mismatch: Mismatch, named: Iterable[str], final: State) -> tuple[str | None, float]:
    """Return the effect that explains what only whole frames show, and z afterwards, if it is left.

    Of a model that has it no frames were asked: z is not known then.
    """
    left = [m.z for m in final.mismatches if m.statistic == mismatch.statistic]
    if left:
        return None, left[0]
    callers = (own for own in named if mismatch.statistic in calls_of(kind_of(own)))
    return next(callers, None), nan


def changes(
    base: State, final: State, named: Sequence[Named], without: Callable[[Named], Camera]
) -> dict[str, Array]:
    """Return what each effect changes in the numbers, in deviations of the base null."""
    null, predictor, found = base.null, final.predictor(), {}
    bare = {one.name: without(one) for one in named if one.proposal is not None}
    predictor.ready(bare.values())
    for one in named:
        if one.name in bare:
            change = final.null.mean - predictor.mean(bare[one.name])
        else:
            change = bent(base, final)
        known = null.known & np.isfinite(change)
        found[one.name] = np.where(known, change, 0.0) / null.sd
    return found


def because(explanations: Mapping[str, tuple[str | None, float]], name: str) -> tuple[str, ...]:
    """Return the statistics that an effect explains."""
    return tuple(statistic for statistic, (own, _) in explanations.items() if own == name)
