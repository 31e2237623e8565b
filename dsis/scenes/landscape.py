"""Landscape: meadow, lake, village, fields, wooded hills and mountains, seen from a hillside.

The land is a height field on a polar grid around the eye; a pixel's column and the first grid
point that hides what is behind it give the place that the pixel sees.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dsis.scenes import sky
from dsis.scenes.building import Building
from dsis.scenes.light import AMBIENT, GLINT, SUN, SUNWARD, hazed, rgb
from dsis.scenes.texture import Field, Texture, pulse, step
from dsis.scenes.tree import Tree
from dsis.scenes.view import View

EYE_M, MEADOW_M = 100.0, 400.0  # the meadow is what lies nearer
STRIP = 128  # columns painted at a time: bounds the memory
OVER = 2  # samples per row, averaged: ridges are the only edges without a footprint
PROFILE = np.array(  # distance, height of the land, height of its relief in metres
    [
        [20, 92, 0.3], [60, 88, 1], [140, 74, 2], [260, 44, 3], [420, 12, 4], [560, 5, 7],
        [680, -7, 12], [1200, -8, 14], [1400, 5, 7], [2000, 9, 10], [2700, 40, 45],
        [4200, 120, 90], [5600, 100, 110], [8500, 330, 260], [12000, 560, 420], [15000, 300, 200],
    ]
)  # fmt: skip
WOODED = np.array([[300, -2], [1300, -0.7], [2000, -0.5], [3000, 0.6], [6000, 0.7], [15000, 0.5]])
RANGES = np.geomspace(PROFILE[0, 0], PROFILE[-1, 0], 620).astype(np.float32)[:, None]
CROPS = np.array(
    [
        [0.42, 0.34, 0.13], [0.50, 0.43, 0.06], [0.12, 0.20, 0.05], [0.16, 0.11, 0.07],
        [0.20, 0.26, 0.08], [0.34, 0.32, 0.14], [0.15, 0.23, 0.06], [0.26, 0.28, 0.10],
    ],
    np.float32,
)  # fmt: skip


@dataclass(frozen=True)
class Land:
    """The land as (range, column) arrays.

    Attributes
    ----------
    row
        Where a point falls.
    height
        In metres; below 0 there is water, its surface at 0.
    sunny
        Cosine of the sun's incidence.
    wood
        0 open land .. 1 wood.
    bank
        1 where the water mirrors the opposite bank instead of the sky.
    """

    row: Field
    height: Field
    sunny: Field
    wood: Field
    bank: Field


def paint(image: Field, seed: int) -> None:
    """Paint the landscape of a seed into `image`, float32 (row, column, 3)."""
    rows, columns = image.shape[:2]
    view = View(image, focal_px=2.1 * rows, horizon_row=0.31 * rows, eye_m=EYE_M, air=0.35)
    texture = Texture.of(seed)
    sky.paint(view, texture, cover=0.44)
    for first in range(0, columns, STRIP):
        azimuth = view.azimuths(first, first + STRIP)
        _strip(view, texture, _land(view, texture, azimuth), first, azimuth)
    things = sorted(_things(view, texture, seed), key=lambda found: -found[0])
    for _, thing, azimuth, lowest_row in things:
        thing.paint(view, texture, azimuth, lowest_row)


def _land(view: View, texture: Texture, azimuth: Field) -> Land:
    """Return the land at these azimuths, (1, column)."""
    gap = np.float32(1 / view.focal_px)
    wider = np.concatenate([azimuth[:, :1] - gap, azimuth, azimuth[:, -1:] + gap], axis=1)
    x, y = RANGES * np.sin(wider), RANGES * np.cos(wider)
    bend = texture.fractal(3 * wider, np.full((1, 1), 0.5, np.float32), 3)
    bent = RANGES * (1 + 0.12 * bend)  # brow and shores are no circles
    level, relief = (
        np.interp(bent, PROFILE[:, 0], PROFILE[:, n]).astype(np.float32) for n in (1, 2)
    )
    hills = texture.fractal(x / 420, y / 420, 5, RANGES / (300 * 420))
    crests = 1 - 2 * np.abs(texture.fractal(x / 3000 + 9, y / 3000 + 5, 7, RANGES / (200 * 3000)))
    height = level + relief * (hills + step(RANGES, 2200, 7000) * (crests - hills))
    wood = texture.fractal(x / 600 + 40, y / 600, 4, RANGES / (200 * 600))
    wood += np.interp(RANGES, WOODED[:, 0], WOODED[:, 1]).astype(np.float32)
    wood = step(wood, 0, 0.03) * step(height, 1.5, 3)
    crowns = texture.fractal(x / 11, y / 23, 2, RANGES / np.float32(11 * view.focal_px))
    height += wood * (12 + 5 * crowns)
    ahead = (np.gradient(height, axis=0) / np.gradient(RANGES, axis=0))[:, 1:-1]
    aside = (height[:, 2:] - height[:, :-2]) / (2 * gap * RANGES)
    height, wood = height[:, 1:-1], wood[:, 1:-1]
    to_sun = np.float32(math.atan2(SUNWARD[0], SUNWARD[1])) - azimuth
    lean = math.hypot(SUNWARD[0], SUNWARD[1]) * (ahead * np.cos(to_sun) + aside * np.sin(to_sun))
    sunny = np.maximum(SUNWARD[2] - lean, 0) / np.sqrt(1 + ahead * ahead + aside * aside)
    surface = np.maximum(height, 0)
    bank = np.zeros_like(height)
    for n in range(1, 40):  # does a ray mirrored here meet the land n points on?
        rise = (RANGES[n:] - RANGES[:-n]) * (EYE_M / RANGES[:-n])
        bank[:-n] = np.maximum(bank[:-n], surface[n:] > rise)
    row = view.horizon_row - view.focal_px * (surface - EYE_M) / RANGES
    return Land(row, height, sunny, wood, bank)


def _strip(view: View, texture: Texture, land: Land, first: int, azimuth: Field) -> None:
    """Paint the land of a strip of columns over its sky."""
    count = azimuth.shape[1]
    rows = (np.arange(view.image.shape[0] * OVER, dtype=np.float32) + 0.5) / OVER
    scene = np.repeat(view.image[:, first : first + count], OVER, axis=0)
    point, share = _hits(land, rows)
    row, column = np.nonzero(point < len(RANGES))
    far, part = point[row, column], share[row, column]

    def seen(grid: Field) -> Field:
        low, high = grid[far - 1, column], grid[far, column]
        between: Field = low + part * (high - low)
        return between

    distance = RANGES[far - 1, 0] + part * (RANGES[far, 0] - RANGES[far - 1, 0])
    az, height, wood = azimuth[0, column], seen(land.height), seen(land.wood)
    wet, close = height < 0, distance < MEADOW_M
    away = ~(wet | close)
    albedo = np.zeros((row.size, 3), np.float32)
    albedo[close] = _meadow(view, texture, az[close], distance[close])
    albedo[away] = _country(view, texture, az[away], distance[away], height[away], wood[away])
    light = seen(land.sunny)[:, None] * SUN + AMBIENT
    scene[row, column] = hazed(np.float32(1.1) * albedo * light, distance, view.air)
    at = row[wet], column[wet]
    scene[at] = _water(view, texture, scene, at, az[wet], distance[wet], seen(land.bank)[wet])
    view.image[:, first : first + count] = scene.reshape(-1, OVER, count, 3).mean(axis=1)


def _hits(land: Land, rows: Field) -> tuple[NDArray[np.int64], Field]:
    """Return the grid point behind what (row, column) sees, and the share of the way to it."""
    skyline = -np.minimum.accumulate(land.row, axis=0)
    columns = np.arange(skyline.shape[1])
    point = np.stack([np.searchsorted(skyline[:, c], -rows) for c in columns], axis=1)
    far = np.clip(point, 1, len(RANGES) - 1)
    near_row, far_row = land.row[far - 1, columns], land.row[far, columns]
    share = (near_row - rows[:, None]) / np.maximum(near_row - far_row, 1e-6)
    return np.maximum(point, 1), np.clip(share, 0, 1)


def _upright(
    texture: Texture,
    az: Field,
    distance: Field,
    v: Field,
    size_m: float,
    octaves: int,
    pixel: Field,
) -> Field:
    """Return noise in features `size_m` wide across the view, whatever the distance.

    Azimuth times distance would shear it along a column; so use the powers of two on both sides
    of the distance, fading from one to the other.
    """
    level = np.log2(distance)
    band = np.floor(level)
    total: Field = np.zeros_like(distance)
    for power, weight in ((band, band + 1 - level), (band + 1, level - band)):
        u = az * np.exp2(power) / np.float32(size_m) + 17 * power
        total += np.sqrt(weight) * texture.fractal(u, v, octaves, pixel / np.float32(size_m))
    return total


def _meadow(view: View, texture: Texture, az: Field, distance: Field) -> Field:
    """Return the albedo of grass, dry grass and flowers, (point, 3)."""
    x, y = distance * np.sin(az), distance * np.cos(az)
    pixel = distance / np.float32(view.focal_px)
    tall = 12 * np.log(distance)  # metres up the picture: the slope passes 12 m below the eye
    tuft = texture.fractal(x / 3, y / 3, 5, pixel * distance / 40)
    blade = _upright(texture, az, distance, tall / 0.3, 0.10, 4, pixel)
    dry = step(texture.fractal(x / 14 + 70, y / 14, 4), -0.6, 1.0)
    green, straw = rgb(0.15, 0.21, 0.04), rgb(0.33, 0.30, 0.11)
    colour = (green + dry[:, None] * (straw - green)) * np.exp(0.3 * tuft + 0.42 * blade)[:, None]
    bloom = _upright(texture, az + 5, distance, tall / 0.09, 0.09, 1, pixel)
    patch = step(texture.fractal(x / 9 + 30, y / 9 + 9, 2), 0.0, 0.9)
    flowers = step(bloom + 0.35 * patch, 0.8, 0.95) * step(patch, 0, 0.3)
    petals = np.where((tuft > 0)[:, None], rgb(0.8, 0.78, 0.7), rgb(0.75, 0.6, 0.05))
    mixed: Field = colour + flowers[:, None] * (petals - colour)
    return mixed


def _country(
    view: View, texture: Texture, az: Field, distance: Field, height: Field, wood: Field
) -> Field:
    """Return the albedo of fields, alps, woods and rock, in the shadow of clouds, (point, 3)."""
    x, y = distance * np.sin(az), distance * np.cos(az)
    pixel = distance / np.float32(view.focal_px)
    deep = pixel * np.minimum(distance / np.maximum(EYE_M - height, 9), 30)
    bend = np.float32(0.3) * texture.value(x / 500, y / 500)
    p, q = (0.8 * x - 0.6 * y) / 150 + bend, (0.6 * x + 0.8 * y) / 260 - bend
    q += 0.5 * np.floor(p)
    crop = CROPS.take((3.999 * (1 + texture.cell(p, q, 3))).astype(np.int32), axis=0)
    across = np.where(texture.cell(p, q, 5) > 0, 15 * p, 26 * q)
    hedge = 1 - pulse(p, 0.975, deep / 150) * pulse(q, 0.985, deep / 260)
    patchy = texture.fractal(x / 40, y / 40, 4, deep / 40)
    colour = crop * (0.86 + 0.25 * pulse(across, 0.5, deep / 10) + 0.12 * patchy)[:, None]
    colour += hedge[:, None] * (rgb(0.02, 0.035, 0.012) - colour)
    alp = rgb(0.17, 0.21, 0.07) * (1 + 0.3 * patchy[:, None])
    colour += step(height, 60, 110)[:, None] * (alp - colour)
    crown = _upright(texture, az, distance, (height + 0.3 * distance) / 4.5, 6.5, 4, pixel)
    trees = (0.1 + step(crown, -1.0, 1.2) ** 1.5)[:, None] * rgb(0.11, 0.155, 0.045)
    colour += np.minimum(8 * wood, 1)[:, None] * (trees - colour)
    rock = rgb(0.34, 0.32, 0.30) * (0.9 + 0.3 * crown[:, None])
    colour += step(height + 60 * crown, 400, 620)[:, None] * (rock - colour)
    clouds = step(texture.fractal(x / 1300, y / 1300 + 8, 3), -0.55, -0.1)
    shaded: Field = colour * (0.2 + 0.8 * clouds)[:, None]
    return shaded


def _water(
    view: View,
    texture: Texture,
    scene: Field,
    at: tuple[NDArray[np.int64], NDArray[np.int64]],
    az: Field,
    distance: Field,
    bank: Field,
) -> Field:
    """Return the lake: sky and banks mirrored in ripples, the deep below, the sun's glitter."""
    row, slope = at[0] / OVER, EYE_M / distance
    ripple = texture.fractal(120 * az, 350 * slope, 4, 350 / view.focal_px)
    calm = step(texture.fractal(6 * az, 60 * slope, 3), -0.4, 0.5)
    mirrored = np.abs(2 * view.horizon_row - row + 0.012 * view.focal_px * ripple)
    above = np.minimum((OVER * mirrored).astype(np.int64), scene.shape[0] - 1)
    deep = rgb(0.008, 0.018, 0.022)
    colour = deep + (0.36 + 0.16 * calm)[:, None] * (scene[above, at[1]] - deep)
    colour += step(bank + 0.25 * ripple, 0.3, 0.7)[:, None] * (rgb(0.02, 0.035, 0.03) - colour)
    colour *= (1 + 0.25 * ripple * (1 - calm))[:, None]
    spark = texture.value(180 * az + 7, 900 * slope) + 0.1 * texture.value(5 * az, 40 * slope)
    glitter: Field = colour + step(spark, 0.80, 1.03)[:, None] * (GLINT - colour)
    return glitter


def _things(
    view: View, texture: Texture, seed: int
) -> Iterator[tuple[float, Tree | Building, float, float]]:
    """Yield (distance, thing, azimuth, lowest row seen) of what stands on dry land."""
    rng = np.random.Generator(np.random.PCG64(seed))
    for turn in range(math.ceil(view.image.shape[1] / view.focal_px / 0.3) + 1):
        group = 0.3 * (turn + rng.uniform(-0.2, 0.7))
        places = [(group + rng.uniform(-0.07, 0.07), rng.uniform(55, 130), 0) for _ in range(2)]
        places += [(0.3 * (turn + rng.random()), rng.uniform(620, 2200), 0) for _ in range(36)]
        village = 0.3 * (turn + rng.random())
        places += [
            (village + rng.normal(0, 0.03), rng.uniform(1450, 1900), n) for n in range(1, 15)
        ]
        for azimuth, distance, house_number in places:
            size, style = rng.random(), rng.random()
            land = _land(view, texture, np.full((1, 1), azimuth, np.float32))
            point = int(np.searchsorted(RANGES[:, 0], distance))
            base, ridge = float(land.height[point, 0]), float(land.row[:point].min())
            lowest = ridge + 2 if ridge < land.row[point, 0] else math.inf
            x, y = distance * math.sin(azimuth), distance * math.cos(azimuth)
            if base < 0.5:
                continue
            if house_number == 0:
                tall = 8 + 7 * size if distance < MEADOW_M else 5 + 12 * size
                yield distance, Tree(x, y, base, tall, style), azimuth, lowest
            else:
                church = house_number == 1
                wide, eaves = (7.0, base + 22) if church else (10 + 6 * size, base + 5 + 3 * size)
                yield (
                    distance,
                    Building(
                        *(x, y, 6 * style, wide, 7 + size, base - 3, eaves),
                        *("spire" if church else "gable", "house", style),
                    ),
                    azimuth,
                    lowest,
                )
