"""The plain outside the lattice of streets: scattered houses and groves."""

import math
from collections.abc import Iterator

import numpy as np

from dsis.scenes.city import palette
from dsis.scenes.city.palette import one_of
from dsis.scenes.city.solids import Kind, Solid

THINGS = 800  # in a sector


def suburb(seed: int, sector: int, first_rad: float, last_rad: float) -> Iterator[Solid]:
    """Yield the houses and groves of one sector of the plain outside the lattice."""
    rng = np.random.Generator(np.random.PCG64([seed, 2, sector]))
    for _ in range(THINGS):
        azimuth, distance = rng.uniform(first_rad, last_rad), math.sqrt(rng.uniform(6.8, 60)) * 1000
        x, y = distance * math.sin(azimuth), distance * math.cos(azimuth)
        form, yaw = rng.random(), rng.uniform(0, 3)
        if form < 0.45:
            wall, roof = one_of(rng, palette.PLASTER), one_of(rng, palette.TILES)
            yield Solid(x, y, 0, yaw, rng.uniform(6, 16), 5, rng.uniform(5, 9), Kind.ROOF, wall,
                        roof, slope_y=0.8)  # fmt: skip
        elif form < 0.55:
            wall = one_of(rng, palette.CONCRETE)
            yield Solid(x, y, 0, yaw, rng.uniform(10, 40), 8, rng.uniform(6, 36), Kind.MODERN, wall,
                        one_of(rng, palette.GRAVEL))  # fmt: skip
        else:
            size = rng.uniform(6, 14)
            yield Solid(x, y, 0, 0, size, size, 1.1 * size, Kind.CROWN, one_of(rng, palette.LEAVES),
                        seed=int(rng.integers(1 << 20)))  # fmt: skip
