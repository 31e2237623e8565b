"""A house as a convex solid: walls, and a roof of two or four slopes; where a ray is inside it."""

import numpy as np
from numpy.typing import NDArray

from dsis.compiled import kernel
from dsis.scenes.landscape.planting import (
    COS,
    EAVES,
    HALF_X,
    HALF_Y,
    PITCH_X,
    PITCH_Y,
    SIN,
    X,
    Y,
    Z,
)  # fmt: skip

Numbers = NDArray[np.float64]
FACES, FLOOR, ROOF = 9, 4, 5  # 0-3 are walls, from ROOF on slopes of the roof


@kernel
def _plane(house: Numbers, face: int) -> tuple[float, float, float, float]:
    """Return the outward normal of a face in the house's axes, and its limit along it."""
    sign = 1.0 if face % 2 == 0 else -1.0
    if face < 2:
        return sign, 0.0, 0.0, house[HALF_X]
    if face < FLOOR:
        return 0.0, sign, 0.0, house[HALF_Y]
    if face == FLOOR:
        return 0.0, 0.0, -1.0, 0.0
    if face < ROOF + 2:
        return 0.0, sign * house[PITCH_Y], 1.0, house[EAVES] + house[PITCH_Y] * house[HALF_Y]
    if house[PITCH_X] == 0.0:
        return 0.0, 0.0, 1.0, 1e9
    return sign * house[PITCH_X], 0.0, 1.0, house[EAVES] + house[PITCH_X] * house[HALF_X]


@kernel
def cross(
    found: Numbers,
    start: tuple[float, float, float],
    ray: tuple[float, float, float],
    house: Numbers,
) -> float:
    """Return where a ray leaves a house, -1e9 if it misses it.

    Writes to `found` where it enters, the outward normal there (not of unit length) and the face.
    """
    cos, sin = house[COS], house[SIN]
    x, y, oz = start[0] - house[X], start[1] - house[Y], start[2] - house[Z]
    ox, oy = cos * x + sin * y, cos * y - sin * x
    dx, dy = cos * ray[0] + sin * ray[1], cos * ray[1] - sin * ray[0]
    enter, leave, best = -1e9, 1e9, 0
    for face in range(FACES):
        nx, ny, nz, limit = _plane(house, face)
        speed = nx * dx + ny * dy + nz * ray[2]
        gap = limit - (nx * ox + ny * oy + nz * oz)
        if speed < 0.0:
            if gap / speed > enter:
                enter, best = gap / speed, face
        elif speed > 0.0:
            leave = min(leave, gap / speed)
        elif gap < 0.0:
            return -1e9
    nx, ny, nz, _ = _plane(house, best)
    found[0], found[4] = enter, best
    found[1], found[2], found[3] = cos * nx - sin * ny, sin * nx + cos * ny, nz
    return float(leave) if enter < leave else -1e9
