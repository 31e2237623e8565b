"""Charge: how it is counted, hit, left behind, shared with neighbours and cut. In DN."""

import numpy as np

from second.geometry import Array, Case, Effect, stream
from second.light import Effects


def collected(case: Case, effects: Effects, exposure: int, expected: Array, slope: Array) -> Array:
    """Return charge with shot noise of variance slope x signal."""
    if case["shot"] == "poisson" or "poisson_shot_noise" in effects:
        return slope * stream(case, "poisson", exposure).poisson(expected / slope)
    noise = stream(case, "shot", exposure).standard_normal(expected.shape)
    return expected + np.sqrt(slope * expected) * noise


def moved(
    case: Case, effects: Effects, exposure: int, charge: Array, still: tuple[Array, Array]
) -> Array:
    """Return what particles, lag, neighbours and the full well make of the charge.

    `still` is the first frame's expected charge and its slope.
    """
    q = charge
    if e := effects.get("impulse"):
        q = _hit(case, e, exposure, q)
    if e := effects.get("image_lag"):
        q = _lagged(case, e, exposure, q, still)
    if e := effects.get("crosstalk"):
        q = _exchanged(q, *(e["fraction"] if e["mode"] != other else None for other in _OTHER))
    if e := effects.get("brighter_fatter"):
        q = _exchanged(q, e["per_dn"] * e["ratio"], e["per_dn"] / e["ratio"], grows=True)
    if e := effects.get("saturation"):
        full = e["full_well_dn"]
        if e["law"] == "hard":
            q = np.minimum(q, full)
        else:
            k = e["soft"] * full
            q = full - k * np.logaddexp(0, (full - q) / k)
    return q


_OTHER = ("columns", "rows")  # which mode has no exchange along rows, and along columns


def _hit(case: Case, effect: Effect, exposure: int, charge: Array) -> Array:
    g = stream(case, "impulse", exposure)
    h, w = case["h"], case["w"]
    q = charge.copy()
    for t in range(len(q)):
        for _ in range(g.poisson(effect["per_megapixel_frame"] * h * w * 1e-6)):
            y, x = g.integers(h), g.integers(w)
            a = effect["floor_dn"] + g.exponential(effect["mean_dn"])
            q[t, y, x] += a
            if effect["tracks"] and g.random() < 0.5:
                q[t, min(y + 1, h - 1), min(x + g.integers(2), w - 1)] += 0.5 * a
    return q


def _lagged(
    case: Case, effect: Effect, exposure: int, charge: Array, still: tuple[Array, Array]
) -> Array:
    f, (expected, slope) = effect["fraction"], still
    q = charge.copy()
    g = stream(case, "lag", exposure)
    if effect["start"] == "steady":  # frames before the first one were alike
        spread = np.sqrt(slope * expected * (1 - f) / (1 + f))
        before = expected + spread * g.standard_normal(expected.shape)
    else:  # the light went on with the first frame
        dark = case["exposures"][exposure]["kind"] == "dark"
        before = expected if dark else np.zeros(expected.shape)
    for t in range(len(q)):
        q[t] = (1 - f) * q[t] + f * before
        before = q[t]
    return q


def _exchanged(
    charge: Array, along_rows: float | None, along_columns: float | None, *, grows: bool = False
) -> Array:
    """Return what pairs of neighbours make of their charge: none is lost.

    Of their difference a share is exchanged; where it `grows`, the share is per DN of their mean.
    """
    out = charge.copy()
    for axis, share in ((2, along_rows), (1, along_columns)):
        if share is None:
            continue
        first, second = [slice(None)] * 3, [slice(None)] * 3
        first[axis], second[axis] = slice(None, -1), slice(1, None)
        a, b = charge[tuple(first)], charge[tuple(second)]
        flow = share * (a - b) * np.maximum(a + b, 0) / 2 if grows else share * (a - b)
        out[tuple(first)] -= flow
        out[tuple(second)] += flow
    return out
