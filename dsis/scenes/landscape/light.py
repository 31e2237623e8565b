"""How much light reaches a point: what stands between it and the sun or a direction of the sky."""

import math
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from dsis.compiled import kernel
from dsis.scenes.landscape import crown, house
from dsis.scenes.landscape.planting import (
    HEIGHT,
    HOUSE,
    KIND,
    LAST_TREE_M,
    RADIUS,
    VARIANT,
    X,
    Y,
    Z,
)  # fmt: skip

Numbers = NDArray[np.float64]
Around = tuple[NDArray[np.int64], NDArray[np.int64], Numbers, Numbers, Numbers]
"""What stands around: start, item, top of the lattice, things, shapes of crowns."""
CELL_M, CELLS = 12.0, 2 * int(LAST_TREE_M / 12.0 + 8)
COARSE_M = 420.0  # beyond, a crown shades as one sphere
HOUSES = 1e3  # optical depth of a house: opaque


@dataclass(frozen=True)
class Lattice:
    """Which things stand in which square cell of the land.

    Attributes
    ----------
    start
        Int64 (CELLS^2 + 1,): where a cell's things begin in `item`.
    item
        Int64: numbers of things.
    top
        Float64 (CELLS^2,): the height of the highest of them, in m.
    """

    start: NDArray[np.int64]
    item: NDArray[np.int64]
    top: Numbers

    @classmethod
    def of(cls, things: Numbers) -> Self:
        """Sort things into cells; a thing is in all the cells that its circle may touch."""
        parts = []
        for dx in (-1.0, 0.0, 1.0):
            for dy in (-1.0, 0.0, 1.0):
                i = _cell(things[:, X] + dx * things[:, RADIUS])
                j = _cell(things[:, Y] + dy * things[:, RADIUS])
                inside = (i >= 0) & (i < CELLS) & (j >= 0) & (j < CELLS)
                number = np.flatnonzero(inside)
                parts.append((i[inside] * CELLS + j[inside]) * len(things) + number)
        key = np.sort(np.concatenate(parts))
        key = key[np.diff(key, prepend=-1) > 0]
        cell, item = key // len(things), key % len(things)
        start = np.searchsorted(cell, np.arange(CELLS * CELLS + 1)).astype(np.int64)
        top = np.full(CELLS * CELLS, -1e9)
        np.maximum.at(top, cell, things[item, Z] + 1.1 * things[item, HEIGHT])
        return cls(start, item.astype(np.int64), top)


def _cell(metres: Numbers) -> NDArray[np.int64]:
    found: NDArray[np.int64] = np.floor(metres / CELL_M + CELLS / 2).astype(np.int64)
    return found


@kernel
def _weaken(
    point: tuple[float, float, float],
    ray: tuple[float, float, float],
    begin: float,
    end: float,
    thing: Numbers,
    shapes: Numbers,
    coarse: bool,
    found: Numbers,
) -> float:
    """Return the optical depth of a thing between two places on a ray."""
    flat = ray[0] * ray[0] + ray[1] * ray[1]
    aside = ((thing[X] - point[0]) * ray[1] - (thing[Y] - point[1]) * ray[0]) ** 2
    if aside > thing[RADIUS] * thing[RADIUS] * flat:
        return 0.0
    if point[2] + begin * ray[2] > thing[Z] + 1.1 * thing[HEIGHT]:
        return 0.0
    if thing[KIND] == HOUSE:
        leave = min(house.cross(found, point, ray, thing), end)
        return HOUSES if leave - max(found[0], begin, 0.05) > 0.02 else 0.0
    shape = shapes[int(thing[VARIANT])]
    return crown.optical_depth(point, ray, begin, end, thing, shape, coarse)


@kernel
def passing(
    point: tuple[float, float, float],
    ray: tuple[float, float, float],
    reach: float,
    around: Around,
    found: Numbers,
) -> float:
    """Return the share of light that passes all things within `reach` metres along a ray."""
    px, py, pz = point
    start, item, top, things, shapes = around
    fx, fy = px / CELL_M + CELLS / 2, py / CELL_M + CELLS / 2
    i, j = math.floor(fx), math.floor(fy)
    step_i, step_j = (1 if ray[0] > 0 else -1), (1 if ray[1] > 0 else -1)
    pace_x = CELL_M / max(abs(ray[0]), 1e-9)
    pace_y = CELL_M / max(abs(ray[1]), 1e-9)
    next_x = (i + 1 - fx if step_i > 0 else fx - i) * pace_x
    next_y = (j + 1 - fy if step_j > 0 else fy - j) * pace_y
    coarse = px * px + py * py > COARSE_M * COARSE_M
    along, depth = 0.0, 0.0
    while along < reach and 0 <= i < CELLS and 0 <= j < CELLS:
        end = min(next_x, next_y)
        cell = i * CELLS + j
        if pz + along * ray[2] < top[cell]:
            for k in range(start[cell], start[cell + 1]):
                depth += _weaken(point, ray, along, end, things[item[k]], shapes, coarse, found)
            if depth > 8.0:
                return 0.0
        along = end
        if next_x < next_y:
            next_x += pace_x
            i += step_i
        else:
            next_y += pace_y
            j += step_j
    return math.exp(-depth)
