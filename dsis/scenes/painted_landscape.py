"""Landscape: meadow, lake, villages, fields, wooded hills and mountains, seen from a hillside."""

import math
from collections.abc import Iterator

import numpy as np

from dsis.scenes import painted_sky
from dsis.scenes.building import Building
from dsis.scenes.groundcover import country, meadow, water
from dsis.scenes.light import AMBIENT, SUN, hazed
from dsis.scenes.relief import EYE_M, RANGES, Land, hits, land_at
from dsis.scenes.texture import Field, Texture
from dsis.scenes.tree import Tree
from dsis.scenes.view import View

BOUNCE = 1.1  # light from the land around
MEADOW_M = 400.0  # the meadow is what lies nearer
STRIP = 128  # columns painted at a time: bounds the memory
OVER = 2  # samples per row, averaged: ridges are the only edges without a footprint
GROUP_RAD = 0.3  # there are a few trees and a village in every such part of the view


def paint(image: Field, seed: int) -> None:
    """Paint the landscape of a seed into `image`, float32 (row, column, 3)."""
    rows, columns = image.shape[:2]
    view = View(image, focal_px=2.1 * rows, horizon_row=0.31 * rows, eye_m=EYE_M, air=0.35)
    texture = Texture.of(seed)
    painted_sky.paint(view, texture, cover=0.44)
    for first in range(0, columns, STRIP):
        azimuth = view.azimuths(first, first + STRIP)
        _strip(view, texture, land_at(view, texture, azimuth), first, azimuth)
    things = sorted(_things(view, texture, seed), key=lambda found: -found[0])
    for _, thing, turn, lowest_row in things:
        thing.paint(view, texture, turn, lowest_row)


def _strip(view: View, texture: Texture, land: Land, first: int, azimuth: Field) -> None:
    """Paint the land of a strip of columns over its sky."""
    count = azimuth.shape[1]
    rows = (np.arange(view.image.shape[0] * OVER, dtype=np.float32) + 0.5) / OVER
    scene = np.repeat(view.image[:, first : first + count], OVER, axis=0)
    point, share = hits(land, rows)
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
    albedo[close] = meadow(view, texture, az[close], distance[close])
    albedo[away] = country(view, texture, az[away], distance[away], height[away], wood[away])
    light = seen(land.sunny)[:, None] * SUN + AMBIENT
    scene[row, column] = hazed(np.float32(BOUNCE) * albedo * light, distance, view.air)
    at = row[wet], column[wet]
    scene[at] = water(view, texture, scene, at, az[wet], distance[wet], seen(land.bank)[wet])
    view.image[:, first : first + count] = scene.reshape(-1, OVER, count, 3).mean(axis=1)


def _things(
    view: View, texture: Texture, seed: int
) -> Iterator[tuple[float, Tree | Building, float, float]]:
    """Yield (distance, thing, azimuth, lowest row seen) of what stands on dry land."""
    rng = np.random.Generator(np.random.PCG64(seed))
    for turn in range(math.ceil(view.image.shape[1] / view.focal_px / GROUP_RAD) + 1):
        # (azimuth, distance, 0 for a tree or the number of the house)
        group = GROUP_RAD * (turn + rng.uniform(-0.2, 0.7))
        places = [(group + rng.uniform(-0.07, 0.07), rng.uniform(55, 130), 0) for _ in range(2)]
        places += [
            (GROUP_RAD * (turn + rng.random()), rng.uniform(620, 2200), 0) for _ in range(36)
        ]
        village = GROUP_RAD * (turn + rng.random())
        places += [
            (village + rng.normal(0, 0.03), rng.uniform(1450, 1900), n) for n in range(1, 15)
        ]
        for azimuth, distance, house_number in places:
            size, style = rng.random(), rng.random()
            land = land_at(view, texture, np.full((1, 1), azimuth, np.float32))
            point = int(np.searchsorted(RANGES[:, 0], distance))
            base, ridge = float(land.height[point, 0]), float(land.row[:point].min())
            lowest = ridge + 2 if ridge < land.row[point, 0] else math.inf
            if base > 0.5:
                thing: Tree | Building = _tree(azimuth, distance, base, size, style)
                if house_number:
                    thing = _house(azimuth, distance, base, size, style, church=house_number == 1)
                yield distance, thing, azimuth, lowest


def _tree(azimuth: float, distance: float, base: float, size: float, style: float) -> Tree:
    x, y = distance * math.sin(azimuth), distance * math.cos(azimuth)
    tall = 8 + 7 * size if distance < MEADOW_M else 5 + 12 * size
    return Tree(x, y, base, tall, style)


def _house(
    azimuth: float, distance: float, base: float, size: float, style: float, *, church: bool
) -> Building:
    x, y = distance * math.sin(azimuth), distance * math.cos(azimuth)
    wide, tall, roof = (7.0, 22.0, "spire") if church else (10 + 6 * size, 5 + 3 * size, "gable")
    plan = (x, y, 6 * style, wide, 7 + size)
    return Building(*plan, base - 3, base + tall, roof, "house", style)
