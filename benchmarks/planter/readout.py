"""Mechanisms of amplifiers: gains of taps and paths, read noise, its tails and pixels, memory."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from planter.view import Image, Mechanism, View, normal

COMPARATOR_DN = 0.3


def dual_gain_mismatch(signal: Image, p: Mapping[str, Any], view: View) -> Image:
    """Misjudge the gain of the path that takes over above the switch."""
    switch = view.case.true_segments[0].upper_dn
    gain = np.where(view.expected >= switch, 1 + p["gain_error_percent"] / 100, 1)
    return signal * gain.astype(np.float32)


def second_tap(view: View, regions: str) -> np.ndarray:
    """Return where the second amplifier reads, bool (row, column)."""
    rows, columns = view.shape
    y, x = np.arange(rows)[:, None], np.arange(columns)[None, :]
    return {
        "left_right": (x >= columns // 2) & (y >= 0),
        "top_bottom": (y >= rows // 2) & (x >= 0),
        "even_odd_columns": (x % 2 == 1) & (y >= 0),
        "even_odd_rows": (y % 2 == 1) & (x >= 0),
    }[regions]


def tap_mismatch(signal: Image, p: Mapping[str, Any], view: View) -> Image:
    """Read two regions with amplifiers whose gains differ by the percentage."""
    second = second_tap(view, p.get("regions", "left_right"))
    half = p["gain_percent"] / 200
    return signal * np.where(second, 1 + half, 1 - half).astype(np.float32)


def settled(view: View, p: Mapping[str, Any]) -> np.ndarray:
    """Return what is left of a start, 1 beside its edge: each further line keeps a share."""
    edge, keeps = p.get("edge", "left"), np.exp(-1 / p["length_pixels"])
    axis = 1 if edge in ("left", "right") else 0
    left = np.cumprod(np.r_[1.0, np.full(view.shape[axis] - 1, keeps)])
    left = left[::-1] if edge in ("right", "bottom") else left
    return np.broadcast_to(left if axis else left[:, None], view.shape)


def line_settling(signal: Image, p: Mapping[str, Any], view: View) -> Image:
    """Read lines before the amplifier has come to rest: its gain and its offset are still off."""
    left = settled(view, p)
    gain = (1 + p["gain_percent"] / 100 * left).astype(np.float32)
    return signal * gain + (p["offset_dn"] * left).astype(np.float32)


def read(signal: Image, view: View) -> Image:
    """Add the read noise: Gaussian, or Student's t; alike in all pixels, or not."""
    deviation = np.sqrt(view.segment_map(lambda segment: segment.intercept))
    noise = normal(view.fresh("read"), view.shape)
    tails = view.case.planted("heavy_tailed_read_noise")
    if tails is not None:
        df = tails["tail_df"]
        chi_square = view.fresh("tails").chisquare(df, view.shape)
        noise *= np.sqrt((df - 2) / chi_square).astype(np.float32)
    spread = view.case.planted("read_noise_spread")
    if spread is not None:
        s = spread["log_sigma"]
        level = normal(view.of_sensor("read_noise_spread"), view.shape)
        noise *= np.exp(s * level - s**2)  # E exp(2 s k - 2 s^2) = 1: the mean variance stays
    return signal + deviation * noise


def rts(signal: Image, p: Mapping[str, Any], view: View) -> Image:
    """Let single electrons fall into traps and out: two levels, a Markov chain per pixel.

    `duty` is the share of the time spent on the upper level, `switching` the probability per
    frame to leave the state when both are equally long.
    """
    rng = view.of_sensor("rts")
    affected = np.flatnonzero(rng.random(view.shape) < p["pixel_fraction"])
    height = p["amplitude_dn"] * rng.standard_exponential(affected.size)
    duty, rate = p.get("duty", 0.5), 2 * p.get("switching", 0.2)
    chain = view.of_exposure("rts")
    filled = chain.random(affected.size) < duty
    for _ in range(view.frame + 1):
        redraw = chain.random(affected.size) < rate
        filled = np.where(redraw, chain.random(affected.size) < duty, filled)
    out = signal.copy()
    out.ravel()[affected] += height * (filled - duty)
    return out


def readout_memory(signal: Image, p: Mapping[str, Any], view: View) -> Image:
    """Add a share of the noise of the sample read `lag_pixels` earlier along its line."""
    axis = 1 if p.get("along", "rows") == "rows" else 0
    lag = p["lag_pixels"]
    out = signal.copy()
    noise = np.moveaxis(signal - view.expected, axis, 0)
    np.moveaxis(out, axis, 0)[lag:] += np.float32(p["fraction"]) * noise[:-lag]
    return out


def residue(sample: Image, p: Mapping[str, Any], decided: Image | float = 0.0) -> Image:
    """Return what a coarse decision leaves of a sample, -1/2 to 1/2 of its step.

    `decided` is what the comparators add to it by themselves, DN.
    """
    period = p["period_codes"]
    taken = np.floor((sample + decided - p["at_code"]) / period)
    return (sample - p["at_code"]) / period - taken - 0.5


def adc_memory(signal: Image, p: Mapping[str, Any], view: View) -> Image:
    """Convert sample by sample: each has some of the residue that the one before has left.

    What the one before had itself carried over is part of its residue; comparators are noisy. The
    converter holds the end of a line until the next begins, of about the same level.
    """
    axis = 1 if p.get("along", "rows") == "rows" else 0
    samples = np.moveaxis(signal + np.float32(view.case.black_level), axis, 0).copy()
    decided = COMPARATOR_DN * normal(view.fresh("comparators"), samples.shape)
    held = samples[-1].copy()
    samples[0] += (p["step_dn"] * residue(held, p, decided[-1])).astype(np.float32)
    for i in range(1, len(samples)):
        before = residue(samples[i - 1], p, decided[i - 1])
        samples[i] += (p["step_dn"] * before).astype(np.float32)
    return np.moveaxis(samples, 0, axis) - np.float32(view.case.black_level)


AMPLIFIERS: dict[str, Mechanism] = {
    "dual_gain_mismatch": dual_gain_mismatch,
    "tap_mismatch": tap_mismatch,
    "line_settling": line_settling,
}
PIXELS: dict[str, Mechanism] = {"rts": rts}
MEMORY: dict[str, Mechanism] = {"readout_memory": readout_memory, "adc_memory": adc_memory}
