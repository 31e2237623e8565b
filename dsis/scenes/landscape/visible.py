"""What each point of the picture sees: land, trees, houses, grass; no light yet.

Columns of a cylinder have one azimuth each, so a column is traced as a whole: its rows meet the
land in order, and every thing is met only in the rows that it covers. Arrays are (column, row);
`depth` is the horizontal range in m, by which a ray is (depth sin, depth cos, depth slope).
"""

import math

import numpy as np
from numpy.typing import NDArray

from dsis.compiled import kernel
from dsis.scenes.landscape import crown, grass, house
from dsis.scenes.landscape.planting import (
    HEIGHT,
    HOUSE,
    KIND,
    RADIUS,
    RANGE,
    VARIANT,
    X,
    Y,
    Z,
)  # fmt: skip
from dsis.scenes.landscape.relief import LAKE_M, LOG_STEP, NEAREST_M

SKY, GROUND, WATER, FIRST_THING = -1, 0, 1, 2  # what is seen; blade n is -2 - n
STEM = 3.0  # `part` of a trunk; leaves have -1..1, how deep they lie in the crown
Numbers = NDArray[np.float64]
Seen = tuple[Numbers, NDArray[np.int64], Numbers, Numbers]  # depth, what, normal, part


@kernel
def _meet_land(
    slope: float, before: float, away: float, nearer: float, ground: float
) -> tuple[float, bool]:
    """Return where a ray meets a stretch of land or the lake over it, and whether the lake."""
    rise = (ground - nearer) / (away - before)
    hit = before
    if slope != rise:
        hit = min(max((nearer - rise * before) / (slope - rise), before), away)
    lake = LAKE_M / slope if slope < 0 else 1e9
    if lake < hit or nearer + rise * (hit - before) < LAKE_M:
        return min(max(lake, before), away), True
    return hit, False


@kernel
def land(
    seen: Seen,
    azimuths: Numbers,
    slopes: Numbers,
    height: Numbers,
    lean_x: Numbers,
    lean_y: Numbers,
) -> None:
    """Fill every row with the sky, the ground or the water that it sees; slopes descend."""
    depth, what, normal, part = seen
    ranges = height.shape[1]
    for column in range(azimuths.size):
        turn = azimuths[column] / (2 * math.pi) * height.shape[0]
        a = math.floor(turn)
        s = turn - a
        a, b = a % height.shape[0], (a + 1) % height.shape[0]
        far = 1
        for row in range(slopes.size - 1, -1, -1):
            slope = slopes[row]
            while far < ranges:
                away = NEAREST_M * math.exp(far * LOG_STEP)
                ground = height[a, far] + s * (height[b, far] - height[a, far])
                if max(ground, LAKE_M) >= slope * away:
                    break
                far += 1
            if far == ranges:
                depth[column, row], what[column, row] = 1e9, SKY
                continue
            before = NEAREST_M * math.exp((far - 1) * LOG_STEP)
            away = NEAREST_M * math.exp(far * LOG_STEP)
            nearer = height[a, far - 1] + s * (height[b, far - 1] - height[a, far - 1])
            ground = height[a, far] + s * (height[b, far] - height[a, far])
            hit, wet = _meet_land(slope, before, away, nearer, ground)
            what[column, row] = WATER if wet else GROUND
            t = (hit - before) / (away - before)
            depth[column, row] = hit
            part[column, row] = nearer + t * (ground - nearer)
            for axis in range(2):
                lean = lean_x if axis == 0 else lean_y
                low = lean[a, far - 1] + s * (lean[b, far - 1] - lean[a, far - 1])
                high = lean[a, far] + s * (lean[b, far] - lean[a, far])
                normal[column, row, axis] = -(low + t * (high - low))
            normal[column, row, 2] = 1.0


@kernel
def _meet(
    found: Numbers, ray: tuple[float, float, float], thing: Numbers, shapes: Numbers, pixel: float
) -> None:
    """Write range, normal and part of a thing where a ray from the eye meets it; 1e9: it misses."""
    if thing[KIND] == HOUSE:
        if house.cross(found, (0.0, 0.0, 0.0), ray, thing) < 0.0:
            found[0] = 1e9
        return
    crown.meet(found, ray[0], ray[1], ray[2], thing, shapes[int(thing[VARIANT])], pixel)
    ahead = thing[X] * ray[0] + thing[Y] * ray[1]
    aside = thing[X] * ray[1] - thing[Y] * ray[0]
    rise = ray[2] * ahead - thing[Z]
    girth = 0.028 * thing[HEIGHT] * (1.25 - rise / thing[HEIGHT])
    if abs(aside) < girth and 0.0 < rise < 0.75 * thing[HEIGHT]:
        bark = ahead - math.sqrt(girth * girth - aside * aside)
        if bark < found[0]:
            found[0], found[4] = bark, STEM
            found[1], found[2] = bark * ray[0] - thing[X], bark * ray[1] - thing[Y]
            found[3] = 0.0


@kernel
def stand(
    seen: Seen,
    azimuths: Numbers,
    slopes: Numbers,
    pixel_rad: float,
    things: Numbers,
    numbers: NDArray[np.int64],
    shapes: Numbers,
) -> None:
    """Put the things of these numbers, nearest first, before what lies behind them."""
    depth, what, normal, part = seen
    found = np.empty(5)
    for n in numbers:
        thing = things[n]
        reach = thing[RADIUS] * (1.0 if thing[KIND] == HOUSE else 1.3)
        turn = (math.atan2(thing[X], thing[Y]) - azimuths[0] + math.pi) % (2 * math.pi) - math.pi
        wide = math.asin(min(reach / thing[RANGE], 1.0))
        first = max(math.ceil((turn - wide) / pixel_rad), 0)
        last = min(math.floor((turn + wide) / pixel_rad) + 1, azimuths.size)
        top = thing[Z] + thing[HEIGHT] * (1.0 if thing[KIND] == HOUSE else 1.12)
        near = max(thing[RANGE] - reach, 1.0)
        highest = top / (near if top > 0 else thing[RANGE] + reach)
        lowest = thing[Z] / (near if thing[Z] < 0 else thing[RANGE] + reach)
        upper = max(math.ceil((slopes[0] - highest) / pixel_rad), 0)
        lower = min(math.floor((slopes[0] - lowest) / pixel_rad) + 1, slopes.size)
        pixel = pixel_rad * thing[RANGE]
        for column in range(first, last):
            ax, ay = math.sin(azimuths[column]), math.cos(azimuths[column])
            for row in range(upper, lower):
                if depth[column, row] < near:
                    continue
                _meet(found, (ax, ay, slopes[row]), thing, shapes, pixel)
                if found[0] < depth[column, row]:
                    depth[column, row], what[column, row] = found[0], FIRST_THING + n
                    part[column, row] = found[4]
                    normal[column, row, 0] = found[1]
                    normal[column, row, 1] = found[2]
                    normal[column, row, 2] = found[3]


@kernel
def grow(
    seen: Seen,
    azimuths: Numbers,
    slopes: Numbers,
    pixel_rad: float,
    blades: Numbers,
    first: int,
    last: int,
) -> None:
    """Put the blades first..last-1 before what lies behind them; `part` is the height on them."""
    depth, what, normal, part = seen
    for n in range(first, last):
        blade = blades[n]
        away, tall, head = blade[grass.RANGE], blade[grass.TALL], int(blade[grass.HEAD])
        coarse = max(away / 11.0, 1.0)
        crest = 0.0 if head == grass.STEM else (0.045 if head == grass.EAR else 0.006 * coarse)
        highest = (blade[grass.FOOT] + tall + crest) / away
        upper = max(math.ceil((slopes[0] - highest) / pixel_rad), 0)
        lower = min(math.floor((slopes[0] - blade[grass.FOOT] / away) / pixel_rad) + 1, slopes.size)
        facing = 2 * math.pi * blade[grass.FACING]
        offset = (blade[grass.AZIMUTH] - azimuths[0] + math.pi) % (2 * math.pi) - math.pi
        for row in range(upper, lower):
            up = (slopes[row] * away - blade[grass.FOOT]) / tall
            middle = offset + blade[grass.LEAN] * up * up
            half = 0.5 * blade[grass.WIDE] * math.sqrt(max(1.0 - up, 0.0))
            on_head = head != grass.STEM and abs(up - 1.0) * tall < crest
            if on_head:
                over = (up - 1.0) * tall / crest
                thick = 0.0032 * coarse if head == grass.EAR else 1.6 * crest
                half = max(half, thick * math.sqrt(1.0 - over * over))
            half /= away
            left = max(math.ceil((middle - half) / pixel_rad), 0)
            right = min(math.floor((middle + half) / pixel_rad) + 1, azimuths.size)
            for column in range(left, right):
                if away < depth[column, row]:
                    depth[column, row], what[column, row] = away, -2 - n
                    part[column, row] = 2.0 if on_head else up
                    normal[column, row, 0] = 0.85 * math.cos(facing)
                    normal[column, row, 1] = 0.85 * math.sin(facing)
                    normal[column, row, 2] = 0.5
