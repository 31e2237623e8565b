"""From voltages in DN above black to codes, and what a camera does to them in between."""

import numpy as np

from second.geometry import Array, Case, Effect, stream
from second.light import Effects

NEIGHBOURS = {
    "plus4": ((0, 1), (1, 0)),
    "horizontal": ((0, 1),),
    "box8": ((0, 1), (1, 0), (1, 1), (1, -1)),
}


def smoothed(v: Array, effect: Effect, step: int) -> Array:
    """Return what a kernel over neighbours of one colour leaves; `step` is their distance."""
    share, places = effect["fraction"], NEIGHBOURS[effect["mode"]]
    out = v.copy()
    rows, columns = v.shape[1:]
    for down, right in places:
        dy, dx = down * step, right * step
        ya, yb = slice(0, rows - dy), slice(dy, rows)
        xa, xb = slice(0, columns - dx), slice(dx, columns)
        if dx < 0:
            xa, xb = slice(-dx, columns), slice(0, columns + dx)
        d = (v[:, yb, xb] - v[:, ya, xa]) * (share / (2 * len(places)))
        out[:, ya, xa] += d
        out[:, yb, xb] -= d
    return out


def transitions(case: Case, effect: Effect) -> Array:
    """Return where each code begins: the rms of (width - 1) of codes in use is `rms_lsb`."""
    g = stream(case, "map", "dnl")
    n = case["white"] + 2
    k = np.arange(n)
    if effect["law"] == "random":
        error = g.standard_normal(n)
    elif effect["law"] == "interleaved":  # sub-ranging: one pattern repeats every 2^m codes
        period = 2 ** effect["bits"]
        error = np.tile(g.standard_normal(period), n // period + 1)[:n]
    else:  # wrong weights of bits, the upper ones' most
        error = np.zeros(n)
        for j in range(1, case["bits"]):
            error += ((k >> j) & 1) * g.standard_normal() * 2 ** (0.25 * j)
        error -= np.polyval(np.polyfit(k / n, error, 1), k / n)
    widths = np.diff(error)
    low, high = case["codes_used"]
    error = error * (effect["rms_lsb"] / np.sqrt(np.mean(widths[low:high] ** 2)))
    return np.maximum.accumulate(k - 0.5 + error)


def codes(case: Case, effects: Effects, v: Array, edges: Array | None) -> Array:
    """Return codes of voltages; `edges` are the converter's transitions where it is not ideal."""
    if e := effects.get("spatial_filtering"):
        v = smoothed(v, e, 1 if case["cfa"] == "MONO" else 2)
    if e := effects.get("companding"):
        a = np.sqrt(np.maximum(v + e["origin"], 0)) * e["scale"]
        v = (np.round(a) / e["scale"]) ** 2 - e["origin"]
    v = v + case["black"]
    coarse = effects.get("quantisation")
    if edges is not None:
        k = np.searchsorted(edges, v, side="right") - 1
    elif coarse:
        step, phase = coarse["step_dn"], coarse["phase"]
        k = np.round((v - phase) / step) * step + phase
    else:
        k = np.floor(v + 0.5)
    if coarse:
        step, phase = coarse["step_dn"], coarse["phase"]
        k = np.clip(k, phase, (case["white"] - phase) // step * step + phase)
    return np.clip(k, 0, case["white"]).astype(np.uint16)
