"""What a state leaves of statistics that differ for certain, by exposure and channel."""

from collections.abc import Iterable

from analysis.mismatch.layout import Place
from analysis.mismatch.state import State

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
