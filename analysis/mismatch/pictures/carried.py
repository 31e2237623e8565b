"""What samples have from the code of the one before, over a period of the converter's residue."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.sawtooth import Samples, profile, sawteeth
from analysis.mismatch.evidence import Curve
from analysis.mismatch.observe import Observation

Array = NDArray[np.float64]
_PARTS = 32  # of a period


def carried(
    axes: Sequence[str],
    seen: Observation,
    before: Sequence[Observation],
    after: Sequence[Observation],
) -> dict[str, tuple[Curve, ...]]:
    """Return a curve for each axis: recorded, and as simulations of both models have it.

    Over the period of the residue that explains most of what was recorded; `after` is empty where
    nothing was named.
    """
    found: dict[str, tuple[Curve, ...]] = {}
    for axis in axes:
        own = seen.carried.get(axis, ())
        if not own:
            continue
        period = max(sawteeth(own), key=lambda one: one.chi2).period
        parts = min(_PARTS, period)
        observed, sd = profile(own, period, parts)
        middles = (np.arange(parts) + 0.5) * period / parts - 0.5
        found[f"carry_over along {axis}"] = (
            Curve(
                "",
                "code_before",
                middles,
                observed,
                _mean([one.carried[axis] for one in before], period, parts),
                _mean([one.carried[axis] for one in after], period, parts) if after else None,
                sd,
                "DN",
            ),
        )
    return found


def _mean(simulated: Sequence[Sequence[Samples]], period: int, parts: int) -> Array:
    return np.asarray(np.mean([profile(one, period, parts)[0] for one in simulated], 0))
