"""What covariances of neighbours take from variances: a bend that charge shared by pixels makes."""

from collections.abc import Callable, Mapping
from functools import partial

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.contradicted import Denial
from analysis.mismatch.layout import Place
from analysis.mismatch.leftopen import Left, left_open
from analysis.mismatch.resolved import FAR_OFF
from analysis.mismatch.sharing import of_charge
from analysis.mismatch.state import State
from analysis.mismatch.straight import curves, misfits, upwards

Array = NDArray[np.float64]
_PAIRS = {"correlation_0_1": 2, "correlation_1_0": 2, "correlation_1_1": 4}
"""How many neighbours of a pixel a correlation is that of."""
_FRAMES = "frame_correlation"
_ADJACENT = ("correlation_0_1", "correlation_1_0")
_GRAINS = np.geomspace(1.0, 8.0, 13)  # inverse correlations of neighbours in what they share
_LEAST = 0.05  # of a variance is other noise
_MOST = 0.5  # of a misfit, that something else may make
_FAR_WORSE, _SURE = 10.0, 2.0  # times a misfit, and one that chance makes


def of_neighbours(state: State, mean: Array) -> Denial | None:
    """Return how a bend is denied by pixels that share what they collect; None: it is not.

    Charge that is shared is not lost: the variance of sums over pixels, v (1 + sum of correlations
    with all neighbours), remains, whatever the law by which it is shared. Where variances are off
    by far more with that than with the bend, it is not what they lack. `mean` are the numbers
    predicted with the bend.
    """
    left = left_open(state, _PAIRS)
    if not left:
        return _of_charge(state)
    factors: dict[Place, float] = {}
    for (place, statistic), (rest, _) in left.items():
        factors[place] = factors.get(place, 1.0) + _PAIRS[statistic] * rest
    why = "neighbours are alike for another reason, and have as covariance what variances lack"
    denial = straightened(state, factors.get, why)
    if denial is not None and _far_worse(state, mean, factors, left):
        denial = None
    return denial or _of_grains(state, left) or _of_charge(state)


def of_frames(state: State) -> Denial | None:
    """Return how a bend is denied by frames that are alike; None: it is not.

    A filter over frames lessens variances: of noise that follows itself by a share r from frame to
    frame, the variance of sums over frames, v (1 + r) / (1 - r), remains (an autoregression of the
    first order; Box & Jenkins, 1970). Where that is left unexplained, and variances times it lie on
    lines, it is what they lack.
    """
    left = left_open(state, (_FRAMES,))
    factors = {place: (1 + r) / (1 - r) for (place, _), (r, _) in left.items() if -1 < r < 1}
    why = (
        "successive frames are alike for another reason, and have as covariance what variances lack"
    )
    return straightened(state, factors.get, why) if factors else None


def _far_worse(state: State, mean: Array, factors: Mapping[Place, float], left: Left) -> bool:
    """Return whether variances times factors lie far worse on lines than a bend foretells them.

    By chi-squared of both, beside what the errors of correlations make of factors.
    """
    own = np.array([key.statistic == "pixel_variance" for key in state.vector.keys])
    own &= np.array([key.scope == "exposure" for key in state.vector.keys])
    own &= state.null.known & np.isfinite(mean)
    bent = float((((state.vector.values - mean)[own] / state.null.sd[own]) ** 2).sum())
    unsure: dict[Place, float] = {}
    for (place, statistic), (_, sd) in left.items():
        unsure[place] = unsure.get(place, 0.0) + (_PAIRS[statistic] * sd) ** 2
    chance = sum(
        float(weight[i]) * unsure.get(place, 0.0)
        for _, _, weight, places in curves(state)
        for i, place in enumerate(places)
    )
    after = misfits(state, factors.get, beside=True)[1]
    return after - _SURE * chance > _FAR_WORSE * bent


def _of_grains(state: State, left: Left) -> Denial | None:
    """Return how a bend is denied by noise that neighbours share as it grows; None: it is not.

    Noise on top of all other, in grains of some pixels - of light that interferes, say - adds to
    variances k times the covariance of pixels side by side, 1 / k its own correlation. It goes with
    the square of the signal, see `upwards`.
    """
    if not upwards(state):
        return None
    shared = _shared_squared(state, left)
    why = "neighbours are alike, and what they share makes variances grow"
    found = [straightened(state, partial(_less, shared, k), why) for k in _GRAINS]
    return min((one for one in found if one), key=lambda one: one.share, default=None)


def _shared_squared(state: State, left: Left) -> dict[Place, float]:
    """Return the share of each variance that neighbours along rows or columns have in common.

    Their covariances are fitted, all places together, by the square of the signal: the correlations
    of single places are noisy. A direction along which nothing is shared for certain has none.
    """
    levels, signals = state.setting.seen.levels, state.calibrated.fit.signal_dn
    found: dict[Place, float] = {}
    for direction in _ADJACENT:
        own = {at: one for (at, name), one in left.items() if name == direction and at in signals}
        squares = np.array([signals[at] ** 2 / levels[at].variance_dn2 for at in own])
        rest, sd = np.array(list(own.values())).reshape(-1, 2).T
        weight = float(((squares / sd) ** 2).sum())
        if weight <= 0 or (rate := float((squares * rest / sd**2).sum()) / weight) < (
            FAR_OFF / weight**0.5
        ):
            continue
        for at, square in zip(own, squares.tolist(), strict=True):
            found[at] = max(found.get(at, 0.0), rate * square)
    return found


def _less(shared: Mapping[Place, float], times: float, at: Place, usual: float) -> float:
    """Return which share of a variance is left without what is shared, so many times."""
    return max(usual - times * shared.get(at, 0.0), _LEAST)


def _of_charge(state: State) -> Denial | None:
    """Return how a bend is denied by pixels that share the more the brighter; None: it is not.

    Of correlations that are not certain one by one, or that crosstalk of the camera explains as
    well: by the law that they follow, see `sharing`.
    """
    shared = of_charge(state)
    why = "neighbours are alike the more the brighter, and have as covariance what variances lack"
    return straightened(state, shared, why) if shared is not None else None


def straightened(state: State, factor: Callable[[Place, float], float], why: str) -> Denial | None:
    """Return how a bend is denied where variances times a factor lie on lines; None: not.

    Beyond what chance makes them misfit.
    """
    chance = sum(signal.size - 2 for signal, *_ in curves(state))
    before, after = (max(one - chance, 0.0) for one in misfits(state, factor, beside=True))
    if before <= 0 or after > _MOST * before:
        return None
    return Denial(after / before, why)
