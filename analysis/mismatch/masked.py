"""A second read-out path and another effect that mask each other in the variances."""

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.rank import SURE_GAIN, TOLD_APART
from analysis.mismatch.segments import explained, second_path, spiky
from analysis.mismatch.state import State

Array = NDArray[np.float64]


def with_path(state: State, mean: Array) -> Array | None:
    """Return the numbers predicted with an effect and a second path; None: not both are there.

    Charge that neighbours share takes from variances what another read-out path adds: each is
    denied by what the other makes. Both are there where variances bend, for certain, with either
    alone, and are explained better by both than by the path, at odds of 20. `mean` are the numbers
    predicted with the effect alone.
    """
    alone = None if spiky(state) else second_path(state)
    if alone is None or alone.gain < SURE_GAIN:
        return None
    both = second_path(state, mean)
    if both is None or both.gain < SURE_GAIN:
        return None
    told = explained(state, both.mean) - explained(state, alone.mean)
    return both.mean if told >= TOLD_APART else None
