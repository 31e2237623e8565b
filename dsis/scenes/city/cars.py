"""Cars, parked and driving."""

import math
from collections.abc import Iterator

import numpy as np

from dsis.scenes.city import palette
from dsis.scenes.city.palette import one_of
from dsis.scenes.city.solids import Kind, Point, Solid


def car(rng: np.random.Generator, x: float, y: float, yaw: float) -> Iterator[Solid]:
    """Yield a car, or now and then a van or a bus, that points along `yaw`."""
    colour, form = one_of(rng, palette.LACQUER), rng.random()
    if form < 0.03:
        livery = one_of(rng, ((0.55, 0.05, 0.04), (0.65, 0.6, 0.5), (0.1, 0.25, 0.5)))
        yield Solid(x, y, 0.35, yaw, 6.0, 1.25, 2.7, Kind.MODERN, livery, (0.6, 0.6, 0.6),
                    storey_m=2.2, bay_m=1.6, seed=int(rng.integers(1 << 20)))  # fmt: skip
        return
    half = rng.uniform(1.95, 2.4)
    yield Solid(x, y, 0.28, yaw, half, 0.88, 0.62, Kind.BODY, colour, colour)
    back = rng.uniform(0.1, 0.35)
    cos, sin = math.cos(yaw), math.sin(yaw)
    long, rise = (half - 0.25, 1.1) if form < 0.15 else (half - 0.62, 0.56)
    yield Solid(x - cos * back, y - sin * back, 0.9, yaw, long, 0.82, 0.02, Kind.CABIN,
                (0.03, 0.035, 0.04), colour, slope_x=rng.uniform(0.75, 1.1), slope_y=2.6,
                rise=rise)  # fmt: skip


def parked(rng: np.random.Generator, start: Point, end: Point, share: float) -> Iterator[Solid]:
    """Yield cars along the line from `start` to `end`; `share` of the places are taken."""
    length = math.hypot(end[0] - start[0], end[1] - start[1])
    yaw = math.atan2(end[1] - start[1], end[0] - start[0])
    for n in range(int(length / 5.6)):
        if rng.random() < share:
            at = (n + 0.5) * 5.6 + rng.uniform(-0.4, 0.4)
            x, y = start[0] + math.cos(yaw) * at, start[1] + math.sin(yaw) * at
            yield from car(rng, x, y, yaw + rng.uniform(-0.03, 0.03))
