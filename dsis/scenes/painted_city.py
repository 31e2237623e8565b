"""City: blocks of houses, towers, churches and parks, seen from 62 m above the streets."""

import math
from collections.abc import Iterator

import numpy as np

from dsis.scenes import painted_sky
from dsis.scenes.block import BLOCK_M, GRID_RAD, ROW_M, Block, Thing
from dsis.scenes.light import rgb
from dsis.scenes.surfaces import STREET_M
from dsis.scenes.texture import Field, Texture, pulse, step
from dsis.scenes.view import View

EYE_M = 62.0
NEAREST_M, FARTHEST_M = 150.0, 2900.0


def paint(image: Field, seed: int) -> None:
    """Paint the city of a seed into `image`, float32 (row, column, 3)."""
    rows = image.shape[0]
    view = View(image, focal_px=2.75 * rows, horizon_row=0.28 * rows, eye_m=EYE_M, air=1.0)
    texture = Texture.of(seed)
    painted_sky.paint(view, texture, cover=0.38)
    _hills(view, texture)
    _ground(view, texture)
    things = list(_visible(view, _layout(view, seed)))
    for thing, azimuth, lowest_row in reversed(things):
        thing.paint(view, texture, azimuth, lowest_row)


def _visible(view: View, things: list[Thing]) -> Iterator[tuple[Thing, float, float]]:
    """Yield, from near to far, (thing, azimuth, row below which nearer things hide it)."""
    skyline = np.full(view.image.shape[1], np.inf)
    for thing in sorted(things, key=lambda thing: math.hypot(thing.x, thing.y)):
        distance = math.hypot(thing.x, thing.y)
        for azimuth in view.turns(math.atan2(thing.x, thing.y), 60 / distance):
            solid = [view.project(point, azimuth) for point in thing.occluder()]
            reach = max([abs(c - azimuth * view.focal_px) for c, _ in solid], default=0.0)
            reach = reach or 20 * view.focal_px / distance
            centre = azimuth * view.focal_px
            first, last = max(int(centre - reach) - 1, 0), max(int(centre + reach) + 2, 0)
            if skyline[first:last].size:
                yield thing, azimuth, float(skyline[first:last].max()) + 1
            if solid:
                columns = [c for c, _ in solid]
                hidden = skyline[max(int(min(columns)) + 2, 0) : max(int(max(columns)) - 1, 0)]
                np.minimum(hidden, max(r for _, r in solid) + 1, out=hidden)


def _hills(view: View, texture: Texture) -> None:
    """Paint two wooded ridges behind the city."""
    azimuth = view.azimuths()
    rows = np.arange(view.image.shape[0], dtype=np.float32)[:, None]
    for height, distance, shift in ((0.022, 16000, 0.0), (0.013, 9000, 50.0)):
        across = 5 * azimuth + np.float32(shift)
        profile = texture.fractal(across, np.full((1, 1), shift, np.float32), 7, 5 / view.focal_px)
        ridge = view.horizon_row - view.focal_px * height * (0.5 + 0.5 * profile)
        first, last = int(ridge.min()) - 1, int(view.horizon_row + 0.008 * view.focal_px)
        slope = view.slopes(first, last)
        trees = texture.fractal(60 * across, 700 * slope, 4, 300 / view.focal_px)
        colour = (1 + np.float32(0.5) * trees)[..., None] * rgb(0.05, 0.08, 0.03)
        far = np.full((1, 1), distance, np.float32)
        view.blend(first, 0, colour, far, np.clip(rows[first:last] + 1 - ridge, 0, 1))


def _ground(view: View, texture: Texture) -> None:
    """Paint streets and courts, in the shadow of the houses, from the horizon down."""
    azimuth = view.azimuths()
    sin, cos = np.sin(azimuth + np.float32(GRID_RAD)), np.cos(azimuth + np.float32(GRID_RAD))
    start = math.ceil(view.horizon_row + view.focal_px * EYE_M / 9000)
    for first in range(start, view.image.shape[0], painted_sky.ROWS_AT_ONCE):
        distance = EYE_M / -view.slopes(first, first + painted_sky.ROWS_AT_ONCE)
        a, b = distance * sin / np.float32(BLOCK_M), distance * cos / np.float32(ROW_M)
        deep = distance * distance / np.float32(EYE_M * view.focal_px)  # a pixel, along the view
        wide = distance / np.float32(view.focal_px)
        fa = (np.abs(sin) * deep + np.abs(cos) * wide) / BLOCK_M
        fb = (np.abs(cos) * deep + np.abs(sin) * wide) / ROW_M
        court, kerb = (
            pulse(a, 1 - width / BLOCK_M, fa) * pulse(b, 1 - width / ROW_M, fb)
            for width in (STREET_M, 9.0)
        )
        line = np.maximum(pulse(a + 0.5, 0.3 / BLOCK_M, fa), pulse(b + 0.5, 0.3 / ROW_M, fb))
        dashes = line * pulse(12 * (a + b), 0.5, 12 * (fa + fb))
        stain = texture.fractal(14 * a, 14 * b, 4, deep / 7)
        colour = (0.012 + 0.024 * kerb + 0.05 * dashes)[..., None] * rgb(0.9, 1.0, 1.15)
        colour += court[..., None] * (rgb(0.008, 0.011, 0.005) - colour)
        colour *= 1 + 0.4 * stain[..., None]
        suburbs = (0.10 + 0.06 * stain)[..., None] * rgb(1.1, 0.95, 0.75)
        outside = step(distance, 0.7 * FARTHEST_M, FARTHEST_M)
        colour += outside[..., None] * (suburbs - colour)
        view.blend(first, 0, colour, distance, np.ones_like(stain))


def _layout(view: View, seed: int) -> list[Thing]:
    """Return what may be in view; a block's content depends on the seed and the block alone."""
    things: list[Thing] = []
    reach = math.ceil(FARTHEST_M / min(BLOCK_M, ROW_M))
    for i in range(-reach, reach):
        for j in range(-reach, reach):
            a, b = (i + 0.5) * BLOCK_M, (j + 0.5) * ROW_M
            distance = math.hypot(a, b)
            in_view = view.turns(math.atan2(a, b) - GRID_RAD, 65 / max(distance, 65))
            if NEAREST_M < distance < FARTHEST_M and in_view:
                rng = np.random.Generator(np.random.PCG64([seed, i + reach, j + reach]))
                things += Block(rng, a, b).things(distance)
    return things
