"""Codes that never occur: a digital gain or a table of codes, not widths that scatter."""

import numpy as np

from analysis.mismatch.candidates.steps import FEW, absent
from analysis.mismatch.contradicted import Denial
from analysis.mismatch.state import State

_MOST = 0.5  # of the mean square of unevenness, that absent codes may make


def left_out(state: State) -> Denial | None:
    """Return how widths of codes that scatter are denied by absent codes; None: they are not.

    Of n codes m are absent, and all others alike: with their mean 1, widths have the variance
    m / (n - m), and the share of their mean square that varies is m / n, which `code_imbalance`
    measures the root of. Where that is half of what is measured or more the codes that do occur are
    alike: numbers were multiplied, or looked up, once they were codes.
    """
    seen = state.setting.seen
    measured = {
        (key.exposure, key.channel): float(value)
        for key, value in zip(state.vector.keys, state.vector.values, strict=True)
        if key.statistic == "code_imbalance" and key.scope == "exposure" and np.isfinite(value)
    }
    both = [(one, measured[place]) for place, one in seen.middles.items() if place in measured]
    if len(absent(one for one, _ in both)) < FEW:
        return None
    made = sum(one.absent.size / one.codes for one, _ in both)
    whole = sum(max(value, 0.0) ** 2 for _, value in both)
    if whole <= 0 or made < _MOST * whole:
        return None
    why = "codes between others never occur, and those that do are about alike"
    return Denial(max(1 - made / whole, 0.0), why)
