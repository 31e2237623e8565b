"""Lag of charge that frames without light have, too: something averages frames."""

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.contradicted import Denial
from analysis.mismatch.jumping import NAME as JUMPING
from analysis.mismatch.leftopen import left_open
from analysis.mismatch.state import State

Array = NDArray[np.float64]
_KIND, _STATISTIC = "image_lag", "frame_correlation"
_SURE = 5.0  # standard errors by which darks are alike
_MOST, _SOME = 0.5, 0.15  # of how alike lit frames are, that darks may be; beyond the model
_OF_FEW = frozenset({JUMPING, "noisy_pixels", "one_off_outliers", "variance_persistence"})


def alike_without_light(state: State, kind: str, without: Array) -> Denial | None:
    """Return how lag of charge is denied by frames without light; None: it is not.

    Charge that stays behind correlates shot noise; read noise is new in each frame, and darks are
    not alike. Where they are for certain, half as much as lit frames or more, a filter over frames,
    say, makes both so, and there may be no lag. Nor where they stay alike beside a lag, by less
    than that: of a filter that rounds, which is weak where noise is.

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
    share = max(1 - dark / max(lit, dark), 0.0) if dark > 0 else 1.0
    if dark >= max(_SURE * error, _MOST * lit):
        return Denial(share, "frames without light are alike as well")
    lagging = any(one.kind == _KIND for one in state.camera.effect)
    if lagging and _left(state, darks) > _SOME * max(lit, 0.0):
        why = "frames without light are alike, more than charge that stays makes them"
        return Denial(share, why)
    return None


def _left(state: State, darks: set[str]) -> float:
    """Return how alike darks are beyond the model, if for certain, and no few pixels are; else 0.

    Few pixels that jump, or are noisy, follow themselves from frame to frame for another reason.
    """
    off = {m.statistic for m in state.mismatches}
    if _STATISTIC not in off or off & _OF_FEW:
        return 0.0
    beyond = left_open(state, (_STATISTIC,))
    dark = [own for (place, _), own in beyond.items() if place[0] in darks]
    rest, error = _mean(dark) if dark else (0.0, 0.0)
    return rest if rest >= _SURE * error else 0.0


def _mean(pairs: list[tuple[float, float]]) -> tuple[float, float]:
    """Return the weighted mean of values with standard errors, and its own."""
    values, errors = np.array(pairs).T
    weights = 1 / errors**2
    return float(weights @ values / weights.sum()), float(weights.sum() ** -0.5)
