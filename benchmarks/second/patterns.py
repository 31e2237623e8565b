"""Fixed maps: one sensor is one draw. Templates have no unit."""

from collections.abc import Callable

import numpy as np

from second.geometry import Array, Case, Effect, coords, radial, stream

Template = Callable[[Case, Effect], Array]


def unit_map(case: Case, effect: Effect, shape: tuple[int, int]) -> Array:
    """Return a white map of standard deviation 1, with tails where the effect has a shape."""
    g = stream(case, "map", effect["kind"])
    n = g.standard_normal(shape)
    if effect.get("shape") == "exptail":  # Gaussian core plus a one-sided exponential tail
        n = (n + 0.6 * (g.exponential(1.0, shape) - 1)) / np.sqrt(1.36)
    elif effect.get("shape") == "laplace":
        n = 0.8 * n + 0.6 * g.laplace(0, 1 / np.sqrt(2), shape)
    return n


def shading_template(case: Case, effect: Effect) -> Array:
    """Return a fall-off: 0 in the centre, 1 in the farthest corner."""
    r2 = radial(case, *effect.get("centre", (0.5, 0.5)))
    if effect.get("law") == "cos4":
        t = 1 - 1 / (1 + 0.35 * r2) ** 2
        return t / t.max()
    return r2**1.5 if effect.get("law") == "r3" else r2


def glow_template(case: Case, effect: Effect) -> Array:
    """Return a glow: 1 at its edge or corner."""
    y, x = coords(case)
    h, w = case["h"], case["w"]
    side = effect["side"]
    d = {"left": x, "right": w - 1 - x, "top": y, "bottom": h - 1 - y}.get(side)
    if d is None:
        corners = {"tl": (0, 0), "tr": (0, w - 1), "bl": (h - 1, 0), "br": (h - 1, w - 1)}
        cy, cx = corners[side]
        d = np.hypot(y - cy, x - cx)
    length = effect["length"] * max(h, w)
    return np.exp(-d / length) if effect["law"] == "exp" else 1 / (1 + d / length)


def hot_map(case: Case, effect: Effect) -> Array:
    """Return rates in DN per second: an exact share of the pixels has one."""
    g = stream(case, "map", "hot")
    n = case["h"] * case["w"]
    u = g.random(n)
    chosen = np.argsort(u)[: max(1, round(effect["pixel_fraction"] * n))]
    if effect["law"] == "exp":
        rates = g.exponential(1.0, n)
    else:
        rates = np.exp(0.9 * g.standard_normal(n) - 0.405)
    m = np.zeros(n)
    m[chosen] = rates[chosen] * effect["mean_dn_per_s"]
    return m.reshape(case["h"], case["w"])


def tap_template(case: Case, effect: Effect) -> Array:
    """Return half of the difference of two amplifiers: -0.5 and 0.5."""
    y, x = coords(case)
    h, w = case["h"], case["w"]
    second = {
        "left_right": x >= effect["seam"] * w,
        "top_bottom": y >= effect["seam"] * h,
        "columns": x % 2 == 1,
        "rows": y % 2 == 1,
    }[effect["layout"]]
    return np.where(second, 0.5, -0.5)


def bistable_template(case: Case, effect: Effect) -> Array:
    """Return a sine or a square wave of two dimensions, -1 to 1."""
    y, x = coords(case)
    fx, fy = effect["frequency"]
    wave = np.cos(2 * np.pi * (fx * x + fy * y) + effect["phase"])
    return wave if effect["wave"] == "sine" else np.where(wave >= 0, 1.0, -1.0)


def dust_template(case: Case, effect: Effect) -> Array:
    """Return round shadows with soft edges."""
    y, x = coords(case)
    t = np.zeros((case["h"], case["w"]))
    for cy, cx, r, a in effect["specks"]:
        d = np.hypot(y - cy * case["h"], x - cx * case["w"])
        t += a / (1 + np.exp(np.clip((d - r) / (0.15 * r + 0.5), -40, 40)))
    return t


def cluster_mask(case: Case, effect: Effect) -> Array:
    """Return a round cluster of pixels that collect less, unevenly and with gaps."""
    y, x = coords(case)
    g = stream(case, "map", "cluster")
    d = np.hypot((y - effect["cy"] * case["h"]), (x - effect["cx"] * case["w"]))
    keep = (d < effect["radius"]) & (g.random(d.shape) < 0.85)
    return keep * (0.6 + 0.8 * g.random(d.shape))


def bloom_template(case: Case, effect: Effect) -> Array:
    """Return trails that decay downwards from hot pixels."""
    t = np.zeros((case["h"], case["w"]))
    for cy, cx, a in effect["spots"]:
        iy, ix = int(cy * case["h"]), int(cx * case["w"])
        n = case["h"] - iy - 1
        if n > 0:
            t[iy + 1 :, ix] += a * np.exp(-np.arange(n) / effect["length"])
    return t


def moire_template(case: Case, effect: Effect) -> Array:
    """Return a wave whose crests are bent."""
    y, x = coords(case)
    bend = effect["bend"] * np.sin(2 * np.pi * y / case["h"])
    return np.cos(2 * np.pi * (effect["fx"] * x + effect["fy"] * y) + effect["phase"] + bend)


def settle_template(case: Case, effect: Effect) -> Array:
    """Return a decay from the start of lines."""
    _, x = coords(case)
    return np.exp(-x / (effect["length"] * case["w"]))


def shutter_template(case: Case) -> Array:
    """Return a ramp down the rows."""
    y, _ = coords(case)
    return y / case["h"] - 0.5
