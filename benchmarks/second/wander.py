"""What wanders in time: phases, series over frames, blinking pixels, 1/f noise."""

import numpy as np

from second.geometry import Array, Case, Effect, stream


def phases(case: Case, effect: Effect, exposure: int, frames: int) -> Array:
    """Return a phase per frame in radians: free, or beating of mains against the frame rate."""
    g = stream(case, "phase", effect["kind"], exposure)
    if effect.get("phase_law") == "beat":
        beat = 2 * np.pi * effect["beat"] * np.arange(frames)
        return g.uniform(0, 2 * np.pi) + beat + 0.15 * g.standard_normal(frames)
    return g.uniform(0, 2 * np.pi, frames)


def series(case: Case, effect: Effect) -> Array:
    """Return one value per frame of the recording in file order, of standard deviation 1."""
    n = sum(e["n"] for e in case["exposures"])
    g = stream(case, "series", effect["kind"]).standard_normal(n)
    law = effect.get("law", "white")
    if law == "ar1":
        a = effect["ar"]
        out = np.empty(n)
        out[0] = g[0]
        for k in range(1, n):
            out[k] = a * out[k - 1] + np.sqrt(1 - a * a) * g[k]
        return out
    if law == "sawtooth":  # warms up; the clamp arms again every `period` frames
        r = np.sqrt(12) * ((np.arange(n) % effect["period"]) / (effect["period"] - 1) - 0.5)
        return 0.8 * r + 0.6 * g
    return g


def blinking(case: Case, effect: Effect) -> tuple[Array, Array]:
    """Return pixels and their states by frame and pixel: asymmetric chains of two states."""
    g = stream(case, "map", "rts")
    pixels = case["h"] * case["w"]
    n = sum(e["n"] for e in case["exposures"])
    k = max(1, round(effect["pixel_fraction"] * pixels))
    chosen = np.argsort(g.random(pixels))[:k]
    up = np.exp(g.uniform(np.log(0.08), np.log(0.6), k))
    down = np.exp(g.uniform(np.log(0.08), np.log(0.6), k))
    height = g.exponential(1.0, k)
    if effect.get("signs"):
        height = height * np.where(g.random(k) < 0.5, 1, -1)
    states = np.empty((n, k))
    s = g.random(k) < up / (up + down)
    for t in range(n):
        states[t] = s
        u = g.random(k)
        s = np.where(s, u >= down, u < up)
    return chosen, states * height


def pink(case: Case, effect: Effect, exposure: int, frames: int) -> Array:
    """Return 1/f noise along the read-out with blank samples after lines, of deviation 1."""
    g = stream(case, "pink", exposure)
    h, w = case["h"], case["w"]
    blank = effect.get("blank", 0)
    if effect.get("order") == "columns":
        h, w = w, h
    n = h * (w + blank)
    m = 2 * n
    f = np.fft.rfftfreq(m)
    amplitude = np.zeros(len(f))
    amplitude[1:] = f[1:] ** (-effect.get("exponent", 1.0) / 2)
    norm = np.sqrt(2 * np.sum(amplitude**2)) / m  # of what irfft makes of unit complex normals
    out = np.empty((frames, h, w))
    for t in range(frames):
        z = (g.standard_normal(len(f)) + 1j * g.standard_normal(len(f))) / np.sqrt(2)
        s = np.fft.irfft(amplitude * z, m)[:n] / norm
        out[t] = s.reshape(h, w + blank)[:, :w]
    return out.transpose(0, 2, 1) if effect.get("order") == "columns" else out
