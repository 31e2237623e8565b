"""Oracles of what stands still: maps, levels and their growth with light and time."""

import numpy as np

from second import patterns
from second.geometry import Array, Effect
from second.prepared import (
    MAD,
    Numbers,
    Oracle,
    Prepared,
    demeaned,
    joined,
    offset_map,
    project,
    relative_map,
    variance_curve,
    variance_of,
)


def _still(p: Prepared) -> Numbers:
    return offset_map(p, p.kinds("dark", "flat"))


def _level_error(p: Prepared, i: int, variance: float, pixels: int) -> float:
    wander = np.var(p.frame_means[i], ddof=1)
    return np.sqrt(max(variance / pixels, wander) / p.count(i))


def fixed_lines(axis: int) -> Oracle:
    """Return the variance of fixed lines; single odd pixels must not carry one."""

    def oracle(p: Prepared, _e: Effect) -> Numbers:
        m, variance = _still(p)
        for plane in p.planes.values():
            middle = np.median(m[plane])
            spread = MAD * np.median(np.abs(m[plane] - middle)) + 1e-9
            m[plane] = np.clip(m[plane], middle - 4 * spread, middle + 4 * spread)
        a = (m / variance).sum(axis) / (1 / variance).sum(axis)
        t = np.arange(len(a))
        step = 1 if p.case["cfa"] == "MONO" else 2
        for k in range(step):
            a[k::step] -= np.polyval(np.polyfit(t[k::step], a[k::step], 2), t[k::step])
        return variance_of(a)

    return oracle


def bent_levels(p: Prepared, _e: Effect) -> Numbers:
    """Return means against light, less the best line through black at no light."""
    out = []
    flats = p.kinds("flat")
    for plane in p.planes.values():
        x = np.array([p.exposures[i]["level"] for i in flats])
        y = np.array([float(p.means[i][plane].mean()) - p.case["black"] for i in flats])
        s = np.array(
            [
                _level_error(p, i, np.mean(p.variances[i][plane]), p.means[i][plane].size)
                for i in flats
            ]
        )
        x = x / x.max()
        b = np.sum(x * y / s**2) / np.sum(x * x / s**2)
        out.append((y - b * x, s))
    return joined(out)


def variance_line(p: Prepared, _e: Effect) -> Numbers:
    """Return what the photon transfer's line leaves, in DN^2."""
    x, v, s = variance_curve(p)
    a = np.stack([x, np.ones_like(x)], 1) / s[:, None]
    k = np.linalg.lstsq(a, v / s, rcond=None)[0]
    return v - k[0] * x - k[1], s


def flat_variances(p: Prepared, _e: Effect) -> Numbers:
    """Return the variance of flats, in DN^2."""
    _, v, s = variance_curve(p, ("flat",))
    return v, s


def hot(p: Prepared, _e: Effect) -> Numbers:
    """Return how many pixels of the longest dark are beyond what chance gives."""
    times = [e["time"] for e in p.exposures]
    i = max(p.kinds("dark"), key=lambda k: times[k])
    m = p.means[i].copy()
    for plane in p.planes.values():
        m[plane] -= np.median(m[plane])
    n = int((m > 4.5 * np.sqrt(p.variances[i] / p.count(i)) + 0.05).sum())
    return [n], [np.sqrt(1 + n)]


def dark_levels(p: Prepared, _e: Effect) -> Numbers:
    """Return levels of darks less their mean."""
    d = p.kinds("dark")
    m = np.array([p.means[i].mean() for i in d])
    s = np.array([_level_error(p, i, np.mean(p.variances[i]), p.pixels) for i in d])
    return m - np.sum(m / s**2) / np.sum(1 / s**2), s


def glow(p: Prepared, e: Effect) -> Numbers:
    """Return the amplitude of a glow that grows with time, in darks and flats."""
    return _growing(p, patterns.glow_template(p.case, e), ("dark", "flat"))


def trails(p: Prepared, e: Effect) -> Numbers:
    """Return the amplitude of trails below hot pixels, in darks."""
    return _growing(p, patterns.bloom_template(p.case, e), ("dark",))


def _growing(p: Prepared, t: Array, kinds: tuple[str, ...]) -> Numbers:
    return joined(
        project(demeaned(p, p.means[i]), p.variances[i] / p.count(i), t * p.exposures[i]["time"], p)
        for i in p.kinds(*kinds)
    )


def greens(p: Prepared, _e: Effect) -> Numbers:
    """Return the difference of both greens, in DN."""
    out = []
    for i in p.kinds("flat"):
        a, b = (p.means[i][p.planes[k]] for k in ("Gr", "Gb"))
        va, vb = (np.mean(p.variances[i][p.planes[k]]) for k in ("Gr", "Gb"))
        s = np.sqrt((max(va / p.count(i), a.var()) + max(vb / p.count(i), b.var())) / a.size)
        out.append(([a.mean() - b.mean()], [s]))
    return joined(out)


def of_gain(template: patterns.Template) -> Oracle:
    """Return the amplitude of a template in the map of relative response."""

    def oracle(p: Prepared, e: Effect) -> Numbers:
        m, v = relative_map(p)
        return project(m, v, template(p.case, e), p)

    return oracle


def cluster(p: Prepared, e: Effect) -> Numbers:
    """Return how much less a cluster collects."""
    m, v = relative_map(p)
    return project(m, v, patterns.cluster_mask(p.case, e), p)


def shutter(p: Prepared, _e: Effect) -> Numbers:
    """Return a gradient of light that goes as one over the exposure time."""
    t = patterns.shutter_template(p.case)
    return joined(
        project(
            demeaned(p, p.means[i]),
            p.variances[i] / p.count(i),
            t * p.signals[i] / p.exposures[i]["time"],
            p,
        )
        for i in p.kinds("flat")
    )


def settling(p: Prepared, e: Effect) -> Numbers:
    """Return the amplitude of a fixed decay from the start of lines, in DN."""
    m, v = _still(p)
    return project(m, v, patterns.settle_template(p.case, e), p)


def fixed_pixels(p: Prepared, _e: Effect) -> Numbers:
    """Return the variance of the mean map."""
    return variance_of(_still(p)[0])


def pixel_gains(p: Prepared, _e: Effect) -> Numbers:
    """Return the variance of the map of relative response."""
    return variance_of(relative_map(p)[0])


ORACLES: dict[str, Oracle] = {
    "dual_gain": variance_line,
    "dual_gain_mismatch": bent_levels,
    "row_fpn": fixed_lines(1),
    "column_fpn": fixed_lines(0),
    "dsnu": fixed_pixels,
    "prnu": pixel_gains,
    "shading": of_gain(patterns.shading_template),
    "dark_current": dark_levels,
    "hot_pixels": hot,
    "amp_glow": glow,
    "nonlinearity": bent_levels,
    "saturation": flat_variances,
    "tap_mismatch": of_gain(patterns.tap_template),
    "channel_imbalance": greens,
    "cluster_defect": cluster,
    "dust_shadows": of_gain(patterns.dust_template),
    "display_moire": of_gain(patterns.moire_template),
    "blooming_trail": trails,
    "speckle_light": variance_line,
    "shutter_gradient": shutter,
    "line_start_settling": settling,
}
