"""The ground: streets, pavements, courts, parks and the country around. Caches: as `patterns`."""

import math

import numpy as np
from numpy.typing import NDArray

from dsis.compiled import kernel
from dsis.scenes.city.patterns import bars, fade, pick, smooth
from dsis.scenes.city.plan import GRID_RAD, REACH_M, Ground, Plan
from dsis.scenes.city.spot import Vec

_RIVER, _SQUARE = int(Ground.RIVER), int(Ground.SQUARE)
_GREEN = (int(Ground.PARK), int(Ground.CHURCH))
PAVEMENT_M, ASPHALT, STONE = 2.6, 0.105, 0.29


@kernel
def plan_place(plan: Plan, x: float, y: float) -> tuple[float, float]:
    """Return the plan coordinates of a place: the inverse of `Plan.world`."""
    cos, sin = math.cos(GRID_RAD), math.sin(GRID_RAD)
    u, v = cos * x + sin * y, cos * y - sin * x
    a = u + 40 * math.sin(v / 430 + plan.bends[0]) + 9 * math.sin(v / 150 + plan.bends[1])
    return a, v + 30 * math.sin(u / 390 + plan.bends[2])


@kernel
def block_at(kerbs: NDArray[np.float64], place: float) -> int:
    """Return the last block whose low kerb is not beyond a place; 0 where there is none."""
    low, high = 0, kerbs.size
    while high - low > 1:
        middle = (low + high) // 2
        if kerbs[middle] <= place:
            low = middle
        else:
            high = middle
    return low


@kernel
def is_water(plan: Plan, x: float, y: float) -> bool:
    """Return whether a place lies between the banks of the river."""
    a, _ = plan_place(plan, x, y)
    i = block_at(plan.a_low, a)
    inside = x * x + y * y < REACH_M * REACH_M and a < plan.a_high[i]
    return bool(inside and plan.grounds[i, 0] == _RIVER)


@kernel
def _country(seed: int, x: float, y: float, level: float, pixel: float) -> Vec:
    """Return the reflectance of fields, meadows and woods around the city."""
    p, q = x + 0.4 * y, y - 0.3 * x
    p, q = p + 60 * smooth(p / 300, q / 300, seed), q + 60 * smooth(q / 280, p / 280, seed + 1)
    h = pick(math.floor(p / 230), math.floor(q / 310), seed + 2)
    level += 0.25 * fade(60.0, pixel) * smooth(x / 50, y / 70, seed + 4)
    if fade(300.0, pixel) * smooth(x / 420, y / 700, seed + 3) > 0.28:
        return 0.030 * level, 0.048 * level, 0.018 * level
    if h < 0.5:
        return (0.085 + 0.04 * h) * level, 0.115 * level, 0.045 * level
    return 0.20 * h * level, 0.165 * h * level, 0.10 * h * level


@kernel
def _lot(plan: Plan, i: int, j: int, a: float, b: float, level: float, pixel: float) -> Vec:
    """Return the reflectance of the ground within a block's kerbs."""
    ground = int(plan.grounds[i, j])
    from_a, from_b = a - plan.a_low[i], b - plan.b_low[j]
    wide, long = plan.a_high[i] - plan.a_low[i], plan.b_high[j] - plan.b_low[j]
    edge = min(from_a, wide - from_a, from_b, long - from_b)
    if edge < PAVEMENT_M or ground == _SQUARE:
        gaps = max(bars(a / 0.8, 0.07, pixel / 0.8), bars(b / 0.8, 0.07, pixel / 0.8))
        level *= (1 - 0.2 * fade(0.4, pixel) * gaps) * (1.25 if edge < 0.3 else 1.0)
        if edge > 9 and pixel < 3:
            level *= 1.05 if (math.floor(a / 7) + math.floor(b / 7)) % 2 == 0 else 0.8
        return STONE * level, 0.95 * STONE * level, 0.86 * STONE * level
    s, t = from_a / wide, from_b / long
    if ground in _GREEN:
        if abs(s - t) < 0.025 or abs(s + t - 1) < 0.018 or edge < 5:
            return 0.36 * level, 0.31 * level, 0.23 * level
        return 0.085 * level, 0.125 * level, 0.035 * level
    if pick(i, j, plan.seed + 8) < 0.5:
        return 0.10 * level, 0.095 * level, 0.085 * level
    return 0.075 * level, 0.09 * level, 0.04 * level


@kernel
def _street(along: float, across: float, wide: float, near_end: float, pixel: float, seed: int
            ) -> float:  # fmt: skip
    """Return the reflectance of asphalt with a broken line, and stripes to cross at its ends."""
    paint = 0.0
    if abs(across - 0.5 * wide) < 0.09 + 0.3 * pixel:
        paint = fade(0.35, pixel) * bars(along / 7.0, 0.45, pixel / 7.0)
    if 1.0 < near_end < 4.2 and 0.6 < across < wide - 0.6:
        paint = bars(across / 1.0, 0.5, pixel)
    worn = 1 - 0.14 * fade(1.0, pixel) * smooth(across / 0.9, along / 15, seed + 6)
    return ASPHALT * worn + 0.6 * paint * (0.55 - ASPHALT)


@kernel
def ground(plan: Plan, x: float, y: float, wide: float, deep: float) -> Vec:
    """Return the reflectance of the ground where a pixel covers wide x deep metres of it."""
    a, b = plan_place(plan, x, y)
    i, j = block_at(plan.a_low, a), block_at(plan.b_low, b)
    pixel, seed = max(wide, 0.5 * deep), plan.seed
    level = 1 + 0.12 * fade(5.0, pixel) * smooth(a / 6, b / 6, seed)
    level += 0.10 * fade(1.0, pixel) * smooth(a / 1.1, b / 1.1, seed)
    if x * x + y * y > REACH_M * REACH_M:
        return _country(seed, x, y, level, pixel)
    over_a, over_b = a - plan.a_high[i], b - plan.b_high[j]
    if over_a < 0 and over_b < 0:
        return _lot(plan, i, j, a, b, level, pixel)
    soft = max(wide, 0.3 * deep)
    grey = ASPHALT  # of a crossing
    if over_b < 0 and i + 1 < plan.a_low.size:
        end = min(b - plan.b_low[j], -over_b)
        grey = _street(b, over_a, plan.a_low[i + 1] - plan.a_high[i], end, soft, seed)
    elif over_a < 0 and j + 1 < plan.b_low.size:
        end = min(a - plan.a_low[i], -over_a)
        grey = _street(a, over_b, plan.b_low[j + 1] - plan.b_high[j], end, soft, seed)
    grey *= level
    return grey, grey, 1.04 * grey
