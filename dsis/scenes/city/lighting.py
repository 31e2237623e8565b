"""Light of sun, sky and surroundings. Caches on disk: as `dsis.scenes.city.patterns`."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dsis.compiled import kernel
from dsis.scenes.city.cells import Cells
from dsis.scenes.city.rays import Solid, outward, trace
from dsis.scenes.city.solids import KIND, ROOF, WALL, Kind
from dsis.scenes.city.spot import AT, NORMAL, SPREAD, Vec

AMBIENT_M, MIRROR_M = 55.0, 160.0  # how far away what lights a surface, or is mirrored, is traced
CLEAR_M = 1500.0  # the air thins out towards the eye, which is high up
BOUNCE = 0.04  # radiance of the city below, where a ray for ambient light meets nothing near
_HALF_WALL = (int(Kind.MODERN), int(Kind.GLASS))


class Light(NamedTuple):
    """Sun, sky and air.

    Attributes
    ----------
    sun_points
        Unit vectors to points of the sun's disc: float64 (sample, 3).
    sun_rgb
        Radiance of a white diffuse surface that faces the sun, from the sun alone: float64 (3,).
    sky_points
        Unit vectors about +z, density as their cosine to it: float64 (sample, ambient, 3).
    sky
        Radiance, float32 (sine of the elevation, azimuth, 3), as of `dsis.scenes.sky`.
    haze_per_m, haze_rgb
        Extinction and the radiance of thick air: float64 (3,).
    """

    sun_points: NDArray[np.float64]
    sun_rgb: NDArray[np.float64]
    sky_points: NDArray[np.float64]
    sky: NDArray[np.float32]
    haze_per_m: NDArray[np.float64]
    haze_rgb: NDArray[np.float64]


@kernel
def _sky(sky: NDArray[np.float32], d: Vec) -> Vec:
    """Return the sky's radiance in a direction, between the table's entries."""
    rows, columns, _ = sky.shape
    v = min(max(d[2], 0.0), 1.0) * (rows - 1)
    u = (math.atan2(d[0], d[1]) / (2 * math.pi) % 1.0) * columns
    i, j = min(math.floor(v), rows - 2), math.floor(u) % columns
    k, s, t = (j + 1) % columns, u - math.floor(u), v - i
    low, high = sky[i], sky[i + 1]
    a, b, c, e = (1 - t) * (1 - s), (1 - t) * s, t * (1 - s), t * s
    return (
        a * low[j, 0] + b * low[k, 0] + c * high[j, 0] + e * high[k, 0],
        a * low[j, 1] + b * low[k, 1] + c * high[j, 1] + e * high[k, 1],
        a * low[j, 2] + b * low[k, 2] + c * high[j, 2] + e * high[k, 2],
    )


@kernel
def _glance(s: Solid, face: int, p: Vec, light: Light) -> Vec:
    """Return roughly what light a solid sends out, in reflections and from wall to wall.

    Near the ground it is taken to stand in shadow.
    """
    normal, sun = outward(s, face, p), light.sun_points[0]
    facing = normal[0] * sun[0] + normal[1] * sun[1] + normal[2] * sun[2]
    lit = max(facing, 0.0) * min(max((p[2] - 5.0) / 12.0, 0.0), 1.0)
    c = ROOF if face >= 5 else WALL
    share = 0.5 if face < 5 and int(s[KIND]) in _HALF_WALL else 0.75  # the rest is windows
    glow = 0.02 + 0.08 * max(normal[2], 0.0)
    return (
        share * s[c] * (lit * light.sun_rgb[0] + glow),
        share * s[c + 1] * (lit * light.sun_rgb[1] + 1.15 * glow),
        share * s[c + 2] * (lit * light.sun_rgb[2] + 1.4 * glow),
    )


@kernel
def mirrored(
    table: Solid, cells: Cells, light: Light, spot: NDArray[np.float64], d: Vec, pixel: float
) -> Vec:
    """Return what is seen in a mirror at a spot along d: solids, sky and the sun.

    The sun's image is spread over an angle: panes bend, and waves are steeper than one ripple.
    """
    p = (spot[AT], spot[AT + 1], spot[AT + 2])
    most = min(MIRROR_M, -p[2] / d[2]) if d[2] < -1e-6 else MIRROR_M
    t, k, face = trace(table, cells, p, d, most, pixel, False)
    if k >= 0:
        at = (p[0] + t * d[0], p[1] + t * d[1], p[2] + t * d[2])
        return _glance(table[k], face, at, light)
    if d[2] < 0:
        return BOUNCE, BOUNCE, BOUNCE
    r, g, b = _sky(light.sky, d)
    sun, spread = light.sun_points[0], spot[SPREAD]
    off = 1 - (d[0] * sun[0] + d[1] * sun[1] + d[2] * sun[2])
    # an exponential of 1 - cosine that holds all its light: pi radiance = 2 pi spread peak
    peak = math.exp(-off / spread) / (2 * spread) if off < 9 * spread else 0.0
    sun_rgb = light.sun_rgb
    return r + peak * sun_rgb[0], g + peak * sun_rgb[1], b + peak * sun_rgb[2]


@kernel
def ambient(
    table: Solid, cells: Cells, light: Light, spot: NDArray[np.float64], sample: int, pixel: float
) -> Vec:
    """Return the light of sky and surroundings on a spot: its irradiance over pi."""
    p = (spot[AT], spot[AT + 1], spot[AT + 2])
    x, y, z = spot[NORMAL], spot[NORMAL + 1], spot[NORMAL + 2]
    sign = 1.0 if z >= 0 else -1.0  # a frame about the normal (Duff et al., JCGT 6, 2017)
    c = -1 / (sign + z)
    e = x * y * c
    total_r, total_g, total_b = 0.0, 0.0, 0.0
    count = light.sky_points.shape[1]
    for n in range(count):
        a, b, w = light.sky_points[sample, n]
        d = (
            a * (1 + sign * x * x * c) + b * e + w * x,
            a * sign * e + b * (sign + y * y * c) + w * y,
            -a * sign * x - b * y + w * z,
        )
        most = min(AMBIENT_M, -p[2] / d[2]) if d[2] < -1e-6 else AMBIENT_M
        t, k, face = trace(table, cells, p, d, most, pixel, False)
        if k >= 0:
            at = (p[0] + t * d[0], p[1] + t * d[1], p[2] + t * d[2])
            glow = _glance(table[k], face, at, light)
        elif d[2] < 0.02:
            near = 0.25 * BOUNCE if most < AMBIENT_M else BOUNCE
            glow = (near, near, near)
        else:
            glow = _sky(light.sky, d)
        total_r, total_g, total_b = total_r + glow[0], total_g + glow[1], total_b + glow[2]
    return total_r / count, total_g / count, total_b / count


@kernel
def through_air(seen: Vec, distance: float, light: Light) -> Vec:
    """Return what is left of a radiance after so many metres of air, and the air's own light."""
    path = distance * distance / (distance + CLEAR_M)
    a = math.exp(-path * light.haze_per_m[0])
    b = math.exp(-path * light.haze_per_m[1])
    c = math.exp(-path * light.haze_per_m[2])
    haze = light.haze_rgb
    return (
        a * seen[0] + (1 - a) * haze[0],
        b * seen[1] + (1 - b) * haze[1],
        c * seen[2] + (1 - c) * haze[2],
    )
