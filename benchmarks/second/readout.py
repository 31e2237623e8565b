"""Read-out: from charge to a voltage in DN above black, before anything is digital."""

from dataclasses import dataclass

import numpy as np

from second import patterns
from second.geometry import Array, Case, Effect, coords, radial, stream
from second.light import Effects
from second.wander import blinking, phases, pink, series


@dataclass(frozen=True)
class Sensor:
    """What one sensor keeps through all exposures, and what runs on from one to the next."""

    offset: Array
    drift: Array | None
    blinking: tuple[Array, Array] | None
    spread: Array | None

    @classmethod
    def of(cls, case: Case, effects: Effects) -> "Sensor":
        """Draw it."""
        drift, rts, spread = None, None, None
        if e := effects.get("black_level_drift"):
            drift = e["sigma_dn"] * series(case, e)
        if e := effects.get("rts"):
            rts = blinking(case, e)
        if e := effects.get("read_noise_spread"):
            s = e["log_sigma"]
            k = stream(case, "map", "spread").standard_normal((case["h"], case["w"]))
            spread = np.exp(s * k - s * s)  # the mean variance is kept
        return cls(_fixed_offset(case, effects), drift, rts, spread)


def _fixed_offset(case: Case, effects: Effects) -> Array:
    h, w = case["h"], case["w"]
    offset = np.zeros((h, w))
    for kind, shape in (("dsnu", (h, w)), ("row_fpn", (h, 1)), ("column_fpn", (1, w))):
        if e := effects.get(kind):
            offset = offset + e["sigma_dn"] * patterns.unit_map(case, e, shape)
    if e := effects.get("line_start_settling"):
        offset = offset + e["amplitude"] * patterns.settle_template(case, e)
    return offset


def bend(case: Case, effect: Effect, v: Array) -> Array:
    """Return a bent response.

    Its largest deviation from the chord between black and 85 % of full scale is
    `percent_full_scale` of full scale.
    """
    full = case["white"] - case["black"]
    u = np.maximum(v, 0) / (0.85 * full)
    law = effect["law"]
    if law == "quadratic":
        s = 4 * u * (1 - u)
    elif law == "cubic":
        s = u * (1 - u) * (1 + u) * (3 * np.sqrt(3) / 2)
    elif law == "gamma":
        p = 0.8
        m = p ** (1 / (1 - p))
        s = ((u + 1e-3) ** p - 1e-3**p - u * (1.001**p - 1e-3**p)) / (m**p - m)
    else:  # straight, then a smooth roll-off
        ends = _knee(np.array([0.0, 1.0]))
        grid = np.linspace(0, 1, 400)
        deviation = _knee(grid) - ends[0] - grid * (ends[1] - ends[0])
        s = (_knee(u) - ends[0] - u * (ends[1] - ends[0])) / deviation.max()
    return v + effect["sign"] * effect["percent_full_scale"] / 100 * full * s


def _knee(z: Array) -> Array:
    begins, width = 0.6, 0.08
    return -width * np.logaddexp(0, (z - begins) / width)


def read(
    case: Case,
    effects: Effects,
    sensor: Sensor,
    exposure: int,
    charge: Array,
    expected: Array,
    intercept: Array,
) -> Array:
    """Return one exposure's voltages of their charge."""
    first = sum(e["n"] for e in case["exposures"][:exposure])
    frames = slice(first, first + len(charge))
    v = _responded(case, effects, charge, expected)
    v = v + np.sqrt(intercept) * _read_noise(case, effects, sensor, exposure, v.shape)
    if e := effects.get("double_frames"):
        v = _doubled(v, expected, e["correlation"])
    if sensor.blinking is not None:
        pixels, states = sensor.blinking
        shape = v.shape
        v = v.reshape(len(v), -1).copy()
        v[:, pixels] += effects["rts"]["amplitude_dn"] * states[frames]
        v = v.reshape(shape)
    v = _amplified(case, effects, exposure, v)
    v = v + sensor.offset
    v = _with_lines(case, effects, exposure, v)
    v = _with_patterns(case, effects, exposure, v)
    if sensor.drift is not None:
        v = v + sensor.drift[frames, None, None]
    return _with_parts(case, effects, exposure, v)


def _responded(case: Case, effects: Effects, charge: Array, expected: Array) -> Array:
    v = charge
    if e := effects.get("nonlinearity"):
        v = bend(case, e, v)
    if e := effects.get("dual_gain_mismatch"):
        switch, error = case["segments"][0]["upper_dn"], e["gain_error_percent"] / 100
        other = v * (1 + error) if e["law"] == "step" else v + error * (v - switch)
        v = np.where(expected >= switch, other, v)
    return v


def _read_noise(
    case: Case, effects: Effects, sensor: Sensor, exposure: int, shape: tuple[int, ...]
) -> Array:
    n = stream(case, "read", exposure).standard_normal(shape)
    if e := effects.get("heavy_tailed_read_noise"):
        df = e["tail_df"]
        n = n / np.sqrt(stream(case, "tail", exposure).chisquare(df, shape) / (df - 2))
    if sensor.spread is not None:
        n = n * sensor.spread
    if e := effects.get("read_noise_vignetting"):
        n = n * (1 + e["rise"] * radial(case))
    return n


def _doubled(v: Array, expected: Array, r: float) -> Array:
    d = v - expected
    v = v.copy()
    for t in range(1, len(v), 2):
        v[t] = expected[t] + r * d[t - 1] + np.sqrt(1 - r * r) * d[t]
    return v


def _amplified(case: Case, effects: Effects, exposure: int, v: Array) -> Array:
    if e := effects.get("tap_mismatch"):
        v = v * (1 + e["gain_percent"] / 100 * patterns.tap_template(case, e))
    if e := effects.get("column_gain_drift"):
        g = stream(case, "cgd", exposure).standard_normal((len(v), 1, case["w"]))
        v = v * (1 + e["slope"] * g * (np.arange(case["h"])[None, :, None] / case["h"]))
    if e := effects.get("readout_memory"):
        k, f = e["lag_pixels"], e["fraction"]
        u = v.copy()
        if e["axis"] == "row":
            u[:, :, k:] += f * (v[:, :, :-k] - v[:, :, k:])
        else:
            u[:, k:, :] += f * (v[:, :-k, :] - v[:, k:, :])
        v = u
    return v


def _with_lines(case: Case, effects: Effects, exposure: int, v: Array) -> Array:
    frames, h, w = v.shape
    if e := effects.get("row_noise"):
        g = stream(case, "rown", exposure)
        v = v + e["sigma_dn"] * g.standard_normal((frames, h, 1))
    if e := effects.get("column_noise"):
        g = stream(case, "coln", exposure)
        v = v + e["sigma_dn"] * g.standard_normal((frames, 1, w))
    if e := effects.get("pink_noise"):
        v = v + e["sigma_dn"] * pink(case, e, exposure, frames)
    return v


def _with_patterns(case: Case, effects: Effects, exposure: int, v: Array) -> Array:
    frames = len(v)
    if e := effects.get("periodic_noise"):
        y, x = coords(case)
        angle = 2 * np.pi * (e["frequency"][0] * x + e["frequency"][1] * y)
        phase = phases(case, e, exposure, frames)[:, None, None]
        v = v + e["amplitude_dn"] * np.cos(angle[None] + phase)
    if e := effects.get("bistable_pattern"):
        s = np.where(stream(case, "bist", exposure).random(frames) < 0.5, -1.0, 1.0)
        if abs(s.sum()) == frames:  # of one sign throughout it would be a fixed pattern
            s[frames // 2] *= -1
        v = v + e["amplitude_dn"] * s[:, None, None] * patterns.bistable_template(case, e)
    return v


def _with_parts(case: Case, effects: Effects, exposure: int, v: Array) -> Array:
    frames, h, w = v.shape
    if e := effects.get("half_frame_alternation"):
        sign = np.where(np.arange(frames) % 2, 1, -1)[:, None, None]
        v = v + e["step_dn"] / 2 * sign * (np.arange(h) < h // 2)[None, :, None]
    if e := effects.get("block_offset_noise"):
        b = e["block"]
        g = stream(case, "blk", exposure).standard_normal((frames, -(-h // b), -(-w // b)))
        v = v + e["sigma"] * np.repeat(np.repeat(g, b, 1), b, 2)[:, :h, :w]
    if e := effects.get("column_telegraph"):
        columns = (np.array(e["columns"]) * w).astype(int)
        s = stream(case, "ctel", exposure).random((frames, len(columns))) < 0.4
        v = v.copy()
        v[:, :, columns] += e["step_dn"] * s[:, None, :]
    return v
