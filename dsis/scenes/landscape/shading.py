"""What light comes from each point that is seen: its surface under sun and sky, and haze.

The same directions of the sky serve every pixel, so there is no grain; textures are functions of
the place in the world that fade out where they are finer than a pixel.
"""

import math

import numpy as np
from numpy.typing import NDArray

from dsis.compiled import kernel
from dsis.scenes.landscape.ground import fractal, ground, step
from dsis.scenes.landscape.light import Around, passing
from dsis.scenes.landscape.planting import HOUSE, KIND, LAST_TREE_M, X, Y, Z
from dsis.scenes.landscape.relief import look_up
from dsis.scenes.landscape.surfaces import (
    NORMAL,
    NUMBERS,
    OPEN_SKY,
    OPEN_SUN,
    THROUGH,
    WRAP,
    foliage,
    masonry,
    stalk,
)  # fmt: skip
from dsis.scenes.landscape.visible import FIRST_THING, GROUND, SKY, WATER, Seen

Numbers = NDArray[np.float64]
Lights = tuple[Numbers, Numbers, Numbers, Numbers]
"""Direction of the sun, radiance of a white surface that faces it, directions of the sky, their
shares in the radiance of a white surface under the sky."""
HAZE_PER_M = (1.9e-5, 2.5e-5, 3.6e-5)
SUN_REACH_M, SKY_REACH_M = 110.0, 26.0
BOUNCE = (0.055, 0.06, 0.03)  # light from the ground around, where it is not in the shade
GRASS_M = 95.0  # up to here blades stand on the meadow


@kernel
def cloud_shade(x: float, y: float) -> float:
    """Return the share of sunlight that the clouds let pass."""
    thin = step(fractal(x / 1300 + 4, y / 1300, 0, 3), 0.48, 0.08)
    return 1.0 - 0.82 * (1.0 - thin) * step(math.hypot(x, y), 300, 900)


@kernel
def _soil(
    out: Numbers, point: tuple[float, float, float], away: float, pixel: float, trees: float
) -> None:
    """Write the surface of the ground; its normal, of unit length, is there already."""
    x, y, z = point
    facing = -(out[NORMAL] * x + out[NORMAL + 1] * y + out[NORMAL + 2] * z) / away
    deep = pixel / max(facing, 0.04)
    ground(out, x, y, z, 1.0 - out[NORMAL + 2], away, pixel, deep, trees)
    if away < GRASS_M:
        shelter = 0.55 + 0.45 * step(away, 25, 90)
    elif away < LAST_TREE_M - 100.0:
        shelter = 1.0 - 0.8 * step(trees, 0.0, 0.05)
    else:
        shelter = 1.0
        out[NORMAL] += 1.1 * fractal(x / 420, y / 420, deep / 420, 5)
        out[NORMAL + 1] += 1.1 * fractal(x / 420 + 40, y / 420, deep / 420, 5)
    out[OPEN_SUN], out[OPEN_SKY] = shelter, shelter


@kernel
def _normalise(out: Numbers) -> None:
    x, y, z = out[NORMAL], out[NORMAL + 1], out[NORMAL + 2]
    long = 1.0 / math.sqrt(x * x + y * y + z * z + 1e-12)
    out[NORMAL], out[NORMAL + 1], out[NORMAL + 2] = x * long, y * long, z * long


@kernel
def _illuminate(
    colour: Numbers,
    out: Numbers,
    point: tuple[float, float, float],
    lights: Lights,
    around: Around,
    bounce: float,
    found: Numbers,
) -> None:
    """Write the radiance of a surface at a point."""
    sun, white, sky_rays, sky_light = lights
    nx, ny, nz, wrap = out[NORMAL], out[NORMAL + 1], out[NORMAL + 2], out[WRAP]
    below = bounce * 0.5 * (1.0 - nz) * out[OPEN_SKY]
    for c in range(3):
        colour[c] = below * BOUNCE[c]
    for ray in range(-1, sky_rays.shape[0]):
        way = (sun[0], sun[1], sun[2])
        if ray >= 0:
            way = (sky_rays[ray, 0], sky_rays[ray, 1], sky_rays[ray, 2])
        facing = nx * way[0] + ny * way[1] + nz * way[2]
        share = max((facing + wrap) / (1.0 + wrap), 0.0)
        if ray < 0:
            share = (share + out[THROUGH] * max(-facing, 0.0)) * out[OPEN_SUN]
            share *= cloud_shade(point[0], point[1])
        else:
            share *= out[OPEN_SKY]
        if share > 0.0:
            reach = SUN_REACH_M if ray < 0 else SKY_REACH_M
            share *= passing(point, way, reach, around, found)
            for c in range(3):
                colour[c] += share * (white[c] if ray < 0 else sky_light[ray, c])
    for c in range(3):
        colour[c] *= out[c]


@kernel
def shade(
    colour: Numbers,
    seen: Seen,
    azimuths: Numbers,
    slopes: Numbers,
    pixel_rad: float,
    around: Around,
    blades: Numbers,
    wood: Numbers,
    lights: Lights,
    horizon: Numbers,
) -> None:
    """Write the radiance (column, row, 3) of all that is neither sky nor water.

    `wood` is the relief's, `horizon` (column, 3) the radiance behind the haze.
    """
    depth, what, normal, part = seen
    things = around[3]
    out, found = np.empty(NUMBERS), np.empty(5)
    for column in range(azimuths.size):
        ax, ay = math.sin(azimuths[column]), math.cos(azimuths[column])
        turn = azimuths[column] / (2 * math.pi) * wood.shape[0]
        for row in range(slopes.size):
            kind = what[column, row]
            if kind in (SKY, WATER):
                continue
            away, own = depth[column, row], part[column, row]
            x, y, z = away * ax, away * ay, away * slopes[row]
            for c in range(3):
                out[NORMAL + c] = normal[column, row, c]
            _normalise(out)
            out[WRAP], out[THROUGH], out[OPEN_SUN], out[OPEN_SKY] = 0.0, 0.0, 1.0, 1.0
            if kind == GROUND:
                _soil(out, (x, y, z), away, pixel_rad * away, look_up(wood, turn, away))
            elif kind < 0:
                stalk(out, blades[-2 - kind], own, x, y)
            elif things[kind - FIRST_THING, KIND] == HOUSE:
                masonry(out, things[kind - FIRST_THING], own, x, y, z, pixel_rad * away)
            else:
                tree = things[kind - FIRST_THING]
                foliage(out, tree, own, x - tree[X], y - tree[Y], z - tree[Z], pixel_rad * away)
            _normalise(out)
            bounce = 0.3 if kind >= FIRST_THING else 1.0
            _illuminate(colour[column, row], out, (x, y, z), lights, around, bounce, found)
            for c in range(3):
                clear = math.exp(-HAZE_PER_M[c] * away)
                colour[column, row, c] += (1.0 - clear) * (
                    horizon[column, c] - colour[column, row, c]
                )
