"""Flat roofs: parapet, lift housing, machines, plants, sunshades, panels."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from dsis.scenes.city import palette
from dsis.scenes.city.palette import STEEL, one_of
from dsis.scenes.city.solids import CLUTTERED_M, Cover, Frame, Kind, Rgb, Solid

PANEL: Rgb = (0.02, 0.025, 0.05)


@dataclass(frozen=True)
class FlatRoof:
    """A flat roof of width x depth at a height; metres."""

    frame: Frame
    width: float
    depth: float
    height: float

    def box(
        self, rng: np.random.Generator, size: tuple[float, float, float], colour: Rgb,
        kind: Kind = Kind.PLAIN, up: float = 0.0,
    ) -> Solid:  # fmt: skip
        """Return a box of half_x, half_y and height somewhere on the roof."""
        half_x, half_y, tall = size
        x = rng.uniform(-1, 1) * max(self.width / 2 - half_x - 0.8, 0)
        y = rng.uniform(-1, 1) * max(self.depth / 2 - half_y - 0.8, 0)
        cover = Cover.METAL if kind is Kind.BODY else Cover.GRAVEL
        tilt = 0.5 if kind is Kind.PANEL else 0.0
        return Solid(*self.frame.at(x, y), self.height + up, self.frame.yaw, half_x, half_y, tall,
                     kind, colour, colour, cover, slope_y=tilt)  # fmt: skip

    def furnished(self, rng: np.random.Generator, wall: Rgb) -> Iterator[Solid]:
        """Yield all that stands on the roof; little of it where it is far away."""
        yield from self._parapet(wall)
        size = rng.uniform(1.5, 2.6), rng.uniform(1.3, 2.2), rng.uniform(2.4, 3.4)
        yield self.box(rng, size, wall)
        near = math.hypot(self.frame.x, self.frame.y) < CLUTTERED_M
        for _ in range(int(rng.integers(2, 7)) if near else 1):
            side, kind = rng.uniform(0.4, 1.1), Kind.BODY if rng.random() < 0.3 else Kind.PLAIN
            size = side, side * rng.uniform(0.5, 1), rng.uniform(0.6, 1.5)
            yield self.box(rng, size, STEEL, kind)
        if near:
            yield from self._amenities(rng)

    def _parapet(self, wall: Rgb) -> Iterator[Solid]:
        x, y = self.width / 2 - 0.15, self.depth / 2 - 0.15
        for at, half_x, half_y in (
            ((0, -y), x, 0.15), ((0, y), x, 0.15), ((-x, 0), 0.15, y), ((x, 0), 0.15, y),
        ):  # fmt: skip
            yield Solid(*self.frame.at(*at), self.height, self.frame.yaw, half_x, half_y, 0.8,
                        Kind.PLAIN, wall, wall)  # fmt: skip

    def _amenities(self, rng: np.random.Generator) -> Iterator[Solid]:
        plants, shades, panels = (
            int(rng.integers(low, high)) if rng.random() < share else 0
            for low, high, share in ((3, 9, 0.4), (1, 4, 0.3), (2, 6, 0.4))
        )
        for _ in range(plants):
            size = rng.uniform(0.4, 0.8)
            yield self.box(rng, (size, size, 1.8 * size), one_of(rng, palette.LEAVES), Kind.CROWN)
        colour = one_of(rng, palette.CANVAS)
        for _ in range(shades):
            yield self.box(rng, (1.3, 1.3, 0.12), colour, up=2.1)
        for _ in range(panels):
            yield self.box(rng, (0.9, 0.5, 0.25), PANEL, Kind.PANEL)
