"""Trees: a trunk and several lobes of leaves."""

import math
from collections.abc import Iterator

import numpy as np

from dsis.scenes.city import palette
from dsis.scenes.city.palette import one_of
from dsis.scenes.city.solids import Kind, Rgb, Solid

LOBED_M = 1100.0  # farther than this a crown is a single lobe


def tree(rng: np.random.Generator, x: float, y: float, height: float) -> Iterator[Solid]:
    """Yield a broad-leaved tree of a height in metres."""
    colour = one_of(rng, palette.LEAVES)
    radius = height * rng.uniform(0.27, 0.38)
    yield Solid(x, y, 0, 0.3, 0.018 * height, 0.018 * height, 0.55 * height, Kind.PLAIN,
                (0.09, 0.07, 0.05), (0.05, 0.07, 0.03))  # fmt: skip
    if math.hypot(x, y) > LOBED_M:
        yield _lobe(rng, x, y, 0.60 * height, radius, 0.38 * height, colour)
        return
    count = int(rng.integers(7, 12))
    for n in range(count):
        level = (n + rng.random()) / count  # from the bottom of the crown to its top
        room = radius * math.sqrt(max(1 - (1.7 * level - 0.8) ** 2, 0.1))
        size = radius * rng.uniform(0.38, 0.62) * (1.1 - 0.3 * level)
        turn, out = (
            2.4 * n + rng.uniform(-0.7, 0.7),
            max(room - 0.6 * size, 0) * rng.uniform(0.6, 1),
        )
        place = x + out * math.cos(turn), y + out * math.sin(turn)
        yield _lobe(rng, *place, height * (0.36 + 0.52 * level), size, 0.75 * size, colour)


def _lobe(
    rng: np.random.Generator, x: float, y: float, z: float, wide: float, half: float, colour: Rgb
) -> Solid:
    return Solid(x, y, z - half, 0.0, wide, wide, 2 * half, Kind.CROWN, colour,
                 seed=int(rng.integers(1 << 20)))  # fmt: skip
