"""Grass and flowers of the meadow: one curved blade each, wider and fewer with distance."""

import numpy as np
from numpy.typing import NDArray

from dsis.draw import Draw
from dsis.scenes.landscape.relief import Relief

NEAR_M, FAR_M = 6.2, 95.0
STEP_RAD, STEP_LOG = 0.0027, 0.0088  # one blade in each cell of azimuth and logarithm of the range
(AZIMUTH, RANGE, FOOT, TALL, LEAN, WIDE, TONE, HEAD, FACING) = range(9)
COLUMNS = 9
TRACK_RAD, TRACK_BEND_RAD, TRACK_GAUGE_M = 1.1, 0.12, 1.5  # cart-ways through the meadow
STEM, YELLOW, WHITE, VIOLET, RED, EAR = range(6)  # heads: none, flowers, an ear of seeds


def blades(relief: Relief, seed: int, first_rad: float, last_rad: float) -> NDArray[np.float64]:
    """Return the blades between two azimuths, float64 (blade, COLUMNS), sorted by azimuth.

    Azimuth and lean in radians as seen from the eye; range, height of the foot, length and width
    in m.
    """
    draw = Draw(seed, ("scenes", "meadow"))
    i = np.arange(int(first_rad / STEP_RAD) - 1, int(last_rad / STEP_RAD) + 2)
    j = np.arange(int(np.log(FAR_M / NEAR_M) / STEP_LOG))
    cell = np.stack(np.broadcast_arrays(i[:, None] + (1 << 20), j[None], 0), 0).reshape(3, -1)
    a, b = draw.scattered("place", cell)
    c, d = draw.scattered("shape", cell)
    e, f = draw.scattered("colour", cell)
    azimuth = (cell[0] - (1 << 20) + a) * STEP_RAD
    away = NEAR_M * np.exp((cell[1] + b) * STEP_LOG)
    x, y = away * np.sin(azimuth), away * np.cos(azimuth)
    coarse = np.maximum(away / 11.0, 1.0) ** 0.9
    patch = np.sin(x / 2.3 + 1.3 * np.sin(y / 3.1)) * np.sin(y / 2.9 + np.sin(x / 4.7))
    tuft = np.sin(x * 2.9 + 2 * np.sin(y * 1.7)) * np.sin(y * 3.3 + 1.5 * np.sin(x * 2.2))
    tall = (0.17 + 0.22 * c * c + 0.09 * tuft + 0.06 * patch) * (1 + 0.15 * d)
    head = np.zeros(a.size)
    bloom = (e < 0.045 + 0.05 * patch) & (away > 6.5)
    head[bloom] = (
        1
        + np.floor(4 * np.clip(0.5 + 0.5 * np.sin(x / 3.7 + y / 5.3) + 0.6 * (f - 0.5), 0, 0.999))[
            bloom
        ]
    )
    ear = (e > 0.93) & (patch > -0.2)
    head[ear] = EAR
    tall = np.where(ear, 0.5 + 0.28 * c, np.where(bloom, 0.2 + 0.22 * c, tall))
    off = _off_the_track(azimuth, away)
    worn = np.where(off < 0.20, 0.25, np.where(off < 0.75, 0.75, 1.0))
    tall *= np.where(worn < 1, worn * np.where(head > 0, 0.6, 1), 1)
    head[worn < 0.5] = STEM
    lean = np.where(head > 0, 0.25, 0.8) * (f - 0.42) * tall / away
    wide = np.where(head > 0, 0.0022, 0.0035 + 0.003 * d) * coarse
    foot = relief.at(relief.height, x, y)
    table = np.stack([azimuth, away, foot, tall, lean, wide, f * 37 % 1, head, d * 61 % 1], axis=1)
    order: NDArray[np.float64] = table[np.argsort(azimuth, kind="stable")]
    return order


def _off_the_track(azimuth: NDArray[np.float64], away: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the distance in m to the nearer wheel track of the nearest cart-way."""
    turn = azimuth / TRACK_RAD
    aside = (turn - np.floor(turn) - 0.5) * TRACK_RAD - TRACK_BEND_RAD * np.sin(away / 15)
    off: NDArray[np.float64] = np.abs(np.abs(aside * away) - TRACK_GAUGE_M / 2)
    return off
