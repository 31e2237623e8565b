"""Lines that grain moves: noise that neighbours share along both axes is no matter of lines."""

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.contradicted import Denial
from analysis.mismatch.leftopen import left_open
from analysis.mismatch.resolved import FAR_OFF
from analysis.mismatch.state import State

Array = NDArray[np.float64]
_ROWS = ("row_variance", "correlation_0_1", "correlation_0_2")
_COLUMNS = ("column_variance", "correlation_1_0", "correlation_2_0")
_LINES = {
    "column_noise": _COLUMNS,
    "line_flicker": _ROWS,
    "row_banding": _ROWS,
    "row_noise": _ROWS,
}
_NEXT = ("correlation_0_1", "correlation_1_0")
_FIXED = {
    "column_fpn": "fixed_column_variance",
    "column_prnu": "fixed_column_variance",
    "row_fpn": "fixed_row_variance",
    "row_prnu": "fixed_row_variance",
}
_FIXED_NEXT = ("fixed_correlation_0_1", "fixed_correlation_1_0")
_MOST = 0.5  # of what lines would explain, that neighbours may feign


def patterned(state: State, kind: str, without: Array) -> Denial | None:
    """Return how fixed lines are denied by a pattern of two dimensions; None: they are not.

    Offsets or gains of lines make pixels of a line alike, and no others. Where in mean frames
    neighbours along rows and along columns are, each more surely than lines differ, and it is left
    unexplained, lines may differ by what else there is.
    """
    if kind not in _FIXED:
        return None
    left = left_open(state, _FIXED_NEXT)
    sure = [
        max((rest / sd for (_, of), (rest, sd) in left.items() if of == name), default=0.0)
        for name in _FIXED_NEXT
    ]
    own = np.array([key.statistic == _FIXED[kind] for key in state.vector.keys])
    own &= state.null.known & np.isfinite(without)
    claimed = float(((state.null.mean - without)[own] / state.null.sd[own]).max(initial=0.0))
    if min(sure) <= max(FAR_OFF, claimed):
        return None
    return Denial(0.0, "neighbours along rows and columns have a pattern in common, not lines")


def grained(state: State, kind: str, without: Array) -> Denial | None:
    """Return how lines that move are denied by neighbours that are alike; None: they are not.

    The mean of a line whose pixels have a correlation rho_k with those k pixels on scatters by
    1 + 2 sum rho_k of what it does in white noise. A line that moves makes its own pixels alike,
    and no others: where neighbours along rows and along columns are, surely, and it is left
    unexplained, and feigns half of what the lines would explain, there may be none.

    Parameters
    ----------
    state
        With the effect.
    kind
        The effect.
    without
        The numbers predicted without it.
    """
    if kind not in _LINES:
        return None
    statistic, *along = _LINES[kind]
    left = left_open(state, {*_NEXT, *along})
    sure = {name for (_, name), (rest, sd) in left.items() if rest > FAR_OFF * sd}
    if not sure.issuperset(_NEXT):
        return None
    claimed = feigned = 0.0
    for i, key in enumerate(state.vector.keys):
        known = state.null.known[i] and np.isfinite(without[i]) and key.scope == "exposure"
        if key.statistic != statistic or not known:
            continue
        # Numbers are cube roots of variances, relative to those of white noise.
        more = float(state.null.mean[i] ** 3 - without[i] ** 3)
        place = (key.exposure, key.channel)
        alike = 2 * sum(left.get((place, name), (0.0, 0.0))[0] for name in along)
        weight = (state.null.sd[i] * 3 * max(without[i], 1.0) ** 2) ** -2.0
        claimed += more**2 * weight
        feigned += more * alike * weight
    if claimed <= 0 or feigned <= _MOST * claimed:
        return None
    why = "noise that neighbours share along rows and columns moves lines as much"
    return Denial(max(1 - feigned / claimed, 0.0), why)
