"""One block of the city's street grid: houses around a court, a tower, a church or a park."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from dsis.scenes.building import Building
from dsis.scenes.surfaces import STREET_M
from dsis.scenes.tree import Tree

BLOCK_M, ROW_M = 98.0, 82.0  # pitch of the street grid, along its axes a and b
GRID_RAD = -0.3  # one street runs straight away from the eye, at this azimuth to the right
HOUSES_M = 800.0  # beyond, houses stand in rows
MOSTLY_GABLES = ("gable", "gable", "gable", "flat")
Thing = Building | Tree
HALF_A, HALF_B = (BLOCK_M - STREET_M) / 2, (ROW_M - STREET_M) / 2


@dataclass(frozen=True)
class Block:
    """A block centred at (a, b) of the street grid; `rng` decides what stands on it."""

    rng: np.random.Generator
    a: float
    b: float

    def things(self, distance: float) -> Iterator[Thing]:
        """Yield what stands on the block, in more or less detail."""
        kind = self.rng.random()
        if kind < 0.09:
            for _ in range(24 if distance < HOUSES_M else 8):
                yield self._tree(self._within(HALF_A), self._within(HALF_B), 9, 19)
        elif kind < 0.19 and distance > 450:
            wall = str(self.rng.choice(["glass", "house"]))
            yield self._building(0, 5, self._between(18, 34), 24, (38, 105), ("flat",), wall)
            yield self._building(0, -24, 70, 14, (9, 16), ("flat",), "glass")
        elif kind < 0.24 and distance > 350:
            yield self._building(8, 0, 42, 18, (17, 18), ("gable",))
            yield self._building(-18, 0, 9, 9, (34, 42), ("spire",))
        elif distance > HOUSES_M:  # rows of houses, in one piece
            for db in (7 - HALF_B, HALF_B - 7):
                for da in (-HALF_A / 2, HALF_A / 2):
                    yield self._building(da, db, HALF_A, 13, (12, 23), ("gable", "flat"))
        else:
            yield from self._perimeter()
        if distance < HOUSES_M:
            yield from self._street()

    def _perimeter(self) -> Iterator[Thing]:
        """Yield houses around a court with trees."""
        for db in (6 - HALF_B, HALF_B - 6):
            da = -HALF_A
            while da < HALF_A - 8:
                wide = min(self._between(11, 21), HALF_A - da)
                yield self._building(da + wide / 2, db, wide, 12, (11.5, 20), MOSTLY_GABLES)
                da += wide
        for da in (6 - HALF_A, HALF_A - 6):
            for db in (3 - HALF_B / 2, HALF_B / 2 - 3):
                long, tall = HALF_B - 6, (11.5, 19)
                yield self._building(da, db, long, 12, tall, ("gable", "flat"), quarter=True)
        for _ in range(4):
            yield self._tree(self._within(HALF_A - 16), self._within(8), 9, 17)

    def _street(self) -> Iterator[Thing]:
        """Yield trees and cars of the street along the block."""
        for db in np.arange(-HALF_B, HALF_B, 9.0).tolist():
            if self.rng.random() < 0.6:
                yield self._tree(-HALF_A - 3.5, db, 6, 10)
            if self.rng.random() < 0.5:
                lane = -HALF_A - STREET_M / 2 + float(self.rng.choice([-5.6, -2.2, 2.2, 5.6]))
                x, y = self._place(lane, db)
                style = self.rng.random()
                yield Building(x, y, GRID_RAD, 1.8, 4.4, 0.3, 0.95, "flat", "car", style)
                yield Building(x, y, GRID_RAD, 1.5, 2.2, 0.9, 1.5, "flat", "cabin", style)

    def _building(
        self,
        da: float,
        db: float,
        wide: float,
        deep: float,
        tall: tuple[float, float],
        roofs: tuple[str, ...],
        kind: str = "house",
        *,
        quarter: bool = False,
    ) -> Building:
        x, y = self._place(da, db)
        yaw = GRID_RAD + (math.pi / 2 if quarter else 0)
        roof = roofs[int(self.rng.integers(len(roofs)))]
        eaves = self._between(*tall)
        return Building(x, y, yaw, wide, deep, 0.0, eaves, roof, kind, self.rng.random())

    def _tree(self, da: float, db: float, low: float, high: float) -> Tree:
        x, y = self._place(da, db)
        return Tree(x, y, 0.0, self._between(low, high), self.rng.random())

    def _place(self, da: float, db: float) -> tuple[float, float]:
        """Return world (x, y) of a point relative to the block's centre."""
        a, b, c, s = self.a + da, self.b + db, math.cos(GRID_RAD), math.sin(GRID_RAD)
        return c * a - s * b, s * a + c * b

    def _between(self, low: float, high: float) -> float:
        return float(self.rng.uniform(low, high))

    def _within(self, half: float) -> float:
        return self._between(-half, half)
