"""The relief of the landscape: a height field on a polar grid around the eye."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dsis.scenes.light import SUNWARD
from dsis.scenes.texture import Field, Texture, step
from dsis.scenes.view import View

EYE_M = 100.0
PROFILE = np.array(  # distance, height of the land, height of its relief in metres
    [
        [20, 92, 0.3], [60, 88, 1], [140, 74, 2], [260, 44, 3], [420, 12, 4], [560, 5, 7],
        [660, -10, 12], [1230, -11, 14], [1400, 5, 7], [2000, 9, 10], [2700, 40, 45],
        [4200, 120, 90], [5600, 100, 110], [8500, 330, 260], [12000, 560, 420], [15000, 300, 200],
    ]
)  # fmt: skip
WOODED = np.array([[300, -2], [1300, -0.7], [2000, -0.5], [3000, 0.6], [6000, 0.7], [15000, 0.5]])
RANGES = np.geomspace(PROFILE[0, 0], PROFILE[-1, 0], 620).astype(np.float32)[:, None]


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


def land_at(view: View, texture: Texture, azimuth: Field) -> Land:
    """Return the land at these azimuths, (1, column)."""
    gap = np.float32(1 / view.focal_px)
    wider = np.concatenate([azimuth[:, :1] - gap, azimuth, azimuth[:, -1:] + gap], axis=1)
    x, y = RANGES * np.sin(wider), RANGES * np.cos(wider)
    bend = texture.fractal(3 * wider, np.full((1, 1), 0.5, np.float32), 3)
    bent = RANGES * (1 + 0.1 * bend)  # brow and shores are no circles
    level, rough = (
        np.interp(bent, PROFILE[:, 0], PROFILE[:, n]).astype(np.float32) for n in (1, 2)
    )
    hills = texture.fractal(x / 420, y / 420, 5, RANGES / (300 * 420))
    crests = 1 - 2 * np.abs(texture.fractal(x / 3000 + 9, y / 3000 + 5, 7, RANGES / (200 * 3000)))
    height = level + rough * (hills + step(RANGES, 2200, 7000) * (crests - hills))
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


def hits(land: Land, rows: Field) -> tuple[NDArray[np.int64], Field]:
    """Return the grid point behind what (row, column) sees, and the share of the way to it."""
    skyline = -np.minimum.accumulate(land.row, axis=0)
    columns = np.arange(skyline.shape[1])
    point = np.stack([np.searchsorted(skyline[:, c], -rows) for c in columns], axis=1)
    far = np.clip(point, 1, len(RANGES) - 1)
    near_row, far_row = land.row[far - 1, columns], land.row[far, columns]
    share = (near_row - rows[:, None]) / np.maximum(near_row - far_row, 1e-6)
    return np.maximum(point, 1), np.clip(share, 0, 1)
