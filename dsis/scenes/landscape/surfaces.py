"""Surfaces of what stands and grows: leaves, bark, grass, petals, walls, roofs.

A surface is float64 (10,): albedo of red, green and blue; normal, of any length; how far light
wraps around it; what share passes through it; what shares of sun and sky its own kind leaves open.
"""

import math

import numpy as np
from numpy.typing import NDArray

from dsis.compiled import kernel
from dsis.scenes.landscape import grass
from dsis.scenes.landscape.ground import fractal, mix, step
from dsis.scenes.landscape.house import ROOF
from dsis.scenes.landscape.planting import (
    BUSH,
    CONIFER,
    COS,
    EAVES,
    HALF_X,
    HALF_Y,
    KIND,
    SIN,
    TONE,
    VARIANT,
    X,
    Y,
    Z,
)  # fmt: skip
from dsis.scenes.landscape.visible import STEM
from dsis.scenes.noise import flakes, noise

Numbers = NDArray[np.float64]
NORMAL, WRAP, THROUGH, OPEN_SUN, OPEN_SKY, NUMBERS = 3, 6, 7, 8, 9, 10
TWIGS_M = (0.11, 0.30, 0.85)  # sizes of leaves and their clusters
PETALS = np.array(
    [[0.145, 0.195, 0.04], [0.78, 0.60, 0.03], [0.85, 0.84, 0.80], [0.34, 0.22, 0.55],
     [0.62, 0.06, 0.03], [0.30, 0.26, 0.12]]
)  # fmt: skip
WALLS = np.array([[0.82, 0.80, 0.75], [0.78, 0.72, 0.58], [0.70, 0.66, 0.60], [0.60, 0.46, 0.34]])
TILES = np.array([[0.33, 0.13, 0.07], [0.26, 0.10, 0.06], [0.15, 0.13, 0.13], [0.30, 0.16, 0.09]])


@kernel
def foliage(
    out: Numbers, tree: Numbers, part: float, x: float, y: float, z: float, pixel: float
) -> None:
    """Write the surface of a leaf or of bark; the place as seen from the tree's foot."""
    if part == STEM:
        tone = 1.0 + 0.4 * noise(x / 0.15, y / 0.15, z / 0.5)
        out[0], out[1], out[2] = 0.085 * tone, 0.068 * tone, 0.05 * tone
        return
    tone = 0.75 + 0.5 * tree[TONE]
    kind = int(tree[KIND])
    if kind == CONIFER:
        out[0], out[1], out[2] = 0.065 * tone, 0.1 * tone, 0.042 * tone
    elif kind == BUSH:
        out[0], out[1], out[2] = 0.115 * tone, 0.15 * tone, 0.04 * tone
    else:
        warm = 0.75 + 0.6 * (tree[TONE] * 7 % 1)
        out[0], out[1], out[2] = 0.13 * tone * warm, 0.185 * tone, 0.04 * tone
    vary = 1.0 + 0.2 * noise(x / 0.6, y / 0.6, z / 0.6)
    for size in TWIGS_M:
        keep = min(max(2.0 - 1.6 * pixel / size, 0.0), 1.0)
        vary *= 1.0 + 0.24 * keep * flakes(x / size + 5, y / size, z / size)
        bend = 0.42 * keep
        out[NORMAL] += bend * flakes(x / size, y / size, z / size)
        out[NORMAL + 1] += bend * flakes(x / size + 99, y / size, z / size)
        out[NORMAL + 2] += bend * flakes(x / size, y / size + 99, z / size)
    for c in range(3):
        out[c] *= vary
    out[WRAP], out[THROUGH] = 0.2, 0.45
    out[OPEN_SKY] = 0.45 + 0.55 * step(part, -0.6, 0.5)
    out[OPEN_SUN] = 0.5 + 0.5 * step(part, -0.5, 0.2)


@kernel
def stalk(out: Numbers, blade: Numbers, part: float, x: float, y: float) -> None:
    """Write the surface of a blade of grass, a petal or an ear."""
    head, tone = int(blade[grass.HEAD]), blade[grass.TONE]
    if part > 1.5:
        out[0], out[1], out[2] = PETALS[head]
    else:
        vary = (0.72 + 0.5 * tone) * (1.0 + 0.3 * fractal(x / 6, y / 6, 0, 2))
        out[0], out[1], out[2] = PETALS[0, 0] * vary, PETALS[0, 1] * vary, PETALS[0, 2] * vary
        mix(out, 0.26, 0.22, 0.09, step(tone + 0.5 * noise(x / 9, y / 9, 3.0), 0.75, 1.25))
    out[WRAP], out[THROUGH] = 0.25, 0.75
    rise = min(part, 1.0)
    out[OPEN_SUN], out[OPEN_SKY] = min(0.40 + 1.2 * rise, 1.0), 0.35 + 0.65 * rise


@kernel
def masonry(
    out: Numbers, building: Numbers, face: float, x: float, y: float, z: float, pixel: float
) -> None:
    """Write the albedo of a wall with windows, or of a roof."""
    tone = int(building[TONE] * 97) % 4 if building[VARIANT] > 1 else 0
    if face >= ROOF:
        row = (z - building[Z]) / 0.5
        fade = min(max(1.5 - 2 * pixel / 0.5, 0.0), 1.0)
        vary = 1 + 0.15 * fade * math.sin(2 * math.pi * row) + 0.2 * noise(x / 1.5, y / 1.5, z)
        roof = 2 if building[VARIANT] == 0 else int(building[TONE] * 53) % 4
        for c in range(3):
            out[c] = TILES[roof, c] * vary
        return
    for c in range(3):
        out[c] = WALLS[tone, c]
    dx, dy = x - building[X], y - building[Y]
    along = (
        building[COS] * dx + building[SIN] * dy
        if face > 1
        else building[COS] * dy - building[SIN] * dx
    )
    up = z - building[Z] - 1.6
    half = building[HALF_X] if face > 1 else building[HALF_Y]
    storey = 2.7 if building[VARIANT] > 1 else 7.5
    bay = 2.6 if building[VARIANT] > 1 else 3.6
    u, v = along / bay - math.floor(along / bay) - 0.5, up / storey - math.floor(up / storey) - 0.5
    soft = 0.5 * pixel
    window = step(abs(u) * bay, 0.5 + soft, 0.45 - soft) * step(
        abs(v) * storey, 0.7 + soft, 0.6 - soft
    )
    window *= 1.0 if 0.0 < up < building[EAVES] - 1.6 and abs(along) < half - 0.6 else 0.0
    window *= min(1.5 / (pixel + 0.6), 1.0)
    mix(out, 0.035, 0.04, 0.045, window)
