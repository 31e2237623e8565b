"""Oracles of codes, of frames that differ in parts and of scenes; z of any effect.

An oracle knows which effect it looks for, with its template. z is |with - without| in standard
errors of a recording without it, the two sharing all other noise.
"""

import numpy as np

from second import oracles_fixed, oracles_moving
from second.geometry import Array, Effect, coords, response, scene_at
from second.prepared import Numbers, Oracle, Prepared, expected_variance, joined


def _density(p: Prepared) -> Array:
    c = np.zeros(p.case["white"] + 1)
    for codes in p.frames:
        c += np.bincount(codes.ravel(), minlength=len(c))[: len(c)]
    return c


def coarse(p: Prepared, e: Effect) -> Numbers:
    """Return the share of codes that lie on the steps."""
    c = _density(p)
    k = np.arange(len(c))
    on = c[(k - e["phase"]) % e["step_dn"] == 0].sum() / c.sum()
    return [on], [np.sqrt(max(on * (1 - on), 1e-9) / c.sum())]


def comb(p: Prepared, _e: Effect) -> Numbers:
    """Return the chi-squared of the density of codes against its smooth envelope."""
    c = _density(p)
    width = 12.0
    reach = 4 * int(np.ceil(width))
    kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) / width) ** 2)
    envelope = np.convolve(c, kernel / kernel.sum(), "same")
    ok = envelope > 30
    d = (c[ok] - envelope[ok]) ** 2 / envelope[ok]
    return [d.sum()], [np.sqrt(2 * ok.sum())]


def density(p: Prepared, _e: Effect) -> Numbers:
    """Return how often each code occurs."""
    c = _density(p)
    return c, np.sqrt(c + 1)


def _z_of_codes(e: Effect, c1: Array, c0: Array) -> float:
    """Return the chi-squared of codes against ideal ones, folded at the pattern's period."""
    if e["law"] == "interleaved":
        period = 2 ** e["bits"]
        pad = -len(c1) % period
        c1, c0 = (np.pad(c, (0, pad)).reshape(-1, period).sum(0) for c in (c1, c0))
    ok = c0 > 20
    return float(np.sum((c1[ok] - c0[ok]) ** 2 / c0[ok]) / np.sqrt(2 * ok.sum()))


def halves(p: Prepared, _e: Effect) -> Numbers:
    """Return the alternating difference of the upper and lower half, in DN."""
    out = []
    for i, z in enumerate(p.residuals):
        h = z.shape[1] // 2
        d = z[:, :h].mean((1, 2)) - z[:, h:].mean((1, 2))
        s = np.where(np.arange(p.count(i)) % 2, 1.0, -1.0)
        s -= s.mean()
        error = np.sqrt(4 * np.mean(p.variances[i]) / p.pixels / np.sum(s * s))
        out.append(([np.sum(d * s) / np.sum(s * s)], [error]))
    return joined(out)


def repeated(p: Prepared, _e: Effect) -> Numbers:
    """Return the correlation of every other frame with the one before."""
    out = []
    for i in range(len(p.frames)):
        z, n = p.standardised(i), p.count(i)
        if n > 1:
            a = [float(np.mean(z[t] * z[t - 1])) for t in range(1, n, 2)]
            out.append(([np.mean(a)], [1 / np.sqrt(p.pixels * len(a))]))
    return joined(out)


def ramp(p: Prepared, _e: Effect) -> Numbers:
    """Return the slope of frame means within an exposure, in DN."""
    out = []
    for i, means in enumerate(p.frame_means):
        n = p.count(i)
        t = np.arange(n) / max(n - 1, 1) - 0.5
        error = np.sqrt(np.mean(p.variances[i]) / p.pixels / np.sum(t * t))
        out.append(([np.sum(means * t) / np.sum(t * t)], [error]))
    return joined(out)


def blocks(p: Prepared, e: Effect) -> Numbers:
    """Return the variance of means of blocks, in units of the pixels' own."""
    b = e["block"]
    out = []
    for i in range(len(p.frames)):
        z, n = p.standardised(i), p.count(i)
        h, w = z.shape[1] // b * b, z.shape[2] // b * b
        a = z[:, :h, :w].reshape(n, h // b, b, w // b, b).mean((2, 4))
        error = np.sqrt(2 / (a[0].size * (n - 1))) / b**2
        out.append(([np.mean(a * a) * n / (n - 1)], [error]))
    return joined(out)


def flipping_columns(p: Prepared, e: Effect) -> Numbers:
    """Return the variance of the means of certain columns."""
    columns = (np.array(e["columns"]) * p.case["w"]).astype(int)
    out = []
    for i in range(len(p.frames)):
        n = p.count(i)
        a = p.standardised(i)[:, :, columns].mean(1)
        error = np.sqrt(2 / (len(columns) * (n - 1))) / p.case["h"]
        out.append(([np.mean(a * a) * n / (n - 1)], [error]))
    return joined(out)


def growing_columns(p: Prepared, _e: Effect) -> Numbers:
    """Return the variance of columns' slopes down the frame."""
    out = []
    h = p.case["h"]
    for i in p.kinds("flat"):
        z, n = p.standardised(i), p.count(i)
        t = np.arange(h) / h
        t = t - t.mean()
        a = np.einsum("tyx,y->tx", z, t.astype(np.float32))
        norm = float(np.sum(t * t))
        error = norm * np.sqrt(2 / (a.shape[1] * (n - 1)))
        out.append(([np.mean(a * a) * n / (n - 1)], [error]))
    return joined(out)


def _gradient(p: Prepared, level: float) -> tuple[Array, Array]:
    """Return the scene's change per pixel down and to the right, in DN."""
    y, x = coords(p.case)
    r = response(p.case) * level
    down = (scene_at(p.case, y + 0.5, x) - scene_at(p.case, y - 0.5, x)) * r
    right = (scene_at(p.case, y, x + 0.5) - scene_at(p.case, y, x - 0.5)) * r
    return down, right


def _scene_variance(p: Prepared, i: int) -> Array:
    """Return pixel variances of a scene by the law of noise, not by its plane's average."""
    return expected_variance(p.case, np.maximum(p.means[i] - p.case["black"], 0))


def jitter(p: Prepared, _e: Effect) -> Numbers:
    """Return the variance of a scene's shifts, in units of their weight."""
    out = []
    for i in p.kinds("scene"):
        v = _scene_variance(p, i)
        out += [_varying(p, i, g, v) for g in _gradient(p, p.exposures[i]["level"])]
    return joined(out)


def vibration(p: Prepared, e: Effect) -> Numbers:
    """Return the variance of a scene's shifts in waves down the rows."""
    out = []
    y, _ = coords(p.case)
    for i in p.kinds("scene"):
        v = _scene_variance(p, i)
        g = _gradient(p, p.exposures[i]["level"])[1]
        for f in (np.sin, np.cos):
            t = g * f(2 * np.pi * e["cycles"] * y / p.case["h"])
            out.append(_varying(p, i, t, v))
    return joined(out)


def _varying(p: Prepared, i: int, t: Array, v: Array) -> Numbers:
    a = (p.residuals[i] * t / v).sum((1, 2))
    return [np.var(a, ddof=1)], [np.sum(t * t / v) * np.sqrt(2 / (len(a) - 1))]


def smear(p: Prepared, e: Effect) -> Numbers:
    """Return the share of bright charge that a row of a scene gets."""
    out = []
    y, x = coords(p.case)
    for i in p.kinds("scene"):
        c = p.exposures[i]["level"] * scene_at(p.case, y, x) * response(p.case)
        r = np.maximum(c - e["threshold"], 0).sum(1, keepdims=True) / p.case["w"]
        v = _scene_variance(p, i) / p.count(i)
        t = np.broadcast_to(r, c.shape)
        n = np.sum(t * t / v) + 1e-30
        found = np.sum((p.means[i] - p.case["black"] - c) * t / v) / n
        out.append(([found], [1 / np.sqrt(n)]))
    return joined(out)


ORACLES: dict[str, Oracle] = {
    **oracles_fixed.ORACLES,
    **oracles_moving.ORACLES,
    "quantisation": coarse,
    "adc_dnl": density,
    "companding": comb,
    "half_frame_alternation": halves,
    "double_frames": repeated,
    "dark_temperature_ramp": ramp,
    "block_offset_noise": blocks,
    "column_telegraph": flipping_columns,
    "column_gain_drift": growing_columns,
    "scene_jitter": jitter,
    "vibration": vibration,
    "horizontal_smear": smear,
}


def z_of(effect: Effect, there: Prepared, without: Prepared) -> float:
    """Return how far an effect stands out of the same recording without it."""
    oracle = ORACLES[effect["kind"]]
    v1, _ = oracle(there, effect)
    v0, s = oracle(without, effect)
    if effect["kind"] == "adc_dnl":
        return _z_of_codes(effect, v1, v0)
    d = (np.asarray(v1) - np.asarray(v0)) / np.asarray(s)
    return float(np.sqrt(max(float(np.sum(d * d)), 0)))
