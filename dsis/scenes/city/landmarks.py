"""What rises above the roofs: churches, slabs, towers; and bridges over the river."""

import math
from collections.abc import Iterator

import numpy as np

from dsis.scenes.city import palette
from dsis.scenes.city.palette import one_of
from dsis.scenes.city.rooftops import FlatRoof
from dsis.scenes.city.solids import Cover, Frame, Kind, Rgb, Solid

STONE: Rgb = (0.42, 0.37, 0.29)
DARK: Rgb = (0.05, 0.05, 0.055)
PAINTS: tuple[Rgb, ...] = ((0.10, 0.17, 0.14), (0.13, 0.14, 0.16), (0.28, 0.31, 0.32))  # of steel


def church(rng: np.random.Generator, frame: Frame) -> Iterator[Solid]:
    """Yield a nave with aisles and transept, a choir, and one or two towers with spires."""
    stone = one_of(rng, (STONE, (0.33, 0.18, 0.12), (0.62, 0.58, 0.50)))
    cover = Cover(int(rng.choice([Cover.TILES, Cover.SLATE, Cover.METAL])))
    roof = one_of(rng, palette.COVERS[cover])
    seed, tall = int(rng.integers(1 << 20)), rng.uniform(0.85, 1.2)

    def part(x: float, y: float, half_x: float, half_y: float, walls: float, slope: float,
             spire: float = 0.0, cover: Cover = cover, roof: Rgb = roof,
             ) -> Iterator[Solid]:  # fmt: skip
        place = frame.at(x, y)
        yield Solid(*place, 0, frame.yaw, half_x, half_y, walls * tall, Kind.HOUSE, stone, roof,
                    cover, seed=seed, storey_m=7.5, bay_m=4.2)  # fmt: skip
        yield Solid(*place, walls * tall, frame.yaw, half_x + 0.3, half_y + 0.3, 0.4, Kind.ROOF,
                    stone, roof, cover, spire, slope, math.inf, seed)  # fmt: skip

    yield from part(0, 0, 19, 6, 16, 1.3)
    yield from part(0, 0, 17, 11, 8, 0.35)
    yield from part(8, 0, 5.5, 14, 15.5, 1.3)
    yield from part(21, 0, 4, 4.5, 14, 1.3, 1.3)
    copper = one_of(rng, ((0.20, 0.38, 0.31), (0.08, 0.085, 0.10)))
    for side in (0.0,) if rng.random() < 0.5 else (-7.5, 7.5):
        yield from part(-21, side, 4, 4, 34, 4.8, 4.8, Cover.METAL, copper)
        top = (34 * tall) + 0.4 + 4.8 * 4.3
        yield Solid(*frame.at(-21, side), top - 0.4, frame.yaw, 0.09, 0.09, 2.6, Kind.PLAIN,
                    (0.8, 0.6, 0.2), (0.8, 0.6, 0.2))  # fmt: skip


def slab(
    rng: np.random.Generator, frame: Frame, width: float, deep: float, height: float
) -> Iterator[Solid]:
    """Yield a modern building with a flat roof."""
    kind = Kind.GLASS if rng.random() < 0.4 else Kind.MODERN
    wall = one_of(rng, palette.CONCRETE)
    gravel = one_of(rng, palette.GRAVEL)
    yield Solid(frame.x, frame.y, 0, frame.yaw, width / 2, deep / 2, height, kind, wall, gravel,
                seed=int(rng.integers(1 << 20)), storey_m=rng.uniform(3.0, 3.8),
                bay_m=rng.uniform(1.4, 2.2 if kind is Kind.GLASS else 4.2))  # fmt: skip
    yield from FlatRoof(frame, width, deep, height).furnished(rng, wall)
    if height > 40:
        yield Solid(frame.x, frame.y, height, frame.yaw, width / 3.2, deep / 3.2, 5.0, Kind.PLAIN,
                    wall, gravel)  # fmt: skip
        mast = rng.uniform(6, 22)
        x, y = frame.at(width / 8, 0)
        yield Solid(x, y, height + 5, frame.yaw, 0.16, 0.16, mast, Kind.PLAIN, (0.5, 0.5, 0.5))


def bridge(rng: np.random.Generator, frame: Frame, span: float) -> Iterator[Solid]:
    """Yield a bridge of stone, of concrete or of steel along local x, with parapets and lamps."""
    form, half, wide = rng.random(), span / 2 + 8, rng.uniform(5.0, 8.5)
    steel = form < 0.4
    paint = one_of(rng, PAINTS if steel else (STONE, (0.5, 0.48, 0.45), (0.30, 0.20, 0.15)))
    piers = int(rng.integers(1, 3) if form < 0.7 else rng.integers(3, 7))
    thick = rng.uniform(0.9, 1.5) if piers < 3 else rng.uniform(1.6, 2.4)
    yield Solid(frame.x, frame.y, 0.05 - thick, frame.yaw, half, wide, thick, Kind.PLAIN, paint,
                (0.11, 0.11, 0.115))  # fmt: skip
    every = rng.uniform(11, 24)
    for side in (0.2 - wide, wide - 0.2):
        yield Solid(*frame.at(0, side), 0.05, frame.yaw, half, 0.25, 1.0, Kind.PLAIN, paint, paint)
        for a in np.arange(6 - half, half, every):
            place = frame.at(float(a), side)
            yield Solid(*place, 0, frame.yaw, 0.08, 0.08, 6.0, Kind.PLAIN, DARK, DARK)
            yield Solid(*place, 6.0, frame.yaw, 0.3, 0.3, 0.6, Kind.PLAIN, (0.8, 0.8, 0.75))
        if steel:
            yield from _girder(frame, side, span, rng.uniform(5.0, 7.5), paint)
    foot = STONE if steel else paint
    for a in np.linspace(-span / 2, span / 2, piers + 2)[1:-1]:
        yield Solid(*frame.at(float(a), 0), -6, frame.yaw, rng.uniform(1.2, 2.2), wide + 1.2, 5.4,
                    Kind.PLAIN, foot, foot)  # fmt: skip


def _girder(frame: Frame, side: float, span: float, tall: float, paint: Rgb) -> Iterator[Solid]:
    """Yield posts and the chord on top of them, above one side of a bridge."""
    panels = round(span / tall)
    for a in np.linspace(-span / 2, span / 2, panels + 1):
        yield Solid(*frame.at(float(a), side), 0, frame.yaw, 0.22, 0.2, tall, Kind.PLAIN, paint)
    yield Solid(*frame.at(0, side), tall, frame.yaw, span / 2 + 0.3, 0.3, 0.6, Kind.PLAIN, paint,
                paint)  # fmt: skip
