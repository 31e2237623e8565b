"""What whole frames gain by bands of light: a wave down the rows, in proportion to the signal.

Its phase is another in every frame. A single number of the bank, the largest power of many, says
less of bands that few exposures show.
"""

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.layout import Layout
from analysis.mismatch.projections import LEAST, FramesOf, Power, projections

_BETWEEN = (-1 / 3, 0.0, 1 / 3)  # bins by which a frequency may be off
_FAR = (-19, -15, -12, -9, -7, -5, 5, 7, 9, 12, 15, 19)  # bins that say what rows have in common
_NEAR = (-2, -1, 1, 2)  # bins that a band leaves as they are, and slow waves do not
_LOWEST = 1.0  # cycles a frame: below, a wave is much like the frame's mean


def gain_of_bands(layout: Layout, frames_of: FramesOf, cycles: float) -> float:
    """Return the log-likelihood that frames gain by bands at a place not known before.

    Of all places where bands could be as likely, these take the share to which frames tell it:
    sqrt(2 pi) times its error, of the bins of a column (Laplace). Noise is, in each exposure,
    white, or what its rows have in common, or what slow waves leave beside the place. Minus
    infinity where neighbours are raised as well, where there are none on both sides (of 1/f noise
    the slowest waves stand out), or where there is too little to tell.

    Parameters
    ----------
    layout, frames_of
        The frames.
    cycles
        Of the bands, in the rows of a frame.
    """
    rows = layout.rows
    tried = [cycles + k for k in _BETWEEN]
    near = [cycles + k for k in _NEAR if _LOWEST <= cycles + k <= rows / 2]
    far = [cycles + k for k in _FAR if _LOWEST <= cycles + k <= rows / 2]
    if len(near) < len(_NEAR) or not far:
        return -np.inf
    places = [*tried, *near, *far]
    found = tuple(projections(layout, frames_of, [(0.0, own / rows) for own in places]))
    seen = Power(found, tuple(_light(layout) ** 2))
    seen = seen.lifted([slice(len(tried), len(tried) + len(near)), slice(-len(far), None)])
    if seen.frames < LEAST or not any(seen.weights):
        return -np.inf
    best = int(seen.excess[: len(tried)].argmax())
    power = float(seen.excess[best])
    if not power > 0 or seen.crowded(range(len(tried), len(tried) + len(near)), power):
        return -np.inf
    own = seen.at([best])
    share = min(np.sqrt(2 * np.pi) * own.bins(power), 1.0)
    return own.there(power, kept=False, real=False) - float(np.log(rows / 2 / share))


def _light(layout: Layout) -> NDArray[np.float64]:
    """Return the signal of each exposure over its noise, of all channels together."""
    found = []
    for exposure in layout.uniform:
        places = [(exposure.name, channel) for channel in layout.channels]
        signal = max(float(np.mean([layout.signal_dn[place] for place in places])), 0.0)
        variance = float(np.mean([layout.variance_dn2[place] for place in places]))
        found.append(signal / np.sqrt(variance))
    return np.array(found)
