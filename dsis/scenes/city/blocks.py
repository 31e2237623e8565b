"""What stands on one block of the plan, and on the pavements around it."""

import math
from collections.abc import Iterator

import numpy as np

from dsis.scenes.city import palette
from dsis.scenes.city.cars import car, parked
from dsis.scenes.city.houses import house, terrace
from dsis.scenes.city.landmarks import bridge, church, slab
from dsis.scenes.city.palette import one_of
from dsis.scenes.city.pavements import people, street_sides
from dsis.scenes.city.plan import Ground, Plan, is_bridged
from dsis.scenes.city.solids import DETAILED_M, Frame, Kind, Point, Solid
from dsis.scenes.city.trees import tree

PAVEMENT_M = 2.6


def block(plan: Plan, i: int, j: int) -> Iterator[Solid]:
    """Yield the solids of block (i, j); they depend on the plan's seed and the block alone."""
    rng = np.random.Generator(np.random.PCG64([plan.seed, 1, i, j]))
    ground = Ground(int(plan.grounds[i, j]))
    corners = _corners(plan, i, j, PAVEMENT_M)
    middle = sum(x for x, _ in corners) / 4, sum(y for _, y in corners) / 4
    distance = math.hypot(*middle)
    if ground is Ground.RIVER:
        yield from _river(rng, plan, i, j)
        return
    if distance < DETAILED_M:
        yield from street_sides(rng, plan, i, j)
    if ground is Ground.HOUSES:
        yield from _perimeter(rng, corners, middle)
    elif ground is Ground.MODERN:
        yield from _modern(rng, corners, middle)
    else:
        way = math.atan2(corners[1][1] - corners[0][1], corners[1][0] - corners[0][0])
        if ground is Ground.CHURCH:
            yield from church(rng, Frame(*middle, way + rng.choice([0, math.pi])))
        yield from _green(rng, plan, i, j, ground)


def _corners(plan: Plan, i: int, j: int, inset: float) -> list[Point]:
    a0, a1 = plan.a_low[i] + inset, plan.a_high[i] - inset
    b0, b1 = plan.b_low[j] + inset, plan.b_high[j] - inset
    return [plan.world(a0, b0), plan.world(a1, b0), plan.world(a1, b1), plan.world(a0, b1)]


def _perimeter(rng: np.random.Generator, corners: list[Point], middle: Point) -> Iterator[Solid]:
    """Yield houses around a court, perhaps a wing across it, and trees in it."""
    eaves = rng.uniform(13.5, 20)
    for side in range(4):
        yield from terrace(rng, corners[side], corners[(side + 1) % 4], eaves)
    size = math.hypot(corners[1][0] - corners[0][0], corners[1][1] - corners[0][1])
    way = math.atan2(corners[1][1] - corners[0][1], corners[1][0] - corners[0][0])
    if rng.random() < 0.6:
        turn = way + rng.choice([0, 0.5]) * math.pi
        yield from house(rng, Frame(*middle, turn), 0.45 * size, 9, rng.uniform(4, eaves - 2))
    for _ in range(int(rng.integers(0, 5)) if math.hypot(*middle) < DETAILED_M else 0):
        spot = Frame(*middle, way).at(*rng.uniform(-14, 14, 2))
        yield from tree(rng, *spot, rng.uniform(7, 15))


def _modern(rng: np.random.Generator, corners: list[Point], middle: Point) -> Iterator[Solid]:
    """Yield slabs, and far from the eye towers."""
    way = math.atan2(corners[1][1] - corners[0][1], corners[1][0] - corners[0][0])
    wide = math.hypot(corners[1][0] - corners[0][0], corners[1][1] - corners[0][1])
    deep = math.hypot(corners[3][0] - corners[0][0], corners[3][1] - corners[0][1])
    distance = math.hypot(*middle)
    frame = Frame(*middle, way)
    if distance > 700 and rng.random() < 0.35:
        side = rng.uniform(20, 30)
        yield from slab(rng, frame, side, side * rng.uniform(0.6, 1), rng.uniform(42, 95))
        yield from slab(rng, frame, 0.9 * wide, 0.9 * deep, rng.uniform(6, 11))
        return
    for side in (-1, 1):
        long = rng.uniform(0.7, 0.95) * wide
        thick = rng.uniform(13, 18)
        at = frame.at(rng.uniform(-1, 1) * (wide - long) / 2, side * (deep - thick) / 2)
        yield from slab(rng, Frame(*at, way), long, thick, rng.uniform(14, 27))
    if deep > 62:
        yield from slab(rng, frame, rng.uniform(14, 30), 16, rng.uniform(4, 9))


def _green(rng: np.random.Generator, plan: Plan, i: int, j: int, ground: Ground) -> Iterator[Solid]:
    """Yield the trees, kiosks and statues of parks, squares and churchyards."""
    a0, a1, b0, b1 = plan.a_low[i], plan.a_high[i], plan.b_low[j], plan.b_high[j]
    if ground is Ground.PARK:
        for _ in range(int((a1 - a0) * (b1 - b0) / 110)):
            a, b = rng.uniform(a0 + 4, a1 - 4), rng.uniform(b0 + 4, b1 - 4)
            if abs((a - a0) / (a1 - a0) - (b - b0) / (b1 - b0)) > 0.05:  # the path across
                yield from tree(rng, *plan.world(a, b), rng.uniform(9, 19))
        return
    inset = 6.0
    for n in range(int(((a1 - a0) + (b1 - b0)) / 5.5)):
        along = (n + 0.5) * 5.5
        if along < b1 - b0:
            edge = rng.choice([a0 + inset, a1 - inset])
            yield from tree(rng, *plan.world(edge, b0 + along), rng.uniform(8, 12))
    if ground is Ground.SQUARE:
        a, b = (a0 + a1) / 2, (b0 + b1) / 2
        x, y = plan.world(a, b)
        stone, bronze = (0.5, 0.47, 0.42), (0.16, 0.27, 0.22)
        yield Solid(x, y, 0, 0.4, 3, 3, 1.0, Kind.PLAIN, stone, stone)
        yield Solid(x, y, 1, 0.4, 1.4, 1.4, 4.5, Kind.PLAIN, stone, stone)
        yield Solid(x, y, 5.5, 0.4, 0.9, 0.5, 3.2, Kind.PLAIN, bronze, bronze, slope_y=1.0)
        yield from people(rng, plan, (a0 + 4, a1 - 4), (b0 + 4, b1 - 4), 90)
        for _ in range(14):
            x, y = plan.world(rng.uniform(a0 + 12, a1 - 12), rng.uniform(b0 + 12, b1 - 12))
            cloth = one_of(rng, palette.CANVAS)
            yield Solid(x, y, 2.2, rng.uniform(0, 3), 1.7, 1.7, 0.1, Kind.PLAIN, cloth, cloth,
                        slope_x=0.35, slope_y=0.35)  # fmt: skip
            yield Solid(x, y, 0, 0, 0.05, 0.05, 2.2, Kind.PLAIN, stone)


def _river(rng: np.random.Generator, plan: Plan, i: int, j: int) -> Iterator[Solid]:
    """Yield a stretch of quay walls with their trees, a bridge, and boats."""
    b0, b1 = plan.b_low[j], plan.b_high[j]
    for a, side in ((plan.a_low[i], -1), (plan.a_high[i], 1)):
        (x0, y0), (x1, y1) = plan.world(a, b0), plan.world(a, b1)
        way, long = math.atan2(y1 - y0, x1 - x0), math.hypot(x1 - x0, y1 - y0)
        yield Solid((x0 + x1) / 2, (y0 + y1) / 2, 0, way, long / 2, 0.25, 1.0, Kind.PLAIN,
                    (0.45, 0.42, 0.36), (0.5, 0.47, 0.4))  # fmt: skip
        for b in np.arange(b0 + 3, b1 - 2, 8.5):
            if rng.random() < 0.85:
                yield from tree(rng, *plan.world(a + side * 2.6, float(b)), rng.uniform(7, 12))
    kerb = plan.a_high[i] + 5.5
    if math.hypot(*plan.world(kerb, b0)) < DETAILED_M:
        yield from parked(rng, plan.world(kerb, b0), plan.world(kerb, b1), 0.6)
        yield from parked(rng, plan.world(kerb + 5, b1), plan.world(kerb + 5, b0), 0.2)
        yield from people(rng, plan, (kerb - 4.5, kerb - 2), (b0, b1), 8)
    middle = (plan.a_low[i] + plan.a_high[i]) / 2
    if is_bridged(plan.seed, j) and j + 1 < plan.b_low.size:
        b = (b1 + plan.b_low[j + 1]) / 2
        (x0, y0), (x1, y1) = plan.world(plan.a_low[i], b), plan.world(plan.a_high[i], b)
        frame = Frame((x0 + x1) / 2, (y0 + y1) / 2, math.atan2(y1 - y0, x1 - x0))
        yield from bridge(rng, frame, math.hypot(x1 - x0, y1 - y0))
        for _ in range(9):
            a, lane = rng.uniform(-48, 48), rng.choice([-3.4, 3.4])
            yield from car(rng, *frame.at(a, lane), frame.yaw + (math.pi if lane > 0 else 0))
    elif rng.random() < 0.4:
        a, b = middle + rng.uniform(-30, 30), rng.uniform(b0, b1)
        x, y = plan.world(a, b)
        x1, y1 = plan.world(a, b + 5)
        way = math.atan2(y1 - y, x1 - x)
        yield Solid(x, y, -4.0, way, 15, 2.6, 1.6, Kind.PLAIN, (0.12, 0.13, 0.15), (0.5, 0.45, 0.4))
        yield Solid(x, y, -2.4, way, 11, 2.1, 1.8, Kind.MODERN, (0.7, 0.7, 0.7), (0.75, 0.75, 0.75),
                    storey_m=1.8, bay_m=1.5)  # fmt: skip
