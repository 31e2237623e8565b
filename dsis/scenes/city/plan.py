"""The plan of the city: which ground is street, river, square, park or a block of houses.

Streets follow the lines of a lattice with uneven spacing that bends slowly, so that streets curve
and no two quarters are parallel. Plan coordinates (a, b) are metres along the lattice's axes.
"""

import math
from enum import IntEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

REACH_M = 2700.0  # streets and blocks lie within this distance of the eye
GRID_RAD = 0.13  # turn of the lattice, so that the river and its quays run away from the eye
RIVER_A_M = (70.0, 172.0)  # the river's banks


class Ground(IntEnum):
    """What a block of the plan is."""

    HOUSES = 0
    MODERN = 1
    PARK = 2
    SQUARE = 3
    CHURCH = 4
    RIVER = 5


class Plan(NamedTuple):
    """A lattice of blocks, for scene building and for the tracer.

    Attributes
    ----------
    a_low, a_high, b_low, b_high
        Kerbs of the blocks in plan coordinates, metres: block (i, j) is
        a_low[i]..a_high[i] by b_low[j]..b_high[j], between them are the streets.
    grounds
        `Ground` of each block: int64 (i, j).
    bends
        Phases of the lattice's bends, radians: float64 (3,).
    seed
        Of the city, for textures of the ground.
    """

    a_low: NDArray[np.float64]
    a_high: NDArray[np.float64]
    b_low: NDArray[np.float64]
    b_high: NDArray[np.float64]
    grounds: NDArray[np.int64]
    bends: NDArray[np.float64]
    seed: int

    def world(self, a: float, b: float) -> tuple[float, float]:
        """Return the place x, y of a point of the plan (the tracer holds the inverse)."""
        u, v = a, b
        for _ in range(8):  # the bends are gentle: the error shrinks tenfold each time
            u = a - 40 * math.sin(v / 430 + self.bends[0]) - 9 * math.sin(v / 150 + self.bends[1])
            v = b - 30 * math.sin(u / 390 + self.bends[2])
        cos, sin = math.cos(GRID_RAD), math.sin(GRID_RAD)
        return cos * u - sin * v, sin * u + cos * v


def is_bridged(seed: int, street: int) -> bool:
    """Tell whether a street crosses the river: a fifth of them do, three apart or more.

    It is the street behind the blocks of that number along the river.
    """
    around = range(street - 2, street + 3)
    lots = [np.random.Generator(np.random.PCG64([seed, 4, n + 2])).random() for n in around]
    return lots[2] == min(lots)


def street_plan(seed: int) -> Plan:
    """Lay out streets and choose what stands on each block."""
    rng = np.random.Generator(np.random.PCG64([seed, 0]))
    left = _lots(rng, REACH_M - 10)
    right = _lots(rng, REACH_M)
    quay = 15.0
    a_low = np.array([*(RIVER_A_M[0] - quay - high for _, high in left[::-1]), RIVER_A_M[0],
                      *(RIVER_A_M[1] + quay + low for low, _ in right)])  # fmt: skip
    a_high = np.array([*(RIVER_A_M[0] - quay - low for low, _ in left[::-1]), RIVER_A_M[1],
                       *(RIVER_A_M[1] + quay + high for _, high in right)])  # fmt: skip
    along = _lots(rng, 2 * REACH_M)
    b_low, b_high = (np.array([lot[side] for lot in along]) - REACH_M for side in (0, 1))
    bends = rng.uniform(0, 2 * math.pi, 3)
    bends[0] = -math.pi / 2 + rng.uniform(-0.3, 0.3)  # the river comes into view from the right
    shape = a_low.size, b_low.size
    chances = [0.70, 0.13, 0.10, 0.03, 0.04]
    grounds = rng.choice(5, shape, p=chances).astype(np.int64)
    grounds[len(left)] = Ground.RIVER
    plan = Plan(a_low, a_high, b_low, b_high, grounds, bends, seed)
    for ground, azimuth, distance in (
        (Ground.SQUARE, -0.22, 400), (Ground.CHURCH, -0.13, 560), (Ground.PARK, 0.36, 430),
        (Ground.CHURCH, 0.30, 900), (Ground.SQUARE, 0.05, 800), (Ground.HOUSES, 0.0, 300),
        (Ground.HOUSES, -0.35, 330), (Ground.HOUSES, 0.5, 330), (Ground.HOUSES, -0.1, 330),
    ):  # fmt: skip
        place = distance * math.sin(azimuth), distance * math.cos(azimuth)
        i, j = _block_at(plan, *place)
        if grounds[i, j] != Ground.RIVER:
            grounds[i, j] = ground
    return plan


def _lots(rng: np.random.Generator, length: float) -> list[tuple[float, float]]:
    """Return (kerb, kerb) of successive blocks with streets between them, from 0 to `length`."""
    lots = []
    at = 0.0
    while at < length:
        depth = rng.uniform(58, 100)
        lots.append((at, at + depth))
        at += depth + rng.choice([11.0, 14.0, 17.0, 26.0], p=[0.3, 0.35, 0.25, 0.1])
    return lots


def _block_at(plan: Plan, x: float, y: float) -> tuple[int, int]:
    """Return the block whose middle is nearest to a place."""
    cos, sin = math.cos(GRID_RAD), math.sin(GRID_RAD)
    u, v = cos * x + sin * y, -sin * x + cos * y
    b = v + 30 * math.sin(u / 390 + plan.bends[2])
    a = u + 40 * math.sin(v / 430 + plan.bends[0]) + 9 * math.sin(v / 150 + plan.bends[1])
    i = int(np.abs((plan.a_low + plan.a_high) / 2 - a).argmin())
    j = int(np.abs((plan.b_low + plan.b_high) / 2 - b).argmin())
    return i, j
