"""A second read-out path and another effect that mask each other in the variances."""

from dataclasses import replace
from math import log

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.rank import SURE_GAIN, TOLD_APART
from analysis.mismatch.segments import explained, second_path, spiky
from analysis.mismatch.state import State

Array = NDArray[np.float64]
_LIMIT = "saturation"
_CLEAR = 3.0  # standard deviations by which an effect clearly changes a number


def with_path(state: State, mean: Array, kind: str = "") -> Array | None:
    """Return the numbers predicted with an effect and a second path; None: not both are there.

    Charge that neighbours share takes from variances what another read-out path adds: each is
    denied by what the other makes. Both are there where variances bend, for certain, with either
    alone, and are explained better by both than by the path, at odds of 20. `mean` are the numbers
    predicted with the effect alone. Where a full well makes tails, others tell the path.
    """
    if spiky(state):
        return _below(state, mean) if kind == _LIMIT else None
    alone = second_path(state)
    if alone is None or alone.gain < SURE_GAIN:
        return None
    both = second_path(state, mean)
    if both is None or both.gain < SURE_GAIN:
        return None
    told = explained(state, both.mean) - explained(state, alone.mean)
    return both.mean if told >= TOLD_APART else None


def _below(state: State, mean: Array) -> Array | None:
    """Return the numbers predicted with a limit and a path that exposures below it show, or None.

    Where the tails depart of an exposure that the limit does not reach, nobody knows.
    """
    null, keys, calibrated = state.null, state.vector.keys, state.calibrated
    changed = np.flatnonzero(null.known & (np.abs(mean - null.mean) > _CLEAR * null.sd))
    reached = frozenset(keys[i].exposure for i in changed if keys[i].exposure)
    inside = np.array([key.exposure in reached for key in null.keys])
    below = replace(
        state,
        calibrated=replace(calibrated, left_out=calibrated.left_out | reached),
        null=replace(null, known=null.known & ~inside[: null.known.size]),
        departures=np.where(inside, 0.0, state.departures),
    )
    path = second_path(below)
    if path is None or path.gain < SURE_GAIN or spiky(below, path):
        return None
    both = mean + path.mean - null.mean
    for i, key in enumerate(keys):
        if key.exposure not in reached or key.statistic != "pixel_variance":
            continue
        if key.scope != "exposure":  # of a scene the path says so itself
            continue
        signal = np.array([state.fit.signal_dn[key.place]], np.float32)
        noise = [float(own.segments.variance_dn2(signal)[0]) for own in (path.camera, state.camera)]
        if min(noise) > 0:
            both[i] += log(noise[0] / noise[1])
    return np.asarray(both)
