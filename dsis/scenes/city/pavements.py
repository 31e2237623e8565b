"""Streets beside a block: cars, people and trees."""

import math
from collections.abc import Iterator

import numpy as np

from dsis.scenes.city import palette
from dsis.scenes.city.cars import parked
from dsis.scenes.city.palette import one_of
from dsis.scenes.city.plan import Plan
from dsis.scenes.city.solids import CLUTTERED_M, Kind, Point, Solid
from dsis.scenes.city.trees import tree

TREES_M, PLANTED_M = 9.0, 16.0  # from tree to tree; streets wider than this have trees
DRIVING = 0.2  # share of a lane that is taken


def street_sides(rng: np.random.Generator, plan: Plan, i: int, j: int) -> Iterator[Solid]:
    """Yield what stands and drives in the streets at a block's far sides in a and b."""
    if i + 1 >= plan.a_low.size or j + 1 >= plan.b_low.size:
        return
    a0, a1, b0, b1 = plan.a_low[i], plan.a_high[i], plan.b_low[j], plan.b_high[j]
    for a, b in (
        ((a0, a1), (b0 - 0.2, b0 + 2.2)), ((a0, a1), (b1 - 2.2, b1 + 0.2)),
        ((a0 - 0.2, a0 + 2.2), (b0, b1)), ((a1 - 2.2, a1 + 0.2), (b0, b1)),
    ):  # fmt: skip
        yield from people(rng, plan, a, b, 7)
    share = rng.uniform(0.5, 0.95)
    wide_a, wide_b = plan.a_low[i + 1] - a1, plan.b_low[j + 1] - b1

    def along_b(across: float) -> tuple[Point, Point]:
        return plan.world(a1 + across, b0), plan.world(a1 + across, b1)

    def along_a(across: float) -> tuple[Point, Point]:
        return plan.world(a0, b1 + across), plan.world(a1, b1 + across)

    for street, wide in ((along_b, wide_a), (along_a, wide_b)):
        for across, taken in (
            (1.1, share), (wide - 1.1, share), (0.36 * wide, DRIVING), (0.64 * wide, DRIVING),
        ):  # fmt: skip
            start, end = street(across)
            yield from parked(rng, start, end, taken)
        if wide > PLANTED_M:
            yield from _avenue(rng, *street(-0.9))
            yield from _avenue(rng, *street(wide + 0.9))


def _avenue(rng: np.random.Generator, start: Point, end: Point) -> Iterator[Solid]:
    """Yield a row of trees."""
    count = int(math.hypot(end[0] - start[0], end[1] - start[1]) / TREES_M)
    for n in range(count):
        s = (n + 0.5) / count
        place = start[0] + s * (end[0] - start[0]), start[1] + s * (end[1] - start[1])
        yield from tree(rng, *place, rng.uniform(7, 11))


def people(
    rng: np.random.Generator, plan: Plan, a: tuple[float, float], b: tuple[float, float], count: int
) -> Iterator[Solid]:
    """Yield people on a piece of the plan, where they can be made out at all."""
    for _ in range(count if math.hypot(*plan.world(a[0], b[0])) < CLUTTERED_M else 0):
        x, y = plan.world(rng.uniform(*a), rng.uniform(*b))
        head, coat = (0.25, 0.17, 0.12), one_of(rng, palette.CLOTHES)
        yield Solid(x, y, 0, rng.uniform(0, 3), 0.24, 0.16, 1.45, Kind.PLAIN, coat, coat)
        yield Solid(x, y, 1.45, 0, 0.1, 0.1, 0.27, Kind.PLAIN, head, head)
