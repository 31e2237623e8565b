"""Landscape: meadow, lake, fields, wooded hills and mountains, seen from a hillside."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dsis.scenes import sky
from dsis.scenes.texture import Field, Texture, pulse, step
from dsis.scenes.tree import Tree
from dsis.scenes.view import View

EYE_M = 100.0
MEADOW_M = 400.0
STRIP = 128  # columns painted at a time
OVER = 2  # samples per row, averaged: ridges are the only edges that no footprint softens
SUN = sky.sun_direction(-1.35, 0.5)
# Range, height of the land, height of its relief, all in metres.
PROFILE = np.array(
    [
        [20, 92, 0.2], [60, 88, 0.6], [140, 74, 1.5], [260, 44, 3], [420, 12, 4], [560, 5, 7],
        [680, -5, 12], [1200, -6, 14], [1400, 5, 7], [2000, 9, 10], [2700, 40, 45], [4200, 120, 90],
        [5600, 100, 110], [8500, 330, 260], [12000, 560, 420], [15000, 300, 200],
    ]
)  # fmt: skip
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
    """The relief on a polar grid: (range, column) arrays.

    Attributes
    ----------
    row
        Where each point falls.
    height
        In metres; water lies at 0.
    sunny
        Cosine of the sun's incidence.
    wood
        0 open land .. 1 wood.
    bank
        1 where water mirrors the opposite bank, not the sky.
    """

    row: Field
    height: Field
    sunny: Field
    wood: Field
    bank: Field


def paint(image: Field, seed: int) -> None:
    """Paint the landscape of a seed into float32 (row, column, 3)."""
    rows, columns = image.shape[:2]
    view = View(image, focal_px=2.1 * rows, horizon_row=0.31 * rows, eye_m=EYE_M, air=0.35)
    rng = np.random.Generator(np.random.PCG64(seed))
    texture = Texture.of(rng)
    sky.paint(view, texture, cover=0.44)
    trees = _trees(rng, columns / view.focal_px)
    for first in range(0, columns, STRIP):
        azimuth = view.azimuths(first, min(first + STRIP, columns))
        land = _relief(view, texture, azimuth)
        _strip(view, texture, land, first, azimuth)
    for tree in sorted(trees, key=lambda tree: -math.hypot(tree.x, tree.y)):
        azimuth = math.atan2(tree.x, tree.y) % math.tau
        for turn in view.turns(azimuth, 15 / math.hypot(tree.x, tree.y)):
            _plant(view, texture, tree, turn)


def _relief(view: View, texture: Texture, azimuth: Field) -> Land:
    """Return the land under the given azimuths."""
    spare = np.float32(1 / view.focal_px)
    wider = np.concatenate([azimuth[:, :1] - spare, azimuth, azimuth[:, -1:] + spare], axis=1)
    x, y = RANGES * np.sin(wider), RANGES * np.cos(wider)
    level, relief = (np.interp(RANGES, PROFILE[:, 0], PROFILE[:, n]) for n in (1, 2))
    shape = texture.fractal(x / 420, y / 420, 5, RANGES / 300 / 420)
    grand = texture.fractal(x / 3000 + 9, y / 3000 + 5, 7, RANGES / 200 / 3000)
    far = step(RANGES, 2200, 7000)
    height = level + relief * ((1 - far) * shape + far * (1 - 2 * np.abs(grand)))
    height = height.astype(np.float32)
    wood = texture.fractal(x / 600 + 40, y / 600, 4, RANGES / 200 / 600)
    wood += np.interp(
        RANGES, [300, 1300, 2000, 3000, 6000, 15000], [-2, -0.7, -0.5, 0.6, 0.7, 0.5]
    ).astype(np.float32)
    wood = step(wood, 0, 0.03) * step(height, 1.5, 3)
    crowns = texture.fractal(x / 11, y / 23, 2, RANGES / view.focal_px / 11)
    height = height + wood * (12 + 5 * crowns)
    up = np.gradient(height, axis=0) / np.gradient(RANGES, axis=0)
    aside = (height[:, 2:] - height[:, :-2]) / (2 * spare * RANGES)
    turn = np.float32(math.atan2(SUN[0], SUN[1])) - azimuth
    flat = np.float32(math.hypot(SUN[0], SUN[1]))
    height, up, wood = height[:, 1:-1], up[:, 1:-1], wood[:, 1:-1]
    tilt = np.float32(SUN[2]) - flat * (up * np.cos(turn) + aside * np.sin(turn))
    sunny = np.maximum(tilt / np.sqrt(1 + up * up + aside * aside), 0)
    shore = np.maximum(height, 0)
    row = view.horizon_row - view.focal_px * (shore - EYE_M) / RANGES
    bank = np.zeros_like(height)
    for ahead in range(1, 40):
        rise = (RANGES[ahead:] - RANGES[:-ahead]) * (EYE_M / RANGES[:-ahead])
        bank[:-ahead] = np.maximum(bank[:-ahead], shore[ahead:] > rise)
    return Land(row, height, sunny, wood, bank)


def _strip(view: View, texture: Texture, land: Land, first: int, azimuth: Field) -> None:
    """Paint the land of a strip of columns over its sky."""
    count = azimuth.shape[1]
    rows = (np.arange(view.image.shape[0] * OVER, dtype=np.float32) + 0.5)[:, None] / OVER
    behind = np.repeat(view.image[:, first : first + count], OVER, axis=0)
    seen, depth, share = _hits(land, rows)
    at = np.flatnonzero(seen)
    row, column = np.divmod(at, count)
    far, near = depth[seen], depth[seen] - 1
    part = share[seen]

    def between(grid: Field) -> Field:
        low, high = grid[near, column], grid[far, column]
        mixed: Field = low + part * (high - low)
        return mixed

    distance = RANGES[near, 0] + part * (RANGES[far, 0] - RANGES[near, 0])
    az = azimuth[0, column]
    height, wood, sunny = between(land.height), between(land.wood), between(land.sunny)
    wet, close = height < 0, distance < MEADOW_M
    colour = np.zeros((at.size, 3), np.float32)
    away = ~(wet | close)
    colour[close] = _meadow(view, texture, az[close], distance[close])
    colour[away] = _country(view, texture, az[away], distance[away], height[away], wood[away])
    colour *= sunny[:, None] * (1.25 * sky.SUN) + 1.25 * sky.AMBIENT
    flat = behind.reshape(-1, 3)
    flat[at] = sky.hazed(colour, distance, view.air)
    flat[at[wet]] = _water(
        view,
        texture,
        behind,
        rows[row[wet], 0],
        column[wet],
        az[wet],
        distance[wet],
        between(land.bank)[wet],
    )
    view.image[:, first : first + count] = behind.reshape(-1, OVER, count, 3).mean(axis=1)


def _hits(land: Land, rows: Field) -> tuple[NDArray[np.bool_], NDArray[np.int64], Field]:
    """Return where land is seen, the grid point behind each hit, and the share of the way to it."""
    skyline = np.minimum.accumulate(land.row, axis=0)
    depth = np.empty((rows.shape[0], land.row.shape[1]), np.int64)
    for column in range(depth.shape[1]):
        depth[:, column] = np.searchsorted(-skyline[:, column], -rows[:, 0], side="left")
    seen = depth < len(RANGES)
    depth = np.clip(depth, 1, len(RANGES) - 1)
    columns = np.arange(depth.shape[1])[None, :]
    near, far = land.row[depth - 1, columns], land.row[depth, columns]
    share = np.clip((near - rows) / np.maximum(near - far, 1e-6), 0, 1)
    return seen, depth, share


def _meadow(view: View, texture: Texture, az: Field, distance: Field) -> Field:
    """Return the albedo of the hillside at points given one by one: grass, dry grass, flowers."""
    x, y = distance * np.sin(az), distance * np.cos(az)
    pixel = distance / np.float32(view.focal_px)
    tall = 12 * np.log(distance)  # metres up the picture: the hillside is 12 m below the eye
    tuft = texture.fractal(x / 3, y / 3, 5, pixel * distance / 40)
    blade = _upright(texture, az, distance, tall / 0.3, 0.10, 3, pixel)
    dry = step(texture.fractal(x / 14 + 70, y / 14, 4), -0.6, 1.0)
    grass, straw = np.float32([0.14, 0.20, 0.04]), np.float32([0.34, 0.30, 0.11])
    colour = (grass + dry[..., None] * (straw - grass)) * np.exp(0.5 * tuft + 0.8 * blade)[
        ..., None
    ]
    bloom = _upright(texture, az + 5, distance, tall / 0.13, 0.13, 1, pixel)
    where = step(texture.fractal(x / 9 + 30, y / 9 + 9, 2), 0.0, 0.9)
    flower = step(bloom + 0.35 * where, 0.8, 0.95) * step(where, 0, 0.3)
    petal = np.where(
        (tuft > 0)[..., None], np.float32([0.8, 0.78, 0.7]), np.float32([0.75, 0.6, 0.05])
    )
    shaded: Field = colour + flower[..., None] * (petal - colour)
    return shaded


def _country(
    view: View, texture: Texture, az: Field, distance: Field, height: Field, wood: Field
) -> Field:
    """Return the albedo of valley and hills at points given one by one: fields, woods, rock."""
    x, y = distance * np.sin(az), distance * np.cos(az)
    pixel = distance / np.float32(view.focal_px)
    deep = pixel * np.minimum(distance / np.maximum(EYE_M - height, 9), 30)
    bend = np.float32(0.3) * texture.value(x / 500, y / 500)
    p, q = (0.8 * x - 0.6 * y) / 150 + bend, (0.6 * x + 0.8 * y) / 260 - bend
    q = q + np.float32(0.5) * np.floor(p)
    crop = CROPS.take(((texture.cell(p, q, 3) + 1) * 3.999).astype(np.int32), axis=0)
    turned = texture.cell(p, q, 5) > 0
    furrow = pulse(np.where(turned, p * 50, q * 86), 0.5, deep / 3)
    hedge = 1 - pulse(p, 0.975, deep / 150) * pulse(q, 0.985, deep / 260)
    patchy = texture.fractal(x / 40, y / 40, 4, deep / 40)
    colour = crop * (0.86 + 0.28 * furrow + 0.12 * patchy)[..., None]
    colour += hedge[..., None] * (np.float32([0.02, 0.035, 0.012]) - colour)
    alp = np.float32([0.17, 0.21, 0.07]) * (1 + 0.3 * patchy[..., None])
    colour += step(height, 60, 110)[..., None] * (alp - colour)
    # Woods: crowns lit from above, black between them; rock high up.
    crown = _upright(texture, az, distance, (height + 0.3 * distance) / 4.5, 6.5, 4, pixel)
    trees = (0.06 + step(crown, -0.9, 1.1) ** 1.5)[..., None] * np.float32([0.11, 0.155, 0.045])
    colour += np.minimum(8 * wood, 1)[..., None] * (trees - colour)
    rock = np.float32([0.34, 0.32, 0.30]) * (0.9 + 0.3 * crown[..., None])
    colour += step(height + 60 * crown, 400, 620)[..., None] * (rock - colour)
    cloud = 0.2 + 0.8 * step(texture.fractal(x / 1300, y / 1300 + 8, 3), -0.55, -0.1)
    shaded: Field = colour * cloud[..., None]
    return shaded


def _upright(
    texture: Texture,
    az: Field,
    distance: Field,
    v: Field,
    size_m: float,
    octaves: int,
    pixel: Field,
) -> Field:
    """Return noise in features `size_m` wide across the view at every distance, not sheared by it.

    Azimuth times distance would slant along a column; so use the power of two next to the
    distance, faded from one to the next.
    """
    level = np.log2(distance)
    band = np.floor(level)
    total: Field = np.zeros_like(distance)
    for k, weight in ((band, np.sqrt(1 - level + band)), (band + 1, np.sqrt(level - band))):
        u = az * np.exp2(k) / np.float32(size_m)
        total += weight * texture.fractal(u + 17 * k, v, octaves, pixel / np.float32(size_m))
    return total


def _water(
    view: View,
    texture: Texture,
    scene: Field,
    row: Field,
    column: NDArray[np.int64],
    az: Field,
    distance: Field,
    bank: Field,
) -> Field:
    """Return the lake: the mirrored scene in ripples, the deep below, glitter of the sun."""
    ripple = texture.fractal(az * 300, np.log(distance) * 160, 4, 300 / view.focal_px)
    mirrored = 2 * view.horizon_row - row + ripple * np.float32(0.012 * view.focal_px)
    above = np.clip((np.abs(mirrored) * OVER).astype(np.int64), 0, scene.shape[0] - 1)
    calm = step(texture.fractal(az * 6, np.log(distance) * 9, 3), -0.4, 0.5)
    mirror = 0.42 + 0.2 * calm
    deep = np.array([0.008, 0.018, 0.022], np.float32)
    colour = deep + mirror[..., None] * (scene[above, column] - deep)
    shade = step(bank + 0.25 * ripple, 0.3, 0.7)[..., None]
    colour += shade * (np.float32([0.02, 0.035, 0.03]) - colour)
    colour *= (1 + 0.25 * ripple * (1 - calm))[..., None]
    spark = texture.fractal(az * 420, np.log(distance) * 420, 2, 420 / view.focal_px)
    windy = texture.fractal(az * 4 + 9, np.log(distance) * 5, 2)
    glint = step(spark + 0.5 * windy, 0.72, 0.95)[..., None]
    glitter: Field = colour + glint * (np.array([3.6, 3.3, 2.8], np.float32) - colour)
    return glitter


def _trees(rng: np.random.Generator, width_rad: float) -> list[Tree]:
    """Return trees of the foreground and of the valley, a few per unit of azimuth."""
    trees = []
    for turn in range(math.ceil(width_rad / 0.3) + 1):
        centre = 0.3 * (turn + rng.uniform(-0.2, 0.7))
        for _ in range(rng.integers(1, 4)):
            az, distance = centre + rng.uniform(-0.07, 0.07), rng.uniform(55, 130)
            trees.append((az, distance, rng.uniform(8, 15)))
        for _ in range(36):
            trees.append((0.3 * (turn + rng.random()), rng.uniform(620, 2200), rng.uniform(5, 17)))
    return [
        Tree(r * math.sin(az), r * math.cos(az), 0, tall, rng.random()) for az, r, tall in trees
    ]


def _plant(view: View, texture: Texture, tree: Tree, azimuth: float) -> None:
    """Put a tree on the land and paint it, if it does not stand in water."""
    land = _relief(view, texture, np.float32([[azimuth]]))
    distance = math.hypot(tree.x, tree.y)
    index = int(np.searchsorted(RANGES[:, 0], distance))
    base = float(land.height[index, 0])
    hidden_below = float(land.row[: index + 1, 0].min())
    if base > 0.5:
        Tree(tree.x, tree.y, base, tree.height, tree.style).paint(
            view, texture, azimuth, hidden_below + 2
        )
