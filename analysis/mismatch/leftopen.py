"""What a state leaves of statistics that differ for certain, by exposure and channel."""

from collections.abc import Iterable

from analysis.mismatch.layout import Place
from analysis.mismatch.state import State

_STAND_OUT = 5.0  # standard deviations
Left = dict[tuple[Place, str], tuple[float, float]]
"""By place and statistic: what is left, and its standard deviation."""


def left_open(state: State, statistics: Iterable[str]) -> Left:
    """Return what is left of statistics that differ for certain, and its standard deviation."""
    certain = {m.statistic for m in state.mismatches}.intersection(statistics)
    return {
        ((key.exposure, key.channel), key.statistic): (float(rest), float(sd))
        for key, rest, sd, known in zip(
            state.vector.keys,
            state.vector.values - state.null.mean,
            state.null.sd,
            state.null.known,
            strict=True,
        )
        if known and key.statistic in certain and key.scope == "exposure"
    }


def warm_left(state: State) -> bool:
    """Return whether pixels that stand out with exposure time are left unexplained."""
    left = state.null.departures(state.vector)
    return any(
        z > _STAND_OUT and key.statistic == "outlying_pixels" and key.scope == "time"
        for key, z in zip(state.null.keys, left, strict=True)
    )
