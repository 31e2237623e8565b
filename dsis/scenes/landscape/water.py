"""The lakes: what they mirror, the glitter of the sun, their own dark green."""

import math

import numpy as np
from numpy.typing import NDArray

from dsis.compiled import kernel
from dsis.scenes.landscape.ground import fractal, step
from dsis.scenes.landscape.relief import LAKE_M
from dsis.scenes.landscape.shading import HAZE_PER_M, cloud_shade
from dsis.scenes.landscape.visible import SKY, WATER, Seen
from dsis.scenes.noise import flakes, noise

Numbers = NDArray[np.float64]
LONGEST_RIPPLE_M, RIPPLE_SLOPE = 4.2, 0.030
GUST_M_PER_S, LULL = 2.6, 0.35  # wind over the lakes; its share where they are smooth
GLINT = 6.0  # radiance of a cell of wavelets that mirror the sun, in that of a white surface


@kernel
def _ripples(x: float, y: float, deep: float) -> tuple[float, float, float]:
    """Return the slope of the water along y and x, and the variance of what is too fine to see."""
    along, aside, unseen = 0.0, 0.0, 0.0
    size, steep = LONGEST_RIPPLE_M, RIPPLE_SLOPE
    for n in range(4):
        keep = min(max(1.5 - 1.1 * deep / size, 0.0), 1.0)
        if keep > 0.0:
            along += steep * keep * noise(x / size, y / size, 3.1 * n)
            aside += steep * keep * noise(x / size + 31, y / size, 3.1 * n)
        unseen += (steep * 0.45) ** 2 * (1 - keep * keep)
        size, steep = 0.42 * size, 1.12 * steep
    return along, aside, unseen


@kernel
def _sky(out: Numbers, table: NDArray[np.float32], slope: float, azimuth: float) -> None:
    """Write the sky's radiance in a direction."""
    i = min(slope / math.sqrt(1.0 + slope * slope), 0.999) * (table.shape[0] - 1)
    turn = azimuth / (2 * math.pi)
    j = (turn - math.floor(turn)) * table.shape[1]
    m, n = int(i), int(j) % table.shape[1]
    s, t, o = i - m, j - int(j), (n + 1) % table.shape[1]
    for c in range(3):
        low = table[m, n, c] + t * (table[m, o, c] - table[m, n, c])
        high = table[m + 1, n, c] + t * (table[m + 1, o, c] - table[m + 1, n, c])
        out[c] = low + s * (high - low)


@kernel
def _land(
    out: Numbers,
    colour: Numbers,
    depth: Numbers,
    what: NDArray[np.int64],
    slopes: Numbers,
    row: int,
    up: float,
) -> bool:
    """Write what a ray mirrored in a row, rising by `up`, meets in the column; False: nothing."""
    away = depth[row]
    for above in range(row - 1, -1, -1):
        if what[above] == SKY:
            return False
        there = depth[above]
        if what[above] == WATER or there <= away:
            continue
        if there * slopes[above] >= LAKE_M + up * (there - away):
            out[:] = colour[above]
            return True
    return False


@kernel
def _glitter(
    ray: tuple[float, float, float], x: float, y: float, sun: Numbers, wind: float, cell: float
) -> float:
    """Return the radiance of a cell of wavelets, some of which lean half-way between eye and sun.

    Its mean is what slopes of the variance by Cox and Munk (J. Opt. Soc. Am. 44, 838, 1954) mirror,
    less what wavelets hide from one another; no cell has more than `GLINT`.
    """
    dip = -ray[2] / math.sqrt(1.0 + ray[2] * ray[2])
    level = math.sqrt(1.0 - dip * dip)
    hx, hy, hz = sun[0] - level * ray[0], sun[1] - level * ray[1], sun[2] + dip
    square = hx * hx + hy * hy + hz * hz
    variance = 0.0015 + 0.00256 * GUST_M_PER_S * (LULL + (1.0 - LULL) * wind)  # along each axis
    leaning = math.exp(-(square / (hz * hz) - 1.0) / (2.0 * variance)) / (2 * math.pi * variance)
    fresnel = 0.02 + 0.98 * (1.0 - 0.5 * math.sqrt(square)) ** 5
    steep = dip / level / math.sqrt(2.0 * variance)
    hidden = 0.5 * (math.exp(-steep * steep) / (math.sqrt(math.pi) * steep) - math.erfc(steep))
    mean = math.pi * fresnel * leaning * square * square / hz**4 / (4.0 * dip * (1.0 + hidden))
    chance = mean / GLINT
    if chance < 1e-4:
        return 0.0
    size = 0.35 * 2.0 ** math.ceil(max(math.log2(cell / 1.2), 0.0))
    spark = 0.5 + 0.5 * flakes(x / size, y / size, 77.5)
    return GLINT * step(spark, 1.0 - 1.1 * chance, 1.0 - 0.9 * chance)


@kernel
def mirror(
    colour: Numbers,
    seen: Seen,
    azimuths: Numbers,
    slopes: Numbers,
    pixel_rad: float,
    table: NDArray[np.float32],
    sun: Numbers,
    white: Numbers,
    spread: float,
    horizon: Numbers,
) -> None:
    """Write the radiance of water, once the rest of `colour` (column, row, 3) is there.

    `table` is the sky's, `white` the radiance of a white surface that faces the sun; `spread` is
    the sub-pixel point's share, in standard deviations, of the ripples finer than a pixel.
    """
    depth, what, _, part = seen
    out = np.empty(3)
    for column in range(azimuths.size):
        ax, ay = math.sin(azimuths[column]), math.cos(azimuths[column])
        for row in range(slopes.size):
            if what[column, row] != WATER:
                continue
            away, slope = depth[column, row], slopes[row]
            x, y, pixel = away * ax, away * ay, pixel_rad * away
            deep = pixel * min(-1.0 / slope, 30.0)
            wind = 0.10 + 0.90 * step(fractal(x / 260 + 3, y / 420, 0.0, 3), -0.25, 0.35)
            along, aside, unseen = _ripples(x, y, deep)
            along = wind * (along + spread * math.sqrt(unseen))
            up = max(-slope + 2.0 * along, 0.004)
            if not _land(out, colour[column], depth[column], what[column], slopes, row, up):
                _sky(out, table, up, azimuths[column] + 2.0 * aside * wind)
            glint = _glitter((ax, ay, slope), x, y, sun, wind, deep) * cloud_shade(x, y)
            fresnel = 0.02 + 0.98 * (1.0 - min(max(-slope + along, 0.02), 1.0)) ** 5
            shallow = math.exp(0.7 * min(part[column, row] - LAKE_M, 0.0))
            body = (0.010 + 0.05 * shallow, 0.026 + 0.05 * shallow, 0.026 + 0.02 * shallow)
            for c in range(3):
                clear = math.exp(-HAZE_PER_M[c] * away)
                value = fresnel * out[c] + (1.0 - fresnel) * body[c] + glint * white[c]
                colour[column, row, c] = clear * value + (1.0 - clear) * horizon[column, c]
