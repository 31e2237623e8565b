"""Tails and spreads that frames feign which are not equally noisy."""

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.framenoise import NAME as FRAME_NOISE
from analysis.mismatch.burst import TAILS
from analysis.mismatch.contradicted import Denial
from analysis.mismatch.feignedtails import seen_along
from analysis.mismatch.layout import Place
from analysis.mismatch.leftopen import left_open
from analysis.mismatch.resolved import CLEAR
from analysis.mismatch.state import State

Array = NDArray[np.float64]
_SPREAD, _PERSISTENT = "read_noise_spread", "variance_persistence"
_STATISTICS = {"kurtosis": TAILS, "variance_spread": frozenset({_SPREAD})}
_MOST = 0.5  # of what an effect would explain, that frames may feign


def unequally_noisy(state: State, kind: str, without: Array) -> Denial | None:
    """Return how tails, or pixels that differ in noise, are denied by frames that do; None: not.

    Samples of frames whose variances have a relative variance f are as far out as ones of an excess
    kurtosis of 3 f, and no sample has tails; variances over n such frames scatter by
    1 + f (n - 2) / (n - 1) times as much, and no pixel is noisier than others. Told is f of pairs
    of frames: of a slow change as much, of single noisy frames half. Where that frames differ is
    left unexplained, and makes half of what the effect would explain, there may be none;
    unless the same pixels are noisier in all exposures, by half of what is claimed.

    Parameters
    ----------
    state
        With the effect.
    kind
        The effect.
    without
        The numbers predicted without it.
    """
    name = next((one for one, kinds in _STATISTICS.items() if kind in kinds), None)
    apart = {} if name is None else _apart(state)
    if name is None or not apart:
        return None
    frames = {e.name: len(e.numbers) for e in state.setting.layout.uniform}
    along = square = 0.0
    for i, key in enumerate(state.vector.keys):
        known = state.null.known[i] and np.isfinite(without[i])
        if key.statistic != name or key.scope != "exposure" or not known:
            continue
        if key.place not in state.setting.seen.levels:
            continue
        n = frames[key.exposure]
        f = apart.get(key.place, 0.0) * (1 - 1 / max(n // 2, 1))  # of these pairs, not of any
        fake = 3 * f if name == "kurtosis" else float(np.log1p(f * (n - 2) / (n - 1)))
        claimed = float(state.null.mean[i] - without[i]) / float(state.null.sd[i])
        along += claimed * fake / float(state.null.sd[i])
        square += claimed**2
    if square <= 0 or along < _MOST * square or (kind == _SPREAD and _persists(state, without)):
        return None
    why = "frames are not equally noisy, which spreads samples as well"
    return Denial(max(1 - along / square, 0.0), why)


def _apart(state: State) -> dict[Place, float]:
    """Return the relative variance of pairs' variances beyond chance, where it is left open."""
    layout = state.setting.layout
    step = 1 + (len(layout.sites) > 1)
    free = (layout.rows // step - 1) * (layout.columns // step - 1)
    expected = {
        key.place: float(mean)
        for key, mean in zip(state.vector.keys, state.null.mean, strict=True)
        if key.statistic == FRAME_NOISE and key.scope == "exposure"
    }
    return {
        place: max((expected[place] + rest) ** 3 - expected[place] ** 3, 0.0) * 2 / free
        for (place, _), (rest, _) in left_open(state, (FRAME_NOISE,)).items()
    }


def _persists(state: State, without: Array) -> bool:
    """Return whether pixels are noisy in every exposure as an effect has it, surely, by half."""
    own = np.array([key.statistic == _PERSISTENT for key in state.vector.keys])
    own &= state.null.known & np.isfinite(without)
    size, along = seen_along(state, without, own)
    return size > 0 and along >= max(CLEAR, _MOST * size)
