"""Light and heat: the expected charge of every pixel, in DN above black."""

import numpy as np

from second import patterns
from second.geometry import Array, Case, Effect, coords, planes, response, scene_at, stream
from second.wander import phases

Effects = dict[str, Effect]


def fixed_gain(case: Case, effects: Effects) -> Array:
    """Return each pixel's share of the light that falls on it."""
    h, w = case["h"], case["w"]
    gain = np.ones((h, w))
    if e := effects.get("shading"):
        gain = gain * (1 - e["falloff_percent"] / 100 * patterns.shading_template(case, e))
    if e := effects.get("dust_shadows"):
        gain = gain * (1 - e["depth"] * patterns.dust_template(case, e))
    if e := effects.get("prnu"):
        gain = gain * (1 + e["sigma_percent"] / 100 * patterns.unit_map(case, e, (h, w)))
    if e := effects.get("channel_imbalance"):
        p = planes(case)
        gain[p["Gr"]] *= 1 + e["gain_percent"] / 200
        gain[p["Gb"]] *= 1 - e["gain_percent"] / 200
    if e := effects.get("cluster_defect"):
        gain = gain * (1 - e["loss"] * patterns.cluster_mask(case, e))
    return gain


def thermal_rate(case: Case, effects: Effects) -> Array:
    """Return thermal charge in DN per second."""
    rate = np.zeros((case["h"], case["w"]))
    if e := effects.get("dark_current"):
        rate = rate + e["dn_per_s"]
    if e := effects.get("hot_pixels"):
        rate = rate + patterns.hot_map(case, e)
    if e := effects.get("amp_glow"):
        rate = rate + e["dn_per_s"] * patterns.glow_template(case, e)
    return rate


def light(case: Case, effects: Effects, exposure: int, lamp: Array | None) -> Array:
    """Return the light of an exposure's frames, one for all where they are alike.

    `lamp` is the relative change of the light, per frame of this exposure.
    """
    ex = case["exposures"][exposure]
    if ex["kind"] == "dark":
        return np.zeros((1, case["h"], case["w"]))
    lit = _flat(case, effects, ex) if ex["kind"] == "flat" else _scene(case, effects, exposure)
    if lamp is not None:
        lit = lit * (1 + lamp)[:, None, None]
    if e := effects.get("line_flicker"):
        rows = np.arange(case["h"])[None, :, None]
        angle = 2 * np.pi * e["cycles_per_frame"] * rows / case["h"]
        phase = phases(case, e, exposure, ex["n"])[:, None, None]
        lit = lit * (1 + e["depth_percent"] / 100 * np.sin(angle + phase))
    if e := effects.get("speckle_light"):
        g = stream(case, "speckle", exposure)
        s = g.gamma(2.0, 1.0, (ex["n"], case["h"] + 1, case["w"] + 1)) - 2.0
        s = (s[:, 1:, 1:] + s[:, :-1, 1:] + s[:, 1:, :-1] + s[:, :-1, :-1]) / np.sqrt(8)
        lit = lit * (1 + e["contrast"] * s)
    return lit


def _flat(case: Case, effects: Effects, ex: dict) -> Array:
    lit = (ex["level"] * response(case))[None]
    if e := effects.get("display_moire"):
        lit = lit * (1 + e["depth"] * patterns.moire_template(case, e))
    if e := effects.get("shutter_gradient"):
        lit = lit * (1 + e["delay_s"] / ex["time"] * patterns.shutter_template(case))
    return lit


def _scene(case: Case, effects: Effects, exposure: int) -> Array:
    ex, (y, x) = case["exposures"][exposure], coords(case)
    if e := effects.get("scene_jitter"):
        moves = e["rms_px"] * stream(case, "jitter", exposure).standard_normal((ex["n"], 2))
        still = np.stack([scene_at(case, y + a, x + b) for a, b in moves])
    elif e := effects.get("vibration"):
        starts = stream(case, "vib", exposure).uniform(0, 2 * np.pi, ex["n"])
        angle = 2 * np.pi * e["cycles"] * y / case["h"]
        still = np.stack(
            [scene_at(case, y, x + e["amplitude_px"] * np.sin(angle + p)) for p in starts]
        )
    else:
        return (ex["level"] * scene_at(case, y, x) * response(case))[None]
    return still * ex["level"] * response(case)


def expected_charge(case: Case, effects: Effects, exposure: int, lit: Array, rate: Array) -> Array:
    """Return the charge that is expected in each frame, of light collected and of heat."""
    ex = case["exposures"][exposure]
    frames = ex["n"]
    c = lit + (rate * ex["time"])[None]
    if e := effects.get("dark_temperature_ramp"):
        course = np.arange(frames) / max(frames - 1, 1) - 0.5
        c = c + (e["swing_dn_per_s"] * ex["time"] * course)[:, None, None]
    if e := effects.get("blooming_trail"):
        c = c + (e["dn_per_s"] * ex["time"] * patterns.bloom_template(case, e))[None]
    if (e := effects.get("horizontal_smear")) and ex["kind"] == "scene":
        bright = np.maximum(c - e["threshold"], 0).sum(2, keepdims=True)
        c = c + e["fraction"] * bright / case["w"]
    return np.broadcast_to(np.maximum(c, 0), (frames, case["h"], case["w"]))
