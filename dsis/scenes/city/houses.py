"""Old houses wall to wall around a court: walls, roofs, and what stands on them."""

import math
from collections.abc import Iterator

import numpy as np

from dsis.scenes.city import palette
from dsis.scenes.city.palette import STEEL, one_of
from dsis.scenes.city.rooftops import FlatRoof
from dsis.scenes.city.solids import CLUTTERED_M, DETAILED_M, Cover, Frame, Kind, Point, Rgb, Solid


def terrace(rng: np.random.Generator, start: Point, end: Point, eaves: float) -> Iterator[Solid]:
    """Yield houses side by side from `start` to `end`, their backs to the left of that way."""
    length = math.hypot(end[0] - start[0], end[1] - start[1])
    way = math.atan2(end[1] - start[1], end[0] - start[0])
    at = 0.0
    while length - at > 8:
        width = min(rng.uniform(10, 23), length - at)
        if length - at - width < 9:
            width = length - at
        deep = rng.uniform(10.5, 13.5)
        middle = Frame(*start, way).at(at + width / 2, deep / 2)
        yield from house(rng, Frame(*middle, way), width, deep, eaves + rng.uniform(-3.2, 3.2))
        at += width


def house(
    rng: np.random.Generator, frame: Frame, width: float, deep: float, eaves: float
) -> Iterator[Solid]:
    """Yield a house that faces local -y, and its roof."""
    distance = math.hypot(frame.x, frame.y)
    wall, seed = one_of(rng, palette.PLASTER), int(rng.integers(1 << 20))
    storey, bay = rng.uniform(3.1, 3.9), rng.uniform(2.2, 3.7)
    shape = rng.choice(4, p=[0.56, 0.17, 0.10, 0.17])  # gable, mansard, hip, flat
    cover = Cover(int(rng.choice(3, p=[0.70, 0.18, 0.12])))
    if shape == 1:
        cover = Cover.METAL if rng.random() < 0.6 else Cover.SLATE
    roof = one_of(rng, palette.COVERS[Cover.GRAVEL if shape == 3 else cover])
    x, y, yaw, half_x, half_y = frame.x, frame.y, frame.yaw, width / 2, deep / 2
    yield Solid(x, y, 0, yaw, half_x, half_y, eaves, Kind.HOUSE, wall, roof, seed=seed,
                storey_m=storey, bay_m=bay, blind=rng.random() < 0.7)  # fmt: skip
    slope = rng.uniform(0.62, 1.0)
    if shape == 3:
        if distance < DETAILED_M:
            yield from FlatRoof(frame, width, deep, eaves).furnished(rng, wall)
        return
    hang = rng.uniform(0.3, 0.6)
    if shape == 1:
        slope, rise = rng.uniform(1.7, 2.6), rng.uniform(3.0, 4.4)
        yield Solid(x, y, eaves, yaw, half_x, half_y + 0.3, 0.25, Kind.ROOF, wall, roof, cover, 0,
                    slope, rise, seed)  # fmt: skip
        ridge, peak = eaves + 0.25 + rise, rise
    else:
        hip = slope if shape == 2 else 0.0
        yield Solid(x, y, eaves, yaw, half_x + (hang if hip else 0), half_y + hang, 0.22, Kind.ROOF,
                    wall, roof, cover, hip, slope, math.inf, seed)  # fmt: skip
        peak = slope * (half_y + hang)
        ridge = eaves + 0.22 + peak
    if distance < DETAILED_M:
        yield from _chimneys(rng, frame, width, ridge, wall)
        if shape < 2:
            yield from _dormers(rng, frame, width, half_y + hang, eaves, slope, peak, wall, roof)


def _chimneys(
    rng: np.random.Generator, frame: Frame, width: float, ridge: float, wall: Rgb
) -> Iterator[Solid]:
    """Yield stacks along the party walls, with pots, and aerials."""
    near = math.hypot(frame.x, frame.y) < CLUTTERED_M
    brick = one_of(rng, ((0.30, 0.14, 0.09), (0.38, 0.24, 0.17), wall))
    for _ in range(int(rng.integers(1, 5))):
        a = rng.uniform(-width / 2 + 0.6, width / 2 - 0.6)
        b = rng.uniform(-2.6, 2.6)
        x, y = frame.at(a, b)
        foot, top = ridge - 3.2, ridge + rng.uniform(0.3, 1.5)
        half_x, half_y = rng.uniform(0.3, 0.5), rng.uniform(0.4, 1.3)
        yield Solid(x, y, foot, frame.yaw, half_x, half_y, top - foot, Kind.PLAIN, brick,
                    (0.06, 0.05, 0.05))  # fmt: skip
        if near:
            for pot in np.arange(-half_y + 0.25, half_y - 0.1, 0.45):
                place = frame.at(a, b + pot)
                yield Solid(*place, top, frame.yaw, 0.13, 0.13, 0.55, Kind.PLAIN,
                            (0.40, 0.18, 0.10), (0.03, 0.03, 0.03))  # fmt: skip
    for _ in range(int(rng.integers(0, 3)) if near else 0):  # cowls
        x, y = frame.at(rng.uniform(-width / 2.4, width / 2.4), rng.uniform(-1.5, 1.5))
        yield Solid(x, y, ridge - 0.9, frame.yaw, 0.22, 0.22, 1.3, Kind.BODY, STEEL, STEEL,
                    Cover.METAL)  # fmt: skip
    if near and rng.random() < 0.5:
        x, y = frame.at(rng.uniform(-width / 3, width / 3), 0)
        yield Solid(x, y, ridge - 0.5, frame.yaw, 0.05, 0.05, 3.2, Kind.PLAIN, (0.3, 0.3, 0.3))
        for up in (1.9, 2.4):
            yield Solid(x, y, ridge + up, frame.yaw, 0.04, 0.7, 0.07, Kind.PLAIN, (0.3, 0.3, 0.3))


def _dormers(
    rng: np.random.Generator, frame: Frame, width: float, run: float, eaves: float, slope: float,
    peak: float, wall: Rgb, roof: Rgb,
) -> Iterator[Solid]:  # fmt: skip
    """Yield dormers on both slopes of a roof that is steep or wide enough for them."""
    if rng.random() < 0.45 or width < 9 or peak < 2.8:
        return
    count = int(width / rng.uniform(3.2, 5.5))
    half, high = rng.uniform(0.6, 0.95), rng.uniform(1.5, 1.9)
    back = (0.5 + high) / slope + 0.4  # from the dormer's front to where its roof meets the slope
    for side in (-1, 1):
        turn = frame.yaw if side < 0 else frame.yaw + math.pi
        for n in range(count):
            a = (n + 0.5 - count / 2) * width / count
            x, y = frame.at(a, side * (run - 0.5 / slope - back / 2))
            yield Solid(x, y, eaves + 0.35, turn, half, back / 2, high, Kind.DORMER, wall, roof,
                        Cover.SLATE, 0.8, 0.0, math.inf, int(rng.integers(1 << 20)))  # fmt: skip
