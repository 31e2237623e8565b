"""Lines that begin darker: of a read-out that remembers samples, and rests at black before them."""

import numpy as np

from analysis.mismatch.bank.linemeans import Axis
from analysis.mismatch.bank.robust import typical_square
from analysis.mismatch.clues import Clues

_CLEAR = 5.0  # standard errors
_BESIDE = 8  # samples after the first ones, which these are compared with


def lines_begin_darker(clues: Clues, along: str, lag: int) -> float:
    """Return the share by which the first samples of lines are darker; 0: not for sure.

    Beside those that follow, over all flats, in proportion to the signal. The error is that of
    lines which scatter as the recorded ones do.

    Parameters
    ----------
    clues
        The recording beside the current model.
    along
        `rows` or `columns`: along what a sample follows the one before.
    lag
        Samples.
    """
    axis: Axis = "column" if along == "rows" else "row"
    top = weights = 0.0
    for exposure in clues.layout.uniform:
        own = clues.seen.lines.get((exposure.name, axis))
        signal = float(np.mean([clues.signal((exposure.name, c)) for c in clues.layout.channels]))
        if own is None or signal <= 0:
            continue
        after = own.means[lag : lag + max(_BESIDE, 2 * lag)]
        if after.size < min(_BESIDE, own.means.size // 2):
            return 0.0
        square = max(typical_square(own.fixed), own.noise_dn2 / own.frames)
        weight = 1 / (square * (1 / lag + 1 / after.size))
        darker = float(after.mean() - own.means[:lag].mean())
        top += weight * signal * darker
        weights += weight * signal**2
    if not weights or abs(top) < _CLEAR * weights**0.5:
        return 0.0
    return top / weights
