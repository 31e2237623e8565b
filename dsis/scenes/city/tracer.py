"""The tracer: what light reaches the eye along a ray, without chance and therefore without grain.

Every pixel looks through the same points of its area, towards the same points of the sun's disc and
in the same directions of the sky. Caches on disk: as `dsis.scenes.city.patterns`.
"""

import math

import numpy as np
from numpy.typing import NDArray

from dsis.compiled import kernel
from dsis.scenes.city.cells import Cells
from dsis.scenes.city.facades import Wall, facade
from dsis.scenes.city.lighting import Light, ambient, mirrored, through_air
from dsis.scenes.city.patterns import bars, fade, pick, smooth
from dsis.scenes.city.plan import GRID_RAD, Plan
from dsis.scenes.city.rays import Hit, Solid, leaf_size, outward, trace
from dsis.scenes.city.roofs import flat_roof, pitched_roof
from dsis.scenes.city.solids import (
    BASE,
    COS,
    COVER,
    EAVES,
    HALF_X,
    HALF_Y,
    KIND,
    ROOF,
    SEED,
    SIN,
    SLOPE_X,
    SLOPE_Y,
    TOP,
    WALL,
    Cover,
    Kind,
    X,
    Y,
)  # fmt: skip
from dsis.scenes.city.spot import (
    AT,
    BARE,
    COLOUR,
    DISTANCE,
    GLASS,
    LIT,
    NORMAL,
    NUMBERS,
    POLISH,
    SPREAD,
    WIDE,
    WRAP,
    Vec,
)  # fmt: skip
from dsis.scenes.city.streets import block_at, ground, is_water, plan_place

FAR_M = 9000.0  # what lies beyond is painted with the sky
SHADOW_M = 400.0  # no shadow is longer
WATER_M = -4.0
BRIGHTEST = 8.0  # radiance of a glint
GLASS_F0, COATED_F0, METAL_F0, SHEEN_F0 = 0.045, 0.14, 0.6, 1.0  # mirrored head-on
_HOUSE, _MODERN, _GLASS, _ROOF, _DORMER, _BODY, _CABIN, _CROWN, _PANEL, _METAL = (
    int(k)
    for k in (
        Kind.HOUSE, Kind.MODERN, Kind.GLASS, Kind.ROOF, Kind.DORMER, Kind.BODY, Kind.CABIN,
        Kind.CROWN, Kind.PANEL, Cover.METAL,
    )
)  # fmt: skip
Spot = NDArray[np.float64]


@kernel
def _place(spot: Spot, p: Vec, d: Vec, t: float, pixel: float) -> None:
    """Enter the place t metres along a ray."""
    for c in range(3):
        spot[AT + c] = p[c] + t * d[c]
    spot[DISTANCE], spot[WIDE] = t, max(0.6 * t * pixel, 1e-4)


@kernel
def _face(spot: Spot, x: float, y: float, z: float) -> None:
    """Enter a normal, which need not be of unit length."""
    long = 1 / math.sqrt(x * x + y * y + z * z + 1e-12)
    spot[NORMAL], spot[NORMAL + 1], spot[NORMAL + 2] = x * long, y * long, z * long


@kernel
def _paint(spot: Spot, colour: Vec, level: float) -> None:
    """Enter a reflectance."""
    for c in range(3):
        spot[COLOUR + c] = colour[c] * level


@kernel
def _crown(s: Solid, spot: Spot, pixel: float) -> None:
    """Fill in leaves: each tuft has its own lightness and direction, and lets light through."""
    leaf = leaf_size(s, pixel)
    i, j = math.floor(spot[AT] / leaf), math.floor(spot[AT + 1] / leaf)
    k = math.floor(spot[AT + 2] / leaf)
    f, g, h = pick(i + (j << 20), k, 77), pick(i + (j << 20), k, 78), pick(i, j, k)
    _paint(spot, (s[WALL] * (0.9 + 0.3 * g), s[WALL + 1], s[WALL + 2]), 0.7 + 0.6 * f)
    x, y, z = spot[NORMAL], spot[NORMAL + 1], spot[NORMAL + 2]
    _face(spot, x + 1.3 * (f - 0.5), y + 1.3 * (g - 0.5), z + 0.9 * (h - 0.35))
    spot[WRAP] = 0.25


@kernel
def _lacquer(s: Solid, face: int, spot: Spot) -> None:
    """Fill in a car, or another thing of round sheet metal or glass."""
    glass = s[KIND] == _CABIN and face != 9
    c = ROOF if face == 9 else WALL
    _paint(spot, (s[c], s[c + 1], s[c + 2]), 1.0)
    spot[GLASS], spot[POLISH] = (1.0, 0.0) if glass else (0.0, 1.0)
    if s[COVER] == _METAL:
        spot[BARE] = METAL_F0
    gx, gy = spot[AT] - s[X], spot[AT + 1] - s[Y]
    x = (s[COS] * gx + s[SIN] * gy) / s[HALF_X]
    y = (s[COS] * gy - s[SIN] * gx) / s[HALF_Y]
    z = 2 * (spot[AT + 2] - s[BASE]) / (s[TOP] - s[BASE]) - 1
    x, y, z = x * abs(x), y * abs(y), z * abs(z)
    bend = 1.0 if s[KIND] == _BODY else 0.35
    _face(
        spot,
        (1 - bend) * spot[NORMAL] + bend * (s[COS] * x - s[SIN] * y),
        (1 - bend) * spot[NORMAL + 1] + bend * (s[SIN] * x + s[COS] * y),
        (1 - bend) * spot[NORMAL + 2] + bend * z,
    )
    small = min(s[HALF_X], s[HALF_Y], 0.5 * (s[TOP] - s[BASE]))
    spot[SPREAD] = max(0.006, 0.5 * (1.5 * spot[WIDE] / small) ** 2)  # the bend within a pixel


@kernel
def _lean(s: Solid, spot: Spot) -> None:
    """Let panes lean a little, each its own way; roof windows stand open; metal is rough."""
    kind = int(s[KIND])
    lean = 0.05
    if kind == _ROOF and spot[POLISH] == 0:
        lean = 0.7
    if kind == _GLASS:
        spot[BARE] = COATED_F0
    if spot[POLISH] > 0 and spot[GLASS] == 0:
        spot[SPREAD], spot[BARE], lean = 0.06, SHEEN_F0, 0.015
    lean *= fade(1.7, spot[WIDE])
    i, j = math.floor(spot[AT] / 1.7) + int(s[SEED]), math.floor(spot[AT + 1] / 1.7)
    k = math.floor(spot[AT + 2] / 1.9)
    east, up = lean * (pick(i, j, k) - 0.5), lean * (pick(i, j, k + 900) - 0.5)
    _face(spot, spot[NORMAL] + east, spot[NORMAL + 1], spot[NORMAL + 2] + up)


@kernel
def _roof(s: Solid, face: int, x: float, y: float, d: Vec, spot: Spot) -> None:
    """Fill in a roof at (x, y) metres from the middle of its solid."""
    facing = -(spot[NORMAL] * d[0] + spot[NORMAL + 1] * d[1] + spot[NORMAL + 2] * d[2])
    pixel = spot[WIDE] / max(facing, 0.05)
    if face == 9:
        flat_roof(s, x, y, pixel, spot)
        return
    u, slope = (y, s[SLOPE_X]) if face <= 6 else (x, s[SLOPE_Y])
    v = (spot[AT + 2] - s[EAVES]) * math.sqrt(1 + slope * slope) / slope
    pitched_roof(s, u, v, pixel, spot)


@kernel
def _plain_wall(s: Solid, face: int, u: float, whole: float, spot: Spot) -> None:
    """Fill in a wall without windows, or the front of a dormer, which is one."""
    v, wide = spot[AT + 2] - s[BASE], spot[WIDE]
    level = 1 + 0.11 * fade(1.5, wide) * smooth(0.7 * u, 0.7 * v, int(s[SEED]))
    pane = 0.0
    if s[KIND] == _DORMER and face == 3 and 0.35 < v < s[EAVES] - s[BASE] - 0.2:
        pane = bars(u / whole - 0.2, 0.6, wide / whole)
    for c in range(3):
        spot[COLOUR + c] = s[WALL + c] * level + pane * (0.02 - s[WALL + c] * level)
    spot[GLASS] = pane


@kernel
def _wall(s: Solid, face: int, x: float, y: float, d: Vec, sun: Spot, spot: Spot) -> None:
    """Fill in a wall at (x, y) metres from the middle of its solid."""
    kind, long = int(s[KIND]), face >= 3
    u, whole = (x + s[HALF_X], 2 * s[HALF_X]) if long else (y + s[HALF_Y], 2 * s[HALF_Y])
    if face == 0 or kind not in (_HOUSE, _MODERN, _GLASS):
        _plain_wall(s, face, u, whole, spot)
        return
    ax, ay = (s[COS], s[SIN]) if long else (-s[SIN], s[COS])  # along the wall
    inward = max(-(spot[NORMAL] * d[0] + spot[NORMAL + 1] * d[1]), 0.05)
    level = math.sqrt(max(d[0] * d[0] + d[1] * d[1], 1e-9))
    sunward = spot[NORMAL] * sun[0] + spot[NORMAL + 1] * sun[1]
    sun_u, sun_v = 0.0, 0.0
    if sunward > 0.02:
        sun_u, sun_v = (ax * sun[0] + ay * sun[1]) / sunward, sun[2] / sunward
    wall = Wall(
        u, spot[AT + 2] - s[BASE], whole, s[EAVES] - s[BASE],
        spot[WIDE] / max(inward / level, 0.08), spot[WIDE],
        (ax * d[0] + ay * d[1]) / inward, d[2] / inward, sun_u, sun_v, face,
    )  # fmt: skip
    facade(s, wall, spot)


@kernel
def _covering(s: Solid, face: int, d: Vec, light: Light, spot: Spot, pixel: float) -> None:
    """Fill in what a solid's face shows at a spot."""
    normal = outward(s, face, (spot[AT], spot[AT + 1], spot[AT + 2]))
    _face(spot, normal[0], normal[1], normal[2])
    gx, gy, kind = spot[AT] - s[X], spot[AT + 1] - s[Y], int(s[KIND])
    x, y = s[COS] * gx + s[SIN] * gy, s[COS] * gy - s[SIN] * gx
    if kind == _CROWN:
        _crown(s, spot, pixel)
    elif kind in (_BODY, _CABIN):
        _lacquer(s, face, spot)
    else:
        if kind == _PANEL and face >= 5:
            _paint(spot, (s[WALL], s[WALL + 1], s[WALL + 2]), 1.0)
            spot[GLASS] = 1.0
        elif face >= 5:
            _roof(s, face, x, y, d, spot)
        else:
            _wall(s, face, x, y, d, light.sun_points[0], spot)
        if spot[GLASS] + spot[POLISH] > 0:
            _lean(s, spot)


@kernel
def _water(spot: Spot, p: Vec, d: Vec, t: float, pixel: float, seed: int) -> None:
    """Fill in the river: ripples of four sizes, the finer ones only where they show."""
    _place(spot, p, d, t, pixel)
    x, y, deep = spot[AT], spot[AT + 1], spot[WIDE] / max(-d[2], 1e-3)
    east, north, size, steep = 0.0, 0.0, 5.0, 0.013
    for octave in range(4):
        keep = steep * fade(size, deep)
        east += keep * smooth(x / size, y / size, seed + 40 + octave)
        north += keep * smooth(y / size + 31.7, x / size, seed + 50 + octave)
        size *= 0.42
        steep *= 1.4
    _face(spot, east, north, 1.0)
    _paint(spot, (0.02, 0.03, 0.025), 1.0)
    spot[GLASS], spot[SPREAD] = 1.0, 0.004


@kernel
def _quay(plan: Plan, spot: Spot, p: Vec, d: Vec, above: float, below: float, pixel: float) -> None:
    """Fill in the wall of the quay, met between the heights of the street and of the water."""
    a, _ = plan_place(plan, above * d[0], above * d[1])
    b, _ = plan_place(plan, below * d[0], below * d[1])
    i = block_at(plan.a_low, a)
    edge, side = (plan.a_high[i], -1.0) if b > a else (plan.a_low[i], 1.0)
    _place(spot, p, d, above + (below - above) * (edge - a) / (b - a), pixel)
    _face(spot, side * math.cos(GRID_RAD), side * math.sin(GRID_RAD), 0.0)
    z, wide = spot[AT + 2], spot[WIDE]
    level = 1 - 0.35 * bars(z / 0.55, 0.12, wide / 0.55) * fade(0.5, wide)
    level *= 1 + 0.25 * smooth((spot[AT] + spot[AT + 1]) / 3, z / 0.8, plan.seed) * fade(1.5, wide)
    _paint(spot, (0.30, 0.27, 0.22), level if z > WATER_M + 0.7 else 0.4 * level)


@kernel
def _below_streets(
    table: Solid, cells: Cells, plan: Plan, spot: Spot, p: Vec, d: Vec, most: float, pixel: float
) -> Hit:
    """Follow a ray into the river's bed: piers and boats, else fill in water or the quay."""
    low = (WATER_M - p[2]) / d[2]
    top = (most * d[0], most * d[1], 0.0)
    t, k, face = trace(table, cells, top, d, low - most, pixel, False)
    if k < 0:
        if is_water(plan, low * d[0], low * d[1]):
            _water(spot, p, d, low, pixel, plan.seed)
        else:
            _quay(plan, spot, p, d, most, low, pixel)
    return most + t, k, face


@kernel
def _met(
    table: Solid, cells: Cells, plan: Plan, light: Light, spot: Spot, p: Vec, d: Vec, pixel: float
) -> bool:
    """Fill in the spot that a ray from the eye meets; False: it goes on to the sky."""
    most = -p[2] / d[2] if d[2] < -1e-9 else 1e9
    hit = trace(table, cells, p, d, min(most, FAR_M), pixel, False)
    if hit[1] < 0 and most > FAR_M:
        return False
    spot[:] = 0.0
    spot[LIT], spot[SPREAD], spot[BARE] = 1.0, 0.0012, GLASS_F0
    if hit[1] < 0:
        if is_water(plan, most * d[0], most * d[1]):
            hit = _below_streets(table, cells, plan, spot, p, d, most, pixel)
        else:
            _place(spot, p, d, most, pixel)
            _face(spot, 0.0, 0.0, 1.0)
            deep = spot[WIDE] / max(-d[2], 1e-3)
            _paint(spot, ground(plan, spot[AT], spot[AT + 1], spot[WIDE], deep), 1.0)
    if hit[1] >= 0:
        _place(spot, p, d, hit[0], pixel)
        _covering(table[hit[1]], hit[2], d, light, spot, pixel)
    for c in range(3):
        spot[AT + c] += 1e-3 * spot[NORMAL + c]  # off the surface, so as not to meet it again
    return True


@kernel
def _shine(
    table: Solid, cells: Cells, light: Light, spot: Spot, d: Vec, sample: int, pixel: float
) -> Vec:
    """Return the light from a spot towards the eye: diffuse under sun and sky, and mirrored."""
    x, y, z = spot[NORMAL], spot[NORMAL + 1], spot[NORMAL + 2]
    sun, wrap = light.sun_points[sample], spot[WRAP]
    facing = spot[LIT] * (x * sun[0] + y * sun[1] + z * sun[2] + wrap) / (1 + wrap)
    if facing > 0:
        p, to_sun = (spot[AT], spot[AT + 1], spot[AT + 2]), (sun[0], sun[1], sun[2])
        _, blocker, _ = trace(table, cells, p, to_sun, SHADOW_M, pixel, True)
        facing = facing if blocker < 0 else 0.0
    facing = max(facing, 0.0)
    sky = ambient(table, cells, light, spot, sample, pixel)
    share, mirror = spot[GLASS] + spot[POLISH], (0.0, 0.0, 0.0)
    if share > 0.01:
        cosine = min(max(-(x * d[0] + y * d[1] + z * d[2]), 0.0), 1.0)
        share *= spot[BARE] + (1 - spot[BARE]) * (1 - cosine) ** 5  # Schlick's Fresnel term
        up = d[2] + 2 * cosine * z
        away = (d[0] + 2 * cosine * x, d[1] + 2 * cosine * y, abs(up) if z > 0.99 else up)
        mirror = mirrored(table, cells, light, spot, away, pixel)
    rgb = light.sun_rgb
    return (
        spot[COLOUR] * (facing * rgb[0] + sky[0]) + share * mirror[0],
        spot[COLOUR + 1] * (facing * rgb[1] + sky[1]) + share * mirror[1],
        spot[COLOUR + 2] * (facing * rgb[2] + sky[2]) + share * mirror[2],
    )


@kernel
def trace_columns(
    image: NDArray[np.float32], table: Solid, cells: Cells, plan: Plan, light: Light,
    points: NDArray[np.float64], eye_m: float, left_rad: float, horizon_row: float, pixel: float,
) -> None:  # fmt: skip
    """Draw the city over a picture of the sky.

    Parameters
    ----------
    image
        Float32 (row, column, 3), linear light.
    table, cells, plan, light
        The scene.
    points
        Places within a pixel, row and column in 0..1: float64 (sample, 2).
    eye_m
        Height of the eye.
    left_rad, horizon_row, pixel
        Azimuth of the left edge, row of the horizon, and angle of one pixel.
    """
    samples = points.shape[0]
    spot, total = np.empty(NUMBERS), np.empty(3)
    eye = (0.0, 0.0, eye_m)
    for column in range(image.shape[1]):
        for row in range(image.shape[0]):
            found = 0
            total[:] = 0.0
            for n in range(samples):
                azimuth = left_rad + (column + points[n, 1]) * pixel
                slope = (horizon_row - row - points[n, 0]) * pixel
                level = 1 / math.sqrt(1 + slope * slope)
                d = (math.sin(azimuth) * level, math.cos(azimuth) * level, slope * level)
                if _met(table, cells, plan, light, spot, eye, d, pixel):
                    shine = _shine(table, cells, light, spot, d, n, pixel)
                    seen = through_air(shine, spot[DISTANCE], light)
                    found += 1
                    for c in range(3):
                        total[c] += seen[c]
            for c in range(3):
                behind = (1 - found / samples) * image[row, column, c]
                image[row, column, c] = min(total[c] / samples, BRIGHTEST) + behind
