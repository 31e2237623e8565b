"""Oracles of what is new in each frame: distributions, lines, lags, waves."""

import numpy as np

from second import patterns
from second.geometry import Effect, radial, segment_of
from second.prepared import Numbers, Oracle, Prepared, joined, project

NEAR = ((0, 1), (1, 0))
NEAR2 = (*NEAR, (0, 2), (2, 0), (1, 1))


def lines(axis: int) -> Oracle:
    """Return the variance of line means, in units of the pixels' own."""

    def oracle(p: Prepared, _e: Effect) -> Numbers:
        out = []
        for i in range(len(p.frames)):
            n = p.count(i)
            a = p.standardised(i).mean(axis)
            v = float(np.mean(a * a)) * n / (n - 1)
            out.append(([v], [v * np.sqrt(2 / (a.shape[1] * (n - 1)))]))
        return joined(out)

    return oracle


def frames(*kinds: str) -> Oracle:
    """Return the variance of frame means."""

    def oracle(p: Prepared, _e: Effect) -> Numbers:
        out = []
        for i in p.kinds(*kinds):
            n, z = p.count(i), p.residuals[i]
            rows, columns = np.mean(z.mean(2) ** 2), np.mean(z.mean(1) ** 2)
            null = np.mean(p.variances[i]) / p.pixels
            null = max(null, rows / z.shape[1], columns / z.shape[2])
            out.append(([np.var(p.frame_means[i], ddof=1)], [null * np.sqrt(2 / (n - 1))]))
        return joined(out)

    return oracle


def lags(*offsets: tuple[int, int]) -> Oracle:
    """Return correlations at offsets of rows and columns."""

    def oracle(p: Prepared, _e: Effect) -> Numbers:
        out = []
        for i in p.kinds("dark", "flat"):
            z, n = p.standardised(i), p.count(i)
            h, w = z.shape[1:]
            for dy, dx in offsets:
                a, b = z[:, dy:, dx:], z[:, : h - dy, : w - dx]
                error = 1 / np.sqrt(a[0].size * (n - 1))
                out.append(([float(np.mean(a * b)) * n / (n - 1)], [error]))
        return joined(out)

    return oracle


def _variance_ratio(p: Prepared) -> tuple[np.ndarray, int]:
    s, freedom = np.zeros(()), 0
    for i in p.kinds("dark"):
        s = s + (p.residuals[i] ** 2).sum(0) / p.variances[i]
        freedom += p.count(i) - 1
    return s / freedom, freedom


def spread(p: Prepared, _e: Effect) -> Numbers:
    """Return how far the variances of pixels differ."""
    s, _ = _variance_ratio(p)
    q = (s - 1) ** 2
    return [float(q.mean())], [float(q.std()) / np.sqrt(q.size)]


def loud(p: Prepared, _e: Effect) -> Numbers:
    """Return how many pixels' variance in darks is beyond what chance gives."""
    s, freedom = _variance_ratio(p)
    n = int((s > 1 + 5.5 * np.sqrt(2 / freedom)).sum())
    return [n], [np.sqrt(1 + n)]


def kurtosis(p: Prepared, _e: Effect) -> Numbers:
    """Return the kurtosis of darks."""
    out = []
    for i in p.kinds("dark"):
        z = p.standardised(i).astype(np.float64)
        out.append(([np.mean(z**4) / np.mean(z * z) ** 2], [np.sqrt(24 / z.size)]))
    return joined(out)


def skew(p: Prepared, _e: Effect) -> Numbers:
    """Return the skew, matched to what Poisson electrons of this gain give at each level."""
    num = den = 0.0
    for i in p.kinds("dark", "flat"):
        z = p.standardised(i).astype(np.float64)
        for name, plane in p.planes.items():
            a = z[(slice(None), *plane)]
            x = p.exposures[i].get("level", 0.0) * p.case["response"][name]
            k, t = (float(q) for q in segment_of(p.case["segments"], np.array(x)))
            want = k * k * x / (k * x + t) ** 1.5
            num += np.mean(a**3) * want * a.size / 6
            den += want**2 * a.size / 6
    return [num / den], [1 / np.sqrt(den)]


def spikes(p: Prepared, _e: Effect) -> Numbers:
    """Return how many samples lie above 6 sigma."""
    n = sum(int((p.standardised(i) > 6.0).sum()) for i in range(len(p.frames)))
    return [n], [np.sqrt(1 + n)]


def bands(p: Prepared, e: Effect) -> Numbers:
    """Return the power of row means at the cycles of a flickering lamp."""
    out = []
    for i in p.kinds("flat", "scene"):
        r = p.residuals[i].mean(2)
        h = r.shape[1]
        wave = np.exp(-2j * np.pi * e["cycles_per_frame"] * np.arange(h) / h)
        power = np.abs(r @ wave) ** 2
        null = max(np.mean(p.variances[i]) / p.residuals[i].shape[2], 0) * h
        out.append(([power.mean()], [null / np.sqrt(len(power))]))
    return joined(out)


def wave(p: Prepared, e: Effect) -> Numbers:
    """Return the power at a spatial frequency."""
    out = []
    for i, z in enumerate(p.residuals):
        h, w = z.shape[1:]
        across = np.exp(-2j * np.pi * e["frequency"][0] * np.arange(w))
        down = np.exp(-2j * np.pi * e["frequency"][1] * np.arange(h))
        power = np.abs((z @ across) @ down) ** 2
        null = p.pixels * np.mean(p.variances[i])
        out.append(([power.mean()], [null / np.sqrt(len(power))]))
    return joined(out)


def signs(p: Prepared, e: Effect) -> Numbers:
    """Return the variance of frames' projections on a pattern."""
    t = patterns.bistable_template(p.case, e)
    out = []
    for z, variance in zip(p.residuals, p.variances, strict=True):
        a = (z * t).sum((1, 2))
        null = p.pixels * np.mean(variance * t * t)
        out.append(([np.var(a, ddof=1)], [null * np.sqrt(2 / (len(a) - 1))]))
    return joined(out)


def next_frame(p: Prepared, _e: Effect) -> Numbers:
    """Return the correlation of successive frames of flats."""
    out = []
    for i in p.kinds("flat"):
        z, n = p.standardised(i), p.count(i)
        out.append(([float(np.mean(z[1:] * z[:-1]))], [1 / np.sqrt(p.pixels * (n - 1))]))
    return joined(out)


def slow(p: Prepared, e: Effect) -> Numbers:
    """Return the variance of lines and correlations along the read-out."""
    columns = e.get("order") == "columns"
    near = [(1, 0), (2, 0), (3, 0)] if columns else [(0, 1), (0, 2), (0, 3)]
    return joined([lines(1 if columns else 2)(p, e), lags(*near)(p, e)])


def memory(p: Prepared, e: Effect) -> Numbers:
    """Return the correlation at the lag that is remembered."""
    k = e["lag_pixels"]
    return lags((0, k) if e["axis"] == "row" else (k, 0))(p, e)


def noise_vignetting(p: Prepared, _e: Effect) -> Numbers:
    """Return how the variance of darks grows to the corners."""
    t = radial(p.case)
    t = t - t.mean()
    out = []
    for i in p.kinds("dark"):
        n = p.count(i)
        q = (p.residuals[i] ** 2).sum(0) / p.variances[i] / (n - 1) - 1
        out.append(project(q, np.array(2 / (n - 1)), t))
    return joined(out)


ORACLES: dict[str, Oracle] = {
    "poisson_shot_noise": skew,
    "heavy_tailed_read_noise": kurtosis,
    "read_noise_spread": spread,
    "rts": loud,
    "row_noise": lines(2),
    "column_noise": lines(1),
    "black_level_drift": frames("dark", "flat"),
    "flicker": frames("flat"),
    "line_flicker": bands,
    "crosstalk": lags(*NEAR),
    "brighter_fatter": lags(*NEAR),
    "image_lag": next_frame,
    "spatial_filtering": lags(*NEAR2),
    "pink_noise": slow,
    "periodic_noise": wave,
    "bistable_pattern": signs,
    "readout_memory": memory,
    "impulse": spikes,
    "read_noise_vignetting": noise_vignetting,
}
