"""Tails that pixels feign whose noise differs, the same in every exposure."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.contradicted import Denial
from analysis.mismatch.resolved import FAR_OFF
from analysis.mismatch.state import State
from dsis.measures.moments import kept

Array = NDArray[np.float64]
_MOST = 0.5  # of tails that would be explained, that pixels may feign


def persisting(state: State, kind: str, without: Array) -> Denial | None:
    """Return how heavy tails are denied by pixels that are noisy in every exposure; None: not.

    Samples of pixels whose variances have a relative spread V are as far out as ones of an excess
    kurtosis of 3 V, and no pixel has tails. What such spreads have in common in several exposures
    is no matter of tails, which make variances differ anew. Where that is left unexplained, it is
    the spread of the very noise whose tails are claimed, and makes half of these, and single
    pixels show no more than half of them, either, there may be none. Nor are there spikes where it
    is far from explained: they are few, and so are pixels that come back. `without` are the numbers
    predicted without the tails.
    """
    called = {m.statistic: m.z for m in state.mismatches}
    if kind == "impulse" and called.get("variance_persistence", 0.0) > FAR_OFF:
        return Denial(0.0, "samples far out are those of the same pixels in every exposure")
    if kind != "heavy_tailed_read_noise" or "variance_persistence" not in called:
        return None
    fake = _feigned(state, _claimed(state, "kurtosis", without))
    own = _claimed(state, "kurtosis_within_pixels", without)
    square = sum(change**2 for change, _ in own.values())
    if square <= 0 or fake <= _MOST:
        return None
    share = sum(change * seen for change, seen in own.values()) / square
    if share >= _MOST:
        return None
    why = "some pixels are noisier than others in every exposure, and feign tails"
    return Denial(max(share, 0.0), why)


def _claimed(
    state: State, statistic: str, without: Array
) -> dict[tuple[str, str], tuple[float, float]]:
    """Return what tails would change, and what is to be explained, in standard deviations."""
    levels = state.setting.seen.levels
    return {
        key.place: (
            float(state.null.mean[i] - without[i]) / float(state.null.sd[i]),
            float(state.vector.values[i] - without[i]) / float(state.null.sd[i]),
        )
        for i, key in enumerate(state.vector.keys)
        if key.statistic == statistic and key.scope == "exposure" and key.place in levels
        if state.null.known[i] and np.isfinite(without[i])
    }


def _feigned(state: State, claimed: dict[tuple[str, str], tuple[float, float]]) -> float:
    """Return the share of the tails' kurtosis that persistent spreads make, of all channels.

    Noise that is a share f of a pixel's has tails, and a spread, of f^2: the kurtosis of each
    exposure, as claimed, says how its spread compares with others.
    """
    along = square = 0.0
    for weights, kurtosis, noise, rest in _channels(state, claimed):
        shape = weights * np.sqrt(np.maximum(kurtosis, 0.0))
        products = float(shape.sum() ** 2 - (shape**2).sum())
        along += rest * products / noise
        square += (products / noise) ** 2
    if square <= 0:
        return 0.0
    return 3 * along / square


def _channels(
    state: State, claimed: dict[tuple[str, str], tuple[float, float]]
) -> Iterator[tuple[Array, Array, float, float]]:
    """Yield weights and kurtoses of a channel's exposures, the error of the sum, and the sum.

    The sum is over products of spreads of different exposures, in errors: see `VarianceSums`. Of
    residuals about a mean, cumulants are fewer than of the noise: kurtoses are those of a spread
    that would look alike.
    """
    layout, vector = state.setting.layout, state.vector
    step = 1 + (len(layout.sites) > 1)
    n, m = layout.rows // step, layout.columns // step
    spreads = {
        key.place: float(np.exp(value))
        for key, value in zip(vector.keys, vector.values, strict=True)
        if key.statistic == "variance_spread" and key.scope == "exposure"
    }
    sd = {
        key.place: float(own)
        for key, own in zip(vector.keys, state.null.sd, strict=True)
        if key.statistic == "kurtosis" and key.scope == "exposure"
    }
    for i, key in enumerate(vector.keys):
        if key.statistic != "variance_persistence" or not state.null.known[i]:
            continue
        found = []
        for exposure in layout.uniform:
            place, frames = (exposure.name, key.channel), len(exposure.numbers)
            if place not in claimed or not np.isfinite(spreads.get(place, np.nan)):
                continue
            weight = (frames - 1) / layout.variance_dn2[place]
            loss = kept(frames, n, m, 4) / kept(frames, n, m, 2) ** 2
            kurtosis = claimed[place][0] * sd[place] * loss
            found.append((weight, kurtosis, weight**2 * spreads[place]))
        if len(found) > 1:
            weights, kurtoses, squares = np.array(found).T
            noise = 2 * (squares.sum() ** 2 - (squares**2).sum()) / (n * m)
            left = float(vector.values[i] - state.null.mean[i])
            yield weights, kurtoses, float(noise**0.5), left
