"""Colours of the ground: meadow, fields with rows and tracks, roads, shores, far woods, rock."""

import math

import numpy as np
from numpy.typing import NDArray

from dsis.compiled import kernel
from dsis.scenes.landscape.grass import TRACK_BEND_RAD, TRACK_GAUGE_M, TRACK_RAD
from dsis.scenes.landscape.planting import FIELD_P_M, FIELD_Q_M, LAST_TREE_M
from dsis.scenes.landscape.relief import LAKE_M
from dsis.scenes.noise import noise

Numbers = NDArray[np.float64]
CROPS = np.array(
    [
        [0.42, 0.33, 0.12], [0.19, 0.26, 0.06], [0.14, 0.21, 0.05], [0.22, 0.15, 0.09],
        [0.46, 0.40, 0.06], [0.23, 0.29, 0.08], [0.36, 0.32, 0.14], [0.16, 0.23, 0.06],
    ]
)  # fmt: skip


@kernel
def fractal(x: float, y: float, footprint: float, octaves: int) -> float:
    """Return noise of some octaves, the coarsest one unit wide, none finer than the footprint."""
    total, weight, size = 0.0, 1.0, 1.0
    for n in range(octaves):
        keep = min(max(2.0 - 2.5 * footprint / size, 0.0), 1.0)
        if keep == 0.0:
            break
        total += weight * keep * noise(x / size, y / size, 5.3 * n)
        weight *= 0.6
        size *= 0.47
    return total


@kernel
def mix(out: Numbers, red: float, green: float, blue: float, share: float) -> None:
    """Move the first three numbers of `out` by a share towards a colour."""
    out[0] += share * (red - out[0])
    out[1] += share * (green - out[1])
    out[2] += share * (blue - out[2])


@kernel
def step(x: float, low: float, high: float) -> float:
    """Return 0 before `low`, 1 past `high` (either may be the larger), smooth between them."""
    t = min(max((x - low) / (high - low), 0.0), 1.0)
    return t * t * (3.0 - 2.0 * t)


@kernel
def _field(out: Numbers, x: float, y: float, pixel: float, deep: float) -> None:
    """Write the albedo of the field at a place: a crop, its rows, the grass at its borders."""
    p = (0.8 * x - 0.6 * y) / FIELD_P_M + 0.3 * math.sin(x / 210 + 1) + 0.2 * math.sin(y / 330)
    q = (0.6 * x + 0.8 * y) / FIELD_Q_M + 0.2 * math.sin(y / 270 + 2)
    i, j = math.floor(p), math.floor(q)
    pick = 0.5 + 0.5 * noise(17.3 * i + 0.5, 13.1 * j + 0.5, 2.5)
    crop = int(pick * 11.0 * CROPS.shape[0]) % CROPS.shape[0]
    across = (p - i) * FIELD_P_M if (crop + i) % 2 else (q - j) * FIELD_Q_M
    wide = 2.4 if crop != 3 else 1.1
    fade = min(max(1.6 - 2.2 * max(pixel, 0.6 * deep) / wide, 0.0), 1.0)
    rows = 0.16 * fade * math.sin(2 * math.pi * across / wide)
    lane = across / 18.0 - math.floor(across / 18.0)  # where the tractor drives
    tracks = 0.25 * step(abs(lane - 0.5), 0.035 + deep / 36, 0.02) * min(0.6 / (deep + 0.1), 1.0)
    patch = 0.13 * fractal(x / 60, y / 60, deep / 60, 3) + 0.12 * fractal(x / 4, y / 4, deep / 4, 3)
    tone = 1.0 + rows - tracks + patch
    for c in range(3):
        out[c] = CROPS[crop, c] * tone
    border = min(abs(p - round(p)) * FIELD_P_M, abs(q - round(q)) * FIELD_Q_M)
    mix(out, 0.10 * tone, 0.14 * tone, 0.035, step(border, 3.4, 2.2))


@kernel
def ground(
    out: Numbers,
    x: float,
    y: float,
    height: float,
    steep: float,
    away: float,
    pixel: float,
    deep: float,
    wood: float,
) -> None:
    """Write the albedo of the ground."""
    if away < 240.0:
        patch = fractal(x / 5, y / 5, deep / 5, 5)
        blades = fractal(x / 0.22, y / 0.22, deep / 0.22, 3)
        tone = math.exp(0.35 * patch + 0.4 * blades) * (0.7 + 0.3 * step(away, 20, 90))
        out[0], out[1], out[2] = 0.105 * tone, 0.135 * tone, 0.035 * tone
        turn = math.atan2(x, y) / TRACK_RAD
        aside = (turn - math.floor(turn) - 0.5) * TRACK_RAD - TRACK_BEND_RAD * math.sin(away / 15)
        off = abs(abs(aside * away) - TRACK_GAUGE_M / 2)
        mix(out, 0.44 * tone, 0.35 * tone, 0.24 * tone, 0.85 * step(off, 0.30, 0.12))
        return
    _field(out, x, y, pixel, deep)
    tone = math.exp(0.3 * fractal(x / 35, y / 35, deep / 35, 5))
    meadow = step(
        fractal(x / 430 + 9, y / 430, 0, 2) - 0.1 + (steep - 0.12) * 5 + (height - 30) / 60,
        -0.05,
        0.05,
    )
    mix(out, 0.165 * tone, 0.215 * tone, 0.055 * tone, meadow)
    road = 1500 + 210 * math.sin(3 * math.atan2(x, y) + 0.7) + 60 * math.sin(8 * math.atan2(x, y))
    turn = math.atan2(x, y) * 4.5 / math.pi + 0.12 * math.sin(away / 170)
    lane = abs(turn - math.floor(turn) - 0.5) * math.pi / 4.5 * away
    edge = min(abs(away - road), lane)
    mix(out, 0.40, 0.38, 0.34, 0.9 * step(edge, 3.4 + pixel, 2.6) * min(6.0 / (pixel + 3.0), 1.0))
    bank = height - LAKE_M
    mix(out, 0.16 * tone, 0.17 * tone, 0.06, step(bank, 1.5, 1.0))  # reeds
    mix(out, 0.34 * tone, 0.29 * tone, 0.20 * tone, step(bank, 0.5, 0.3))  # sand
    if wood > 0.0:
        tall = away > LAST_TREE_M - 100.0
        crown = noise(x / 8, y / 8, height / 8) * min(max(2.0 - pixel / 3.0, 0.0), 1.0)
        crown += 0.6 * fractal(x / 30, y / 30, deep / 60, 2)
        leaf = math.exp(0.55 * crown) if tall else 0.5
        stand = 0.7 + 0.3 * step(math.sin(x / 170 + 2) * math.sin(y / 210), 0.3, 0.0)
        mix(out, 0.055 * leaf * stand, 0.082 * leaf * stand, 0.026 * leaf, step(wood, 0.0, 0.03))
    if away > 5000.0:
        rough = fractal(x / 260, y / 260, deep / 260, 5)
        rock = step(height + 130 * rough + 260 * steep, 480, 640)
        tone = 1.0 + 0.35 * rough
        mix(out, 0.30 * tone, 0.28 * tone, 0.26 * tone, rock)
