"""Roofs: rows of tiles, sheets of metal, gravel; roof windows. Caches: as `patterns`."""

import math

import numpy as np
from numpy.typing import NDArray

from dsis.compiled import kernel
from dsis.scenes.city.patterns import bars, fade, pick, smooth
from dsis.scenes.city.rays import Solid
from dsis.scenes.city.solids import COVER, KIND, ROOF, SEED, SLOPE_Y, Cover, Kind
from dsis.scenes.city.spot import COLOUR, GLASS, POLISH

_TILES, _METAL, _ROOF = int(Cover.TILES), int(Cover.METAL), int(Kind.ROOF)


@kernel
def _tiles(u: float, v: float, tall: float, wide: float, strength: float, pixel: float, seed: int
           ) -> float:  # fmt: skip
    """Return the change of lightness by rows of tiles `tall` and `wide` metres large."""
    line = bars(v / tall, 0.22, pixel / tall) - 0.22
    wave = bars(u / wide, 0.35, pixel / wide) - 0.35
    each = pick(math.floor(u / wide), math.floor(v / tall), seed) - 0.5
    return 0.32 * fade(0.3, pixel) * each - strength * (line + 0.5 * wave)


@kernel
def flat_roof(s: Solid, u: float, v: float, pixel: float, spot: NDArray[np.float64]) -> None:
    """Fill in gravel or felt with seams and stains at (u, v) metres; a pixel is `pixel` metres."""
    seed, big = int(s[SEED]), fade(4.0, pixel)
    level = 1 + 0.13 * big * smooth(0.27 * u, 0.3 * v, seed + 1)
    level += 0.10 * fade(0.9, pixel) * smooth(1.3 * u, 1.1 * v, seed + 2)
    level *= 1 - 0.25 * bars(u / 1.1, 0.05, pixel / 1.1)
    level *= 1 - 0.45 * big * max(smooth(0.16 * u + 9, 0.2 * v, seed + 3), 0.0)
    for c in range(3):
        spot[COLOUR + c] = s[ROOF + c] * level


@kernel
def pitched_roof(s: Solid, u: float, v: float, pixel: float, spot: NDArray[np.float64]) -> None:
    """Fill in tiles, slates or metal, moss and roof windows; v runs up the slope."""
    seed, cover, big = int(s[SEED]), int(s[COVER]), fade(4.0, pixel)
    level = 0.13 * big * smooth(0.27 * u, 0.3 * v, seed + 1)
    level += 0.10 * fade(0.9, pixel) * smooth(1.3 * u, 1.1 * v, seed + 2)
    moss = 0.0
    if cover == _METAL:
        level = 0.5 * level - 0.35 * bars(u / 0.6, 0.12, pixel / 0.6)
        spot[POLISH] = 0.12
    else:
        moss = big * max(smooth(0.4 * u, 0.15 * v, seed + 7) - 0.25, 0.0)
        if cover == _TILES:
            level += _tiles(u, v, 0.33, 0.26, 0.6, pixel, seed + 5)
        else:
            level += _tiles(u, v, 0.24, 0.3, 0.25, pixel, seed + 5)
    i, j = math.floor(u / 2.9), math.floor(v / 2.6)
    if s[KIND] == _ROOF and s[SLOPE_Y] < 3 and pick(i, j, seed + 9) < 0.16:
        pane = bars(u / 2.9 - 0.3, 0.32, pixel / 2.9) * bars(v / 2.6 - 0.25, 0.46, pixel / 2.6)
        spot[GLASS] = pane * fade(1.0, pixel)
        spot[POLISH] *= 1 - spot[GLASS]
    level = max(1 + level, 0.1) * (1 - spot[GLASS])
    spot[COLOUR] = s[ROOF] * level * (1 - 0.5 * moss)
    spot[COLOUR + 1] = s[ROOF + 1] * level * (1 - 0.2 * moss)
    spot[COLOUR + 2] = s[ROOF + 2] * level
