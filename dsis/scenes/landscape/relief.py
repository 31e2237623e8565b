"""The relief: heights on a polar grid around the eye, fine where it is near, and what grows there.

The land is a hillside meadow, a valley with lakes and fields, wooded hills and mountains, all
around the eye, which is at the height 0.
"""

import math
from dataclasses import dataclass
from typing import Final, Self

import numpy as np
from numpy.typing import NDArray

from dsis.compiled import kernel
from dsis.scenes.landscape.texture import Field, Texture, ramp

AZIMUTHS, RANGES = 2048, 560
NEAREST_M, FARTHEST_M = 2.5, 24000.0
RANGE_M: Final = np.geomspace(NEAREST_M, FARTHEST_M, RANGES)
LOG_STEP: Final = math.log(FARTHEST_M / NEAREST_M) / (RANGES - 1)
LAKE_M = -66.0
SUN_AZIMUTH_RAD = math.radians(44.0)  # a lake lies there: its glitter is seen
PROFILE = np.array(  # range, height, amplitude of the relief, bias of the woods
    [
        [2.5, -2.0, 0.03, -3], [10, -2.6, 0.1, -3], [30, -5.2, 0.4, -3], [60, -10.4, 1.0, -3],
        [100, -18, 2, -2], [160, -33, 4, -1.2], [260, -50, 5, -0.7], [400, -59, 6, -0.6],
        [650, -66, 11, -0.55], [1100, -67, 12, -0.5], [1600, -60, 10, -0.4], [2300, -42, 28, 0.0],
        [3200, 5, 60, 0.25], [4500, 75, 110, 0.35], [6000, 60, 140, 0.35], [9000, 230, 290, 0.2],
        [13000, 430, 430, -0.1], [17000, 300, 260, -0.2], [24000, 60, 100, -0.2],
    ]
)  # fmt: skip


@dataclass(frozen=True)
class Relief:
    """The land on the polar grid: arrays (azimuth, range), float64.

    Attributes
    ----------
    height
        Of the ground in m, below the lake too.
    lean_x, lean_y
        Its rise in m per m along the world's axes.
    wood
        Above 0 trees stand.
    """

    height: NDArray[np.float64]
    lean_x: NDArray[np.float64]
    lean_y: NDArray[np.float64]
    wood: NDArray[np.float64]

    @classmethod
    def of(cls, seed: int) -> Self:
        """Make the land of a seed."""
        texture = Texture.of(seed)
        turn = np.arange(AZIMUTHS) * (2 * np.pi / AZIMUTHS)
        x, y = np.sin(turn)[:, None] * RANGE_M, np.cos(turn)[:, None] * RANGE_M
        height, wood = _land(texture, x, y)
        east, north = np.sin(turn)[:, None], np.cos(turn)[:, None]
        ahead = np.gradient(height, axis=1) / (RANGE_M * LOG_STEP)
        ring = np.concatenate([height[-1:], height, height[:1]])
        aside = (ring[2:] - ring[:-2]) / (4 * np.pi / AZIMUTHS * RANGE_M)
        lean_x, lean_y = east * ahead + north * aside, north * ahead - east * aside
        return cls(height, lean_x, lean_y, wood)

    def at(
        self, field: NDArray[np.float64], x: NDArray[np.float64], y: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return a field at points of the world, by bilinear interpolation."""
        far = np.log(np.maximum(np.hypot(x, y), NEAREST_M) / NEAREST_M) / LOG_STEP
        turn = np.arctan2(x, y) % (2 * np.pi) * (AZIMUTHS / (2 * np.pi))
        i, j = np.floor(turn).astype(int), np.minimum(np.floor(far).astype(int), RANGES - 2)
        s, t = turn - i, far - j
        a, b = i % AZIMUTHS, (i + 1) % AZIMUTHS
        near = field[a, j] + s * (field[b, j] - field[a, j])
        beyond = field[a, j + 1] + s * (field[b, j + 1] - field[a, j + 1])
        found: NDArray[np.float64] = near + t * (beyond - near)
        return found


def _land(texture: Texture, x: Field, y: Field) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return height and wood at points of the world."""
    away = np.hypot(x, y)
    bend = texture.fractal(x / 2600 + 3, y / 2600 + 1, 3)
    bent = away * (1 + 0.16 * bend * ramp(away, 20, 300))
    level, rough, bias = (np.interp(bent, PROFILE[:, 0], PROFILE[:, n]) for n in (1, 2, 3))
    spacing = away * LOG_STEP
    close, wide, far = away[0] < 330, away[0] > 90, away[0] > 2200
    near, hills = np.zeros_like(away), np.zeros_like(away)
    u, v, gap = x[:, close], y[:, close], spacing[:, close]
    near[:, close] = texture.fractal(u / 24 + 5, v / 24, 3, gap / 60)
    u, v, gap = x[:, wide], y[:, wide], spacing[:, wide]
    hills[:, wide] = texture.fractal(u / 620 + 8, v / 620, 5, gap / 1200)
    u, v, gap = x[:, far], y[:, far], spacing[:, far]
    crests = 1 - 2.2 * np.abs(texture.fractal(u / 3300 + 9, v / 3300 + 5, 7, gap / 6000))
    hills[:, far] += ramp(away[:, far], 2200, 7500) * (crests - hills[:, far])
    height = level + rough * (near + ramp(away, 90, 330) * (hills - near))
    sunward = np.cos(np.arctan2(x, y) - SUN_AZIMUTH_RAD)
    height -= 12 * ramp(sunward, 0.93, 0.99) * ramp(away, 380, 600) * ramp(away, 1700, 1200)
    wood = texture.fractal(x / 520 + 40, y / 520, 4) + bias
    wood = np.where(height > LAKE_M + 1.5, wood, -1.0)
    return height.astype(np.float64), wood.astype(np.float64)


@kernel
def look_up(field: NDArray[np.float64], turn: float, away: float) -> float:
    """Return a field of the polar grid at a fractional azimuth number and a range."""
    far = math.log(max(away, NEAREST_M) / NEAREST_M) / LOG_STEP
    i, j = math.floor(turn), min(int(far), field.shape[1] - 2)
    s, t = turn - i, far - j
    a, b = i % field.shape[0], (i + 1) % field.shape[0]
    near = field[a, j] + s * (field[b, j] - field[a, j])
    return float(near + t * (field[a, j + 1] + s * (field[b, j + 1] - field[a, j + 1]) - near))
