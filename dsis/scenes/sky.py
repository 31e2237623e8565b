"""Clear sky and cumulus clouds, lit by the sun: the one sky of both scenes.

Radiance is in units of the scenes: a white diffuse surface that faces the sun has about 1.0, so a
surface of reflectance rho under irradiance E has the radiance rho E / pi. The clear sky is a smooth
function of direction. A cloud is a heap of spheres above a common base, its surface folded by
noise; a ray is followed through it in steps, light from the sun weakened by what lies in between.
Everything is a function of direction and seed; steps start at the cloud, never at random: no grain.

World axes: azimuth 0 looks along y, a quarter turn along x; z is up.
"""

import math
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from dsis.cfa import Cfa
from dsis.compiled import inlined, kernel
from dsis.draw import Draw
from dsis.grid import PixelGrid
from dsis.scenes.noise import noise

TABLE_SHAPE = (97, 384)  # sine of the elevation 0..1, azimuth
ZENITH_COSINE_SQUARED = 1e-4  # what stands for 0, as the zenith has no slope
SUN_RADIANCE_RGB = (0.93, 0.86, 0.75)  # of a white diffuse surface that faces the sun, sun alone
CELL_M, CELLS, SHARE = 3600.0, 34, 0.56  # one place for a cloud, places across, share taken
BASE_M, LOBES = 1150.0, 12
EXTINCTION_PER_M, AIR_PER_M = 0.012, 1 / 70000.0
STEP_M, STEP_RAD, OCTAVES = 24.0, 0.002, 4


@dataclass(frozen=True)
class SkyDome:
    """The sky of a seed.

    Attributes
    ----------
    sun_direction
        Unit vector towards the sun, float64 (3,).
    sun_irradiance_rgb
        Of a surface that faces the sun, from the sun alone, float32 (3,).
    clouds
        Float64 (cloud, 1 + LOBES, 4): x, y, z in m and radius in m, of the sphere around all of it
        and of its lobes; nearest first.
    table
        Radiance with clouds, float32 (sine of the elevation, azimuth, 3). Row i looks up by
        sin(elevation) = i / (rows - 1); column j has azimuth 2 pi j / columns and the table
        repeats after the last. The sun's disc is not in it.
    """

    sun_direction: NDArray[np.float64]
    sun_irradiance_rgb: NDArray[np.float32]
    clouds: NDArray[np.float64]
    table: NDArray[np.float32]

    @classmethod
    def of(cls, seed: int, sun_azimuth_rad: float, sun_elevation_rad: float) -> Self:
        """Make the sky of a seed with the sun in this direction."""
        level = math.cos(sun_elevation_rad)
        sun = np.array(
            [
                level * math.sin(sun_azimuth_rad),
                level * math.cos(sun_azimuth_rad),
                math.sin(sun_elevation_rad),
            ]
        )
        clouds = _clouds(seed)
        table = np.empty((*TABLE_SHAPE, 3), np.float32)
        sine = np.linspace(0, 1, TABLE_SHAPE[0])
        slopes: NDArray[np.float64] = sine / np.sqrt(
            np.maximum(1 - sine * sine, ZENITH_COSINE_SQUARED)
        )
        azimuths = np.arange(TABLE_SHAPE[1], dtype=np.float64) * (2 * np.pi / TABLE_SHAPE[1])
        _paint(table, slopes, azimuths, sun, clouds, 2 * np.pi / TABLE_SHAPE[1])
        irradiance = (np.pi * np.array(SUN_RADIANCE_RGB)).astype(np.float32)
        return cls(sun, irradiance, clouds, table)


def paint(
    dome: SkyDome,
    slopes: NDArray[np.float64],
    azimuths: NDArray[np.float64],
    image: NDArray[np.float32],
) -> None:
    """Paint the sky into a picture on a cylinder around the eye.

    Parameters
    ----------
    dome
        The sky.
    slopes
        Tangent of the elevation of each row, (row,); at and below 0 the horizon's clear sky.
    azimuths
        Of each column in radians, (column,).
    image
        Float32 (row, column, 3), overwritten.
    """
    footprint = abs(float(slopes[1] - slopes[0])) if slopes.size > 1 else 1e-3
    _paint(image, slopes, azimuths, dome.sun_direction, dome.clouds, footprint)


def _clouds(seed: int) -> NDArray[np.float64]:
    """Return the clouds of a seed: see `SkyDome.clouds`."""
    draw = Draw(seed, ("scenes", "sky"))

    def uniform(purpose: str, rows: int, columns: int) -> NDArray[np.float64]:
        return draw.uniform(purpose, PixelGrid(rows, columns, Cfa.MONO, 0, 0)).astype(np.float64)

    cell = np.arange(CELLS) - CELLS / 2
    x = (cell[None, :] + uniform("x", CELLS, CELLS)) * CELL_M
    y = (cell[:, None] + uniform("y", CELLS, CELLS)) * CELL_M
    size = 420 + 1250 * uniform("size", CELLS, CELLS) ** 1.6
    taken = (uniform("taken", CELLS, CELLS) < SHARE) & (np.hypot(x, y) > 4200)
    x, y, size = x[taken], y[taken], size[taken][:, None]
    turn = 2 * np.pi * uniform("turn", CELLS * CELLS, LOBES)[taken.ravel()]
    out = np.sqrt(uniform("out", CELLS * CELLS, LOBES))[taken.ravel()]
    vary, rise = (uniform(p, CELLS * CELLS, LOBES)[taken.ravel()] for p in ("vary", "rise"))
    radius = size * (0.46 - 0.26 * out) * (0.75 + 0.5 * vary)
    height = BASE_M + radius * 0.2 + size * 0.75 * (1 - out) * rise
    spheres = np.empty((x.size, 1 + LOBES, 4))
    spheres[:, 1:, 0] = x[:, None] + size * out * np.cos(turn)
    spheres[:, 1:, 1] = y[:, None] + size * out * np.sin(turn)
    spheres[:, 1:, 2], spheres[:, 1:, 3] = height, radius
    middle = spheres[:, 1:, :3].mean(axis=1)
    reach = np.linalg.norm(spheres[:, 1:, :3] - middle[:, None], axis=2) + 1.25 * radius
    spheres[:, 0, :3], spheres[:, 0, 3] = middle, reach.max(axis=1)
    return spheres[np.argsort(np.hypot(x, y), kind="stable")]


@kernel
def _density(
    x: float, y: float, z: float, cloud: NDArray[np.float64], octaves: int, footprint: float
) -> float:
    """Return the share of a cloud's full density at a point, 0..1; negative: metres to go."""
    if z < BASE_M:
        return 0.0
    inside = -1e9
    for n in range(1, cloud.shape[0]):
        away = math.sqrt((x - cloud[n, 0]) ** 2 + (y - cloud[n, 1]) ** 2 + (z - cloud[n, 2]) ** 2)
        depth = cloud[n, 3] - away
        gap = max(60.0 - abs(depth - inside), 0.0)  # where two spheres meet, blend over 60 m
        inside = max(inside, depth) + gap * gap / 240.0
    if inside < -350.0:
        return inside + 320.0
    strength, size = 190.0, 520.0
    for _ in range(octaves):
        keep = min(max(2.0 - 3.0 * footprint / size, 0.0), 1.0)
        if keep == 0.0:
            break
        folds = abs(noise(x / size + 7.3, y / size, z / size - 3.1))
        inside += strength * keep * (2.0 * folds - 0.75)  # round bulges, sharp creases
        strength *= 0.54
        size *= 0.47
    return min(max(inside / 110.0, 0.0), 1.0) * min((z - BASE_M) / 120.0, 1.0)


@kernel
def _shine(
    x: float, y: float, z: float, sun: NDArray[np.float64], cloud: NDArray[np.float64]
) -> float:
    """Return the share of sunlight that reaches a point inside a cloud, scattered or not."""
    depth, step = 0.0, 55.0
    along = 35.0
    for _ in range(5):
        there = _density(x + along * sun[0], y + along * sun[1], z + along * sun[2], cloud, 2, 60.0)
        depth += max(there, 0.0) * step * EXTINCTION_PER_M
        along += 0.8 * step + 30.0
        step *= 1.7
    return 0.62 * math.exp(-0.55 * depth) + 0.38 * math.exp(-0.11 * depth)


@inlined
def _clear(out: Any, sine: Any, towards_sun: Any) -> Any:
    """Write the clear sky's radiance (3,) for sin(elevation) and the cosine to the sun."""
    low = math.exp(-5.2 * max(sine, 0.0))
    angle = math.acos(min(max(towards_sun, -1.0), 1.0))
    glow = 0.20 * math.exp(-3.2 * angle) + 0.25 * math.exp(-40.0 * angle * angle)
    side = 0.84 + 0.16 * towards_sun * towards_sun
    out[0] = side * (0.080 + 0.36 * low * (0.75 + 0.25 * low)) + glow
    out[1] = side * (0.165 + 0.39 * low * (0.85 + 0.15 * low)) + 0.95 * glow
    out[2] = side * (0.395 + 0.34 * low) + 0.86 * glow


@kernel
def _through(
    light: NDArray[np.float64],
    ray: tuple[float, float, float],
    sun: NDArray[np.float64],
    cloud: NDArray[np.float64],
    horizon: NDArray[np.float64],
    pixel_rad: float,
) -> None:
    """Follow a ray through a cloud: add to radiance light[:3], weaken clearness light[3]."""
    dx, dy, dz = ray
    x, y, z, radius = cloud[0, 0], cloud[0, 1], cloud[0, 2], cloud[0, 3]
    middle = dx * x + dy * y + dz * z
    half = radius * radius - (x * x + y * y + z * z - middle * middle)
    if half <= 0.0 or light[3] < 0.01 or dz <= 0.0:
        return
    half = math.sqrt(half)
    begin, end = max(middle - half, BASE_M / dz), middle + half
    if end <= begin:
        return
    near = math.exp(-AIR_PER_M * middle)
    silver = 1.0 + 0.35 * max(dx * sun[0] + dy * sun[1] + dz * sun[2], 0.0) ** 6
    along, step = begin, max(STEP_M, STEP_RAD * begin)
    while along < end:
        along += step
        px, py, pz = along * dx, along * dy, along * dz
        share = _density(px, py, pz, cloud, OCTAVES, along * pixel_rad)
        if share <= 0.0:
            along -= min(share + step, 0.0)
            continue
        passed = math.exp(-share * EXTINCTION_PER_M * step)
        lit = _shine(px, py, pz, sun, cloud) * silver
        open_sky = min((pz - BASE_M) / 1400.0, 1.0)
        weight = light[3] * (1.0 - passed)
        light[0] += weight * (
            near * (1.04 * lit + 0.12 + 0.17 * open_sky - horizon[0]) + horizon[0]
        )
        light[1] += weight * (near * (0.98 * lit + 0.14 + 0.2 * open_sky - horizon[1]) + horizon[1])
        light[2] += weight * (
            near * (0.89 * lit + 0.18 + 0.26 * open_sky - horizon[2]) + horizon[2]
        )
        light[3] *= passed
        if light[3] < 0.01:
            return


@kernel
def _paint(
    image: NDArray[np.float32],
    slopes: NDArray[np.float64],
    azimuths: NDArray[np.float64],
    sun: NDArray[np.float64],
    clouds: NDArray[np.float64],
    pixel_rad: float,
) -> None:
    """Paint every pixel."""
    seen = np.empty(clouds.shape[0], np.int64)
    sky, horizon, light = np.empty(3), np.empty(3), np.empty(4)
    for column in range(azimuths.size):
        ax, ay = math.sin(azimuths[column]), math.cos(azimuths[column])
        _clear(horizon, 0.0, ax * sun[0] + ay * sun[1])
        count = 0
        for n in range(clouds.shape[0]):
            ahead = ax * clouds[n, 0, 0] + ay * clouds[n, 0, 1]
            aside = ay * clouds[n, 0, 0] - ax * clouds[n, 0, 1]
            if ahead > -clouds[n, 0, 3] and abs(aside) < clouds[n, 0, 3]:
                seen[count] = n
                count += 1
        for row in range(slopes.size):
            slope = max(slopes[row], 0.0)
            long = 1.0 / math.sqrt(1.0 + slope * slope)
            ray = (ax * long, ay * long, slope * long)
            _clear(sky, ray[2], ray[0] * sun[0] + ray[1] * sun[1] + ray[2] * sun[2])
            light[:3] = 0.0
            light[3] = 1.0
            for m in range(count):
                _through(light, ray, sun, clouds[seen[m]], horizon, pixel_rad)
            for c in range(3):
                image[row, column, c] = light[c] + light[3] * sky[c]
