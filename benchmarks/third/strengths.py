"""How far an effect of a size stands out: roots of expected deviances."""

from typing import Literal

import numpy as np

from third.camera import Array
from third.cells import Bench

Growth = Literal["offset", "gain", "time"]
QUANTILES = (np.arange(200) + 0.5) / 200  # over which expectations are taken
EXPONENTIAL = -np.log(1 - QUANTILES)  # quantiles of an exponential law of mean 1


def deviance(ratio: Array | float) -> Array:
    """Return the deviance of each degree of freedom of a ratio of variances."""
    given = np.asarray(ratio, float)
    return np.asarray(given - 1 - np.log(given))


def of_bent_levels(bench: Bench, deviation: Array) -> float:
    """Return the z of a deviation of mean levels; black and each colour's response are free."""
    c, floors = bench.cells, bench.floors
    wander = (floors.frame_offset**2 + (floors.frame_gain * c.signal) ** 2) / c.frames
    weight = 1 / (c.variance / (c.pixels * c.frames) + wander)
    free = [np.ones_like(c.signal)]
    free += [np.where(c.site == site, c.signal, 0) for site in np.unique(c.site)]
    design = np.array(free).T * np.sqrt(weight)[:, None]
    seen = deviation * np.sqrt(weight)
    taken, *_ = np.linalg.lstsq(design, seen, rcond=None)
    return float(np.linalg.norm(seen - design @ taken))


def of_fixed_field(bench: Bench, size: float, grows: Growth, together: int = 1) -> float:
    """Return the z of a white fixed field of which `together` pixels share each value."""
    c, floors, pixels = bench.cells, bench.floors, bench.camera.pixels
    weight = c.whole_frames / c.whole_variance
    lit = np.sum(c.whole_frames * c.whole_square / c.whole_variance)
    information = np.sum(weight) if grows == "offset" else lit
    square = lit / np.sum(weight)
    floor = floors.pixel_offset**2 + floors.pixel_gain**2 * square
    if grows != "offset":
        floor = floors.pixel_offset**2 / square + floors.pixel_gain**2
    noise = (1 / information + (floor if together > 1 else 0)) / together
    seen = (pixels / together - 1) * deviance(1 + size * size / noise)
    return float(np.sqrt(np.maximum(0, seen)))


def of_known_pattern(bench: Bench, size: float, pattern: Array, grows: Growth) -> float:
    """Return the z of a known fixed pattern, the mean level being free."""
    c, floors = bench.cells, bench.floors
    centred = pattern - pattern.mean()
    power = float((centred**2).sum())
    floor = floors.pixel_offset**2 + (floors.pixel_gain**2) * c.whole_square
    growth = {"offset": np.ones(1), "gain": c.whole_square, "time": c.whole_time**2}
    noise = c.whole_variance / c.whole_frames + floor / 3
    return float(size * np.sqrt(np.sum(growth[grows] * power / noise)))


def of_wander(bench: Bench, variance: Array | float, values: int = 1) -> float:
    """Return the z of `values` numbers a frame whose variance relative to noise is given."""
    frames = bench.cells.whole_frames
    return float(np.sqrt(np.sum(values * (frames - 1) * deviance(1 + variance))))


def of_neighbours(bench: Bench, correlation: Array | float, directions: int = 1) -> float:
    """Return the z of a correlation between neighbouring samples, in space or in time."""
    c = bench.cells
    return float(np.sqrt(np.sum(directions * c.pixels * (c.frames - 1) * correlation**2)))


def frame_floor(bench: Bench) -> Array:
    """Return the variance of frame means."""
    c, floors, camera = bench.cells, bench.floors, bench.camera
    lines = floors.row_noise**2 / camera.rows + floors.column_noise**2 / camera.columns
    return c.whole_variance / camera.pixels + lines
