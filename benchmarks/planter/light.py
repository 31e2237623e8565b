"""Mechanisms that change the expected signal: lens, lamp, pixel gains, charge without light."""

from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import numpy as np
from scipy.ndimage import gaussian_filter
from scipy.special import ndtri

from planter.view import Image, Mechanism, View, normal

_WIDTHS = 12  # of blots


def clean_signal(view: View) -> Image:
    """Return the signal that the exposure was planned to have, float32, DN above black."""
    flat = view.plan.signal_dn * view.case.response_map()
    return flat * _scene(view) if view.plan.kind == "scene" else flat


def _scene(view: View) -> Image:
    """Return a static picture of mean 1: soft clouds, and a few hard edges."""
    rows, columns = view.shape
    rng = view.of_exposure("scene")
    clouds = gaussian_filter(normal(rng, view.shape), max(view.shape) / 16, mode="reflect")
    picture = np.exp(0.6 * clouds / clouds.std())
    for _ in range(4):
        top, left = rng.integers(0, rows // 2), rng.integers(0, columns // 2)
        picture[top : top + rows // 4, left : left + columns // 4] *= rng.uniform(0.4, 1.6)
    picture = np.minimum(picture / picture.mean(), 1.6)
    return picture.astype(np.float32)


def channel_imbalance(signal: Image, p: Mapping[str, Any], view: View) -> Image:
    """Make green beside red brighter than green beside blue."""
    planes = view.case.channels()
    out = signal.copy()
    out[planes["Gr"]] *= 1 + p["gain_percent"] / 200
    out[planes["Gb"]] *= 1 - p["gain_percent"] / 200
    return out


def fall_off(view: View, law: str) -> Image:
    """Return the loss towards the corners, 0 in the centre and 1 in the corner."""
    rows, columns = view.shape
    y = np.arange(rows)[:, None] - (rows - 1) / 2
    x = np.arange(columns)[None, :] - (columns - 1) / 2
    square = (y**2 + x**2) / (y[0, 0] ** 2 + x[0, 0] ** 2)
    if law == "cos4":  # half the field of view is 30 degrees
        tan_square = np.tan(np.radians(30)) ** 2
        return ((1 - (1 + tan_square * square) ** -2) / (1 - (1 + tan_square) ** -2)).astype(
            np.float32
        )
    return square.astype(np.float32)


def shading(signal: Image, p: Mapping[str, Any], view: View) -> Image:
    """Darken towards the corners."""
    loss = fall_off(view, p.get("law", "quadratic"))
    return signal * (1 - np.float32(p["falloff_percent"] / 100) * loss)


def prnu(signal: Image, p: Mapping[str, Any], view: View) -> Image:
    """Give every pixel a gain."""
    gains = normal(view.of_sensor("prnu"), view.shape)
    return signal * (1 + np.float32(p["sigma_percent"] / 100) * gains)


@lru_cache(maxsize=8)
def blots(seed: int, shape: tuple[int, int], length: float) -> Image:
    """Return a field of variance 1 of blots whose widths are those of a half-normal law.

    Blots of width s are alike over exp(-r^2 / (4 s^2)); over all widths that makes exp(-r / L).
    """
    rng, margin = np.random.default_rng([seed, 57]), int(6 * length) + 1
    total = np.zeros(shape, np.float32)
    for k in range(_WIDTHS):
        width = length / np.sqrt(2) * float(ndtri(0.5 + (k + 0.5) / (2 * _WIDTHS)))
        spot = np.zeros((2 * margin + 1, 2 * margin + 1))
        spot[margin, margin] = 1
        size = np.sqrt(np.sum(gaussian_filter(spot, width, mode="constant", truncate=4) ** 2))
        grains = normal(rng, tuple(n + 2 * margin for n in shape))
        made = gaussian_filter(grains, width, mode="constant", truncate=4) / size
        total += made[margin:-margin, margin:-margin]
    return (total / np.sqrt(_WIDTHS)).astype(np.float32)


def smooth_prnu(signal: Image, p: Mapping[str, Any], view: View) -> Image:
    """Let light pass glass and layers that are uneven over some pixels."""
    gains = blots(view.case.sensor_seed, view.shape, p["length_pixels"])
    return signal * (1 + np.float32(p["sigma_percent"] / 100) * gains)


def row_prnu(signal: Image, p: Mapping[str, Any], view: View) -> Image:
    """Give every row a gain."""
    gains = normal(view.of_sensor("row_prnu"), (view.case.rows, 1))
    return signal * (1 + np.float32(p["sigma_percent"] / 100) * gains)


def column_prnu(signal: Image, p: Mapping[str, Any], view: View) -> Image:
    """Give every column a gain."""
    gains = normal(view.of_sensor("column_prnu"), (1, view.case.columns))
    return signal * (1 + np.float32(p["sigma_percent"] / 100) * gains)


def flicker(signal: Image, p: Mapping[str, Any], view: View) -> Image:
    """Scale the frame's light."""
    return signal * np.float32(1 + p["sigma_percent"] / 100 * view.fresh("flicker").normal())


def line_flicker(signal: Image, p: Mapping[str, Any], view: View) -> Image:
    """Modulate the rows as a lamp on mains does under a rolling shutter.

    The phase moves on steadily from frame to frame, or is free where `advance` is absent; the
    light of a lamp is not quite a sine: `harmonic` is the share of the second one.
    """
    start = view.of_exposure("line_flicker").uniform(0, 2 * np.pi)
    advance = p.get("advance_cycles")
    free = view.fresh("line_flicker").uniform(0, 2 * np.pi)
    phase = free if advance is None else start + 2 * np.pi * advance * view.frame
    angle = 2 * np.pi * p["cycles_per_frame"] * np.arange(view.case.rows) / view.case.rows + phase
    wave = np.sin(angle) + p.get("harmonic", 0.0) * np.sin(2 * angle)
    depth = p["depth_percent"] / 100
    return signal * (1 + depth * wave).astype(np.float32)[:, None]


def dark_current(signal: Image, p: Mapping[str, Any], view: View) -> Image:
    """Add charge that needs no light."""
    return signal + np.float32(p["dn_per_s"] * view.plan.exposure_time_s)


def glow(view: View, p: Mapping[str, Any]) -> Image:
    """Return the glow's shape, 1 where it is brightest: a corner or an edge."""
    rows, columns = view.shape
    y, x = np.arange(rows)[:, None] + 0.0, np.arange(columns)[None, :] + 0.0
    place, length = p.get("place", "top_left"), p.get("extent", 0.25) * max(rows, columns)
    down = {"t": y, "b": rows - 1 - y}.get(place[0], 0 * y)
    right = x if "left" in place else columns - 1 - x if "right" in place else 0 * x
    return np.exp(-np.hypot(down, right) / length).astype(np.float32)


def amp_glow(signal: Image, p: Mapping[str, Any], view: View) -> Image:
    """Add the light of an amplifier beside the array."""
    return signal + np.float32(p["dn_per_s"] * view.plan.exposure_time_s) * glow(view, p)


def hot_pixels(signal: Image, p: Mapping[str, Any], view: View) -> Image:
    """Add the large dark currents of a few pixels, exponentially distributed."""
    rng = view.of_sensor("hot_pixels")
    affected = rng.random(view.shape) < p["pixel_fraction"]
    rate = affected * rng.standard_exponential(view.shape, dtype=np.float32)
    return signal + np.float32(p["mean_dn_per_s"] * view.plan.exposure_time_s) * rate


LIGHT: dict[str, Mechanism] = {
    "channel_imbalance": channel_imbalance,
    "shading": shading,
    "prnu": prnu,
    "smooth_prnu": smooth_prnu,
    "row_prnu": row_prnu,
    "column_prnu": column_prnu,
    "flicker": flicker,
    "line_flicker": line_flicker,
    "dark_current": dark_current,
    "amp_glow": amp_glow,
    "hot_pixels": hot_pixels,
}
