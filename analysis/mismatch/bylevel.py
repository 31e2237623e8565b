"""Whether what calls for an effect follows its law from level to level, or another.

Photons that are counted skew noise the less the more they are; amplifiers of two greens are apart
by the same share at any light. What grows with light faster than that is something else, whose sum
over the levels an effect of fitted size explains in part.
"""

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.basefit import CLIPPED_SHARE
from analysis.mismatch.contradicted import Denial, rival
from analysis.mismatch.predict import form_errors
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
_POWERS = (1.0, 1.5, 2.0, 3.0)  # of the signal, by which something else grows faster
_LEAST = 3  # exposures with light
_SEEN = 3.0  # standard errors: a change that numbers can show
_NEAR = 2.0  # standard errors of a size that is as predicted


def otherwise_by_level(state: State, kind: str, without: Array, mean: Array) -> Denial | None:
    """Return how an effect is denied by the levels that show what it makes; None: it is not.

    Least squares of what is left open without it, by what the effect changes there, of any size
    but none below zero, and by the same times a power of the signal: a lower one than the first is
    no other law, the form of an effect is known no better. Denied is the effect where
    such a power is likelier at odds of 20, and the effect beside it is not needed at such odds, nor
    of its own size within two errors. Of changes that no level shows nothing is said.

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
    own, seen, light, exposures = _levels(state, statistic, without, mean)
    if len(set(exposures)) < _LEAST or np.linalg.norm(own) < _SEEN:
        return None
    alone = _gained(seen, own)[0]
    others = [own * (light / light.max()) ** power for power in _POWERS]
    behind = max(_gained(seen, other)[0] for other in others)
    beside, size, error = max(_gained(seen, own, other) for other in others)
    if behind - alone <= TOLD_APART or beside - behind > TOLD_APART:
        return None
    if abs(size - 1) < _NEAR * error:
        return None
    return rival(behind - alone, _WORDS[statistic])


def _levels(
    state: State, statistic: str, without: Array, mean: Array
) -> tuple[Array, Array, Array, list[str]]:
    """Return what an effect changes, what is left without, the signal, and the exposure: of each.

    In standard errors, with what is allowed for the form of the change; where there is light that
    is not cut off.
    """
    forms = form_errors(state.vector.keys)
    signals, levels = state.calibrated.fit.signal_dn, state.setting.seen.levels
    found, names = [], []
    for i, key in enumerate(state.vector.keys):
        if key.statistic != statistic or key.scope != "exposure" or not state.null.known[i]:
            continue
        channels = [key.channel] if (key.exposure, key.channel) in signals else _GREENS
        places = [(key.exposure, c) for c in channels if (key.exposure, c) in signals]
        light = float(np.mean([signals[place] for place in places])) if places else 0.0
        clipped = any(levels[place].clipped_high > CLIPPED_SHARE for place in places)
        change, left = (float(one[i] - without[i]) for one in (mean, state.vector.values))
        if light > 0 and not clipped and np.isfinite(change) and np.isfinite(left):
            error = float(np.hypot(state.null.sd[i], forms[i] * change))
            found.append((change / error, left / error, light))
            names.append(key.exposure)
    changes, rest, lights = np.array(found, np.float64).reshape(-1, 3).T
    return changes, rest, lights, names


def _gained(seen: Array, own: Array, *others: Array) -> tuple[float, float, float]:
    """Return the log-likelihood that shapes gain together, and size and error of the first.

    Of the first none below zero.
    """
    design = np.stack((own, *others), 1)
    sizes = np.linalg.lstsq(design, seen, rcond=None)[0]
    error = float(np.linalg.pinv(design.T @ design)[0, 0]) ** 0.5
    if sizes[0] < 0:
        return (_gained(seen, *others)[0] if others else 0.0), 0.0, error
    return float(design @ sizes @ seen) / 2, float(sizes[0]), error
