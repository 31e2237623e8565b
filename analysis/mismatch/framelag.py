"""Lag of charge that frames without light have, too: something averages frames."""

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.contradicted import Denial
from analysis.mismatch.state import State

Array = NDArray[np.float64]
_KIND, _STATISTIC = "image_lag", "frame_correlation"
_SURE = 5.0  # standard errors by which darks are alike
_MOST = 0.5  # of how alike lit frames are, that darks may be


def alike_without_light(state: State, kind: str, without: Array) -> Denial | None:
    """Return how lag of charge is denied by frames without light; None: it is not.

    Charge that stays behind correlates shot noise; read noise is new in each frame, and darks are
    not alike. Where they are for certain, half as much as lit frames or more, a filter over frames,
    say, makes both so, and there may be no lag.

    Parameters
    ----------
    state
        With the effect, or before it is taken in.
    kind
        The effect; of any other nothing is said.
    without
        The numbers predicted without it.
    """
    if kind != _KIND:
        return None
    darks = {e.name for e in state.setting.layout.exposures if e.kind == "dark"}
    found: dict[bool, list[tuple[float, float]]] = {True: [], False: []}
    for i, key in enumerate(state.vector.keys):
        if key.statistic != _STATISTIC or key.scope != "exposure" or not state.null.known[i]:
            continue
        rest = float(state.vector.values[i] - without[i])
        if np.isfinite(rest):
            found[key.exposure in darks].append((rest, float(state.null.sd[i])))
    if not all(found.values()):
        return None
    (dark, error), (lit, _) = (_mean(found[place]) for place in (True, False))
    if dark < _SURE * error or dark < _MOST * lit:
        return None
    return Denial(max(1 - dark / max(lit, dark), 0.0), "frames without light are alike as well")


def _mean(pairs: list[tuple[float, float]]) -> tuple[float, float]:
    """Return the weighted mean of values with standard errors, and its own."""
    values, errors = np.array(pairs).T
    weights = 1 / errors**2
    return float(weights @ values / weights.sum()), float(weights.sum() ** -0.5)
