"""Whether what calls for an effect follows its law from level to level, or another.

Photons that are counted skew noise the less the more they are; amplifiers of two greens are apart
by the same share at any light. What grows with light faster than that is something else, whose sum
over the levels an effect of fitted size explains in part.
"""

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.contradicted import Denial, rival
from analysis.mismatch.rank import TOLD_APART
from analysis.mismatch.state import State

Array = NDArray[np.float64]
_OF = {
    "poisson_shot_noise": "skewness",
    "channel_imbalance": "channel_ratio",
    "tap_mismatch": "channel_ratio",
}
_GREENS = ("Gr", "Gb")
_WORDS = {
    "skewness": "how skewed noise is grows with light as no counting makes it",
    "channel_ratio": "the greens differ the more the brighter, as no amplifier makes them",
}
_POWERS = (0.5, 1.0, 2.0)  # of the signal, by which something else may grow faster
_LEAST = 3  # levels


def otherwise_by_level(state: State, kind: str, without: Array, mean: Array) -> Denial | None:
    """Return how an effect is denied by the levels that show what it makes; None: it is not.

    Least squares of what is left open without it, by what the effect changes there, of any size,
    and by the same times a power of the signal. Denied is the effect where such a power is likelier
    at odds of 20, and the effect beside it is not needed at such odds.

    Parameters
    ----------
    state
        With the effect, or before it is taken in.
    kind
        The effect.
    without, mean
        The numbers predicted without it, and with it.
    """
    statistic = _OF.get(kind)
    if statistic is None:
        return None
    own, seen, light = _levels(state, statistic, without, mean)
    if (light > 0).sum() < _LEAST or not own.any():
        return None
    alone = _gained(seen, own)
    others = [own * (light / light.max()) ** power for power in _POWERS]
    behind = max(_gained(seen, other) for other in others)
    beside = max(_gained(seen, own, other) for other in others)
    if behind - alone <= TOLD_APART or beside - behind > TOLD_APART:
        return None
    return rival(behind - alone, _WORDS[statistic])


def _levels(
    state: State, statistic: str, without: Array, mean: Array
) -> tuple[Array, Array, Array]:
    """Return what an effect changes, what is left without, and the signal: each by exposure."""
    signals = state.calibrated.fit.signal_dn
    found = []
    for i, key in enumerate(state.vector.keys):
        if key.statistic != statistic or key.scope != "exposure" or not state.null.known[i]:
            continue
        channels = [key.channel] if (key.exposure, key.channel) in signals else _GREENS
        if all((key.exposure, c) in signals for c in channels):
            light = max(float(np.mean([signals[key.exposure, c] for c in channels])), 0.0)
            left = state.vector.values[i] - without[i]
            found.append((mean[i] - without[i], left, light, float(state.null.sd[i])))
    changes, rest, lights, errors = np.array(found, np.float64).reshape(-1, 4).T
    usable = np.isfinite(changes) & np.isfinite(rest) & (errors > 0)
    return (changes / errors)[usable], (rest / errors)[usable], lights[usable]


def _gained(seen: Array, *shapes: Array) -> float:
    """Return the log-likelihood that shapes of any size gain together."""
    design = np.stack(shapes, 1)
    fitted = design @ np.linalg.lstsq(design, seen, rcond=None)[0]
    return float(fitted @ seen) / 2
