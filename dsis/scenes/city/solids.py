"""Solids: what the city is made of. Upright boxes with roof planes, and lobes of foliage."""

import math
from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Rgb = tuple[float, float, float]
Point = tuple[float, float]
DETAILED_M, CLUTTERED_M = 1300.0, 750.0  # nearer than this: chimneys, cars; the smallest things


class Kind(IntEnum):
    """What a solid is, for its shading."""

    HOUSE = 0  # windows on the long sides
    MODERN = 1  # bands or grids of windows on all sides
    GLASS = 2  # curtain walls
    PLAIN = 3
    ROOF = 4  # of a house, wider than its walls
    DORMER = 5
    BODY = 6  # of a car
    CABIN = 7  # of a car
    CROWN = 8  # a lobe of a tree: an ellipsoid of leaves
    PANEL = 9  # glass on a roof


class Cover(IntEnum):
    """What a roof is covered with."""

    TILES = 0
    SLATE = 1
    METAL = 2
    GRAVEL = 3


class Solid(NamedTuple):
    """The points |x| <= half_x, |y| <= half_y, base <= z <= base + height + roof; metres.

    In the frame of its own centre and yaw; the roof is the least of slope_y (half_y - |y|), where
    slope_x is not zero slope_x (half_x - |x|), and rise.
    """

    x: float
    y: float
    base: float
    yaw: float  # of the local x axis from the world's, in radians
    half_x: float
    half_y: float
    height: float  # of the walls
    kind: Kind
    wall: Rgb  # diffuse reflectance
    roof: Rgb = (0.2, 0.2, 0.2)
    cover: Cover = Cover.GRAVEL
    slope_x: float = 0.0
    slope_y: float = 0.0
    rise: float = math.inf
    seed: int = 0
    storey_m: float = 3.4
    bay_m: float = 2.8  # from window to window
    blind: bool = False  # no windows on the short sides


@dataclass(frozen=True)
class Frame:
    """A place and a direction: local x along it, local y to its left."""

    x: float
    y: float
    yaw: float

    def at(self, x: float, y: float) -> Point:
        """Return the world place of a local one."""
        cos, sin = math.cos(self.yaw), math.sin(self.yaw)
        return self.x + cos * x - sin * y, self.y + sin * x + cos * y


# columns of the table that the tracer reads
X, Y, BASE, COS, SIN, HALF_X, HALF_Y, EAVES, SLOPE_X, SLOPE_Y, TOP, KIND = range(12)
WALL, ROOF, COVER, SEED, STOREY, BAY, BLIND, COLUMNS = 12, 15, 18, 19, 20, 21, 22, 23


def table(solids: list[Solid]) -> NDArray[np.float64]:
    """Return one row of numbers per solid: float64 (solid, COLUMNS)."""
    rows = np.empty((len(solids), COLUMNS))
    for row, s in zip(rows, solids, strict=True):
        eaves = s.base + s.height
        peak = s.slope_y * s.half_y
        if s.slope_x > 0:
            peak = min(peak, s.slope_x * s.half_x)
        row[:12] = (
            s.x, s.y, s.base, math.cos(s.yaw), math.sin(s.yaw), s.half_x, s.half_y,
            eaves, s.slope_x, s.slope_y, eaves + min(peak, s.rise), s.kind,
        )  # fmt: skip
        row[12:] = (*s.wall, *s.roof, s.cover, s.seed, s.storey_m, s.bay_m, s.blind)
    return rows
