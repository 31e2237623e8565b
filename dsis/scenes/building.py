"""Buildings: a box with a roof; its walls, windows, tiles and what stands on the roof."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from dsis.scenes import sky
from dsis.scenes.texture import Field, Texture, pulse, step
from dsis.scenes.view import Point, Shade, View

STREET_M = 17.0
DETAILED_M = 620.0  # nearer than this, roofs carry chimneys and dormers
SUN = sky.sun_direction(-1.9, 0.52)
PLASTER = np.array(
    [
        [0.72, 0.66, 0.52], [0.80, 0.77, 0.70], [0.62, 0.44, 0.26], [0.55, 0.50, 0.45],
        [0.70, 0.58, 0.38], [0.34, 0.15, 0.10], [0.66, 0.52, 0.44], [0.48, 0.55, 0.50],
        [0.86, 0.85, 0.82], [0.42, 0.40, 0.39],
    ],
    np.float32,
)  # fmt: skip
TILES = np.array(
    [
        [0.42, 0.16, 0.08], [0.30, 0.11, 0.07], [0.13, 0.13, 0.15], [0.24, 0.13, 0.09],
        [0.36, 0.19, 0.11], [0.17, 0.16, 0.16],
    ],
    np.float32,
)  # fmt: skip
PAINT = np.array(
    [[0.6, 0.6, 0.6], [0.02, 0.02, 0.025], [0.3, 0.03, 0.03], [0.05, 0.09, 0.25], [0.2, 0.2, 0.2]],
    np.float32,
)
GLASS = np.array(
    [
        [0.005, 0.006, 0.007], [0.003, 0.003, 0.004], [0.10, 0.13, 0.17], [0.02, 0.03, 0.04],
        [0.24, 0.30, 0.38], [0.05, 0.06, 0.07], [0.40, 0.37, 0.31], [0.006, 0.006, 0.007],
    ],
    np.float32,
)  # fmt: skip
LAMP = np.array([0.80, 0.52, 0.22], np.float32)
GLINT = np.array([3.8, 3.3, 2.5], np.float32)


@dataclass(frozen=True)
class Building:
    """A box with a roof; lengths in metres.

    Attributes
    ----------
    x, y
        Centre.
    yaw
        Turn of the `wide` side away from the x axis, in radians.
    wide, deep
        Plan.
    base, eaves
        Heights of the foot and of the top of the walls.
    roof
        "flat", "gable" (ridge along the wide side) or "spire".
    surface
        "house", "glass", "plain" (no windows) or "car".
    style
        0..1: colour, pitch of the windows, and so on.
    """

    x: float
    y: float
    yaw: float
    wide: float
    deep: float
    base: float
    eaves: float
    roof: str
    surface: str
    style: float

    def at(self, a: float, b: float, z: float) -> Point:
        """Return the world point at `a` along, `b` across the plan, from its centre."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return self.x + c * a - s * b, self.y + s * a + c * b, z

    def corners(self, z: float) -> list[Point]:
        """Return the corners of the plan at height z, counter-clockwise from above."""
        w, d = self.wide / 2, self.deep / 2
        return [self.at(-w, -d, z), self.at(w, -d, z), self.at(w, d, z), self.at(-w, d, z)]

    def occluder(self) -> list[Point]:
        """Return the points down from which the box hides what is behind it."""
        return self.corners(self.eaves)

    def pick(self, salt: int) -> float:
        """Return one of many numbers 0..1 that the style implies."""
        return (self.style * salt) % 1

    @property
    def pitch(self) -> float:
        """Slope of the roof."""
        return {"flat": 0.0, "gable": 0.65 + 0.4 * self.pick(29), "spire": 4.5}[self.roof]

    def paint(self, view: View, texture: Texture, azimuth: float, lowest_row: float) -> None:
        """Paint walls, roof and what stands on it; parameters as of `Tree.paint`."""
        foot, top = self.corners(self.base), self.corners(self.eaves)
        w, d = self.wide / 2, self.deep / 2
        tip = w if self.roof == "gable" else 0.0
        peak = self.eaves + self.pitch * d
        ridge = [self.at(-tip, 0, peak), self.at(tip, 0, peak)]
        for k in range(4):
            n = (k + 1) % 4
            wall = [foot[k], foot[n], top[n], top[k]]
            if self.roof == "gable" and k % 2:
                wall.insert(3, ridge[(k == 1)])
            length = self.deep if k % 2 else self.wide
            across = ((foot[n][1] - foot[k][1]) / length, (foot[k][0] - foot[n][0]) / length)
            sunny = across[0] * SUN[0] + across[1] * SUN[1]
            view.facet(wall, azimuth, _wall(self, texture, sunny, length, k), lowest_row)
            if self.roof == "spire" or (self.roof == "gable" and k % 2 == 0):
                slant = (self.pitch * sunny + SUN[2]) / math.hypot(self.pitch, 1)
                rest = [ridge[1], ridge[0]] if k == 0 else [ridge[0], ridge[1]]
                rest = rest[:1] if self.roof == "spire" else rest
                tiles = _tiles(self, texture, slant)
                view.facet([top[k], top[n], *rest], azimuth, tiles, lowest_row)
        if self.roof == "flat":
            view.facet(top, azimuth, _gravel(self, texture), lowest_row)
        if self.surface == "house" and math.hypot(self.x, self.y) < DETAILED_M:
            for thing in self.roof_top():
                thing.paint(view, texture, azimuth, lowest_row)

    def roof_top(self) -> Iterator["Building"]:
        """Yield dormers, chimneys, lift housings: back to front for an eye at negative b."""
        d = self.deep / 2
        rise = self.pitch * d

        def box(a: float, b: float, wide: float, deep: float, base: float, tall: float, kind: str):
            x, y, _ = self.at(a, b, 0)
            style = self.pick(11)
            return Building(x, y, self.yaw, wide, deep, base, base + tall, "flat", kind, style)

        if self.roof == "flat" and self.wide > 10:
            x = (self.pick(67) - 0.5) * (self.wide - 6)
            yield box(x, 0.1 * d, 4.5, 3.5, self.eaves, 2.6, "plain")
            yield box(0.6 * x - 2, -0.5 * d, 1.6, 1.2, self.eaves, 1.1, "plain")
        if self.roof == "gable":
            stack = (self.pick(43) - 0.5) * (self.wide - 2)
            yield box(stack, 0.3, 1.3, 0.8, self.eaves + 0.7 * rise, 0.3 * rise + 1.3, "brick")
            front = (math.cos(self.yaw) * self.y - math.sin(self.yaw) * self.x) / math.hypot(self.x, self.y)
            if self.pick(19) < 0.6 and front > 0.6:
                count = int(self.wide / 4.2)
                for n in range(count):
                    a = (n + 0.5 - count / 2) * self.wide / count
                    run = 1.9 / self.pitch
                    base = self.eaves + 1.0 * self.pitch
                    yield box(a, -d + 1.0 + run / 2, 1.7, run, base, 1.9, "dormer")


def _wall(house: Building, texture: Texture, sunny: float, length: float, side: int) -> Shade:
    """Return the shade of a wall; `sunny` is the cosine of the sun's incidence."""
    salt = int(1e4 * house.style) + 31 * side
    paints = {"car": PAINT, "cabin": GLASS, "brick": TILES}.get(house.surface, PLASTER)
    plaster = paints[int(house.pick(997) * len(paints))]
    direct = max(sunny, 0.0)
    shadow_m = 17 + 6 * house.pick(31) - STREET_M * SUN[2] / max(direct, 0.05)

    def shade(u: Field, v: Field, distance: Field, pixel_u: float, pixel_v: float) -> Field:
        z = v + np.float32(house.base)
        edge = np.float32(shadow_m) + texture.cell(u / 9 + salt, 0 * u)
        lit = np.float32(direct) * step(z - edge, -0.2, 0.2 + pixel_v)
        ambient = 0.10 + 0.90 * step(z, -3.0, 24.0)
        ambient *= 1 - 0.5 * step(z - house.eaves, -0.9, -0.3 + pixel_v)
        dirt = 1 + np.float32(0.06) * texture.fractal(u / 5 + salt, z / 7, 3, pixel_v / 5)
        light = lit[..., None] * sky.SUN + ambient[..., None] * sky.AMBIENT
        albedo = plaster * dirt[..., None]
        if house.surface in ("plain", "brick", "car", "cabin"):
            return sky.hazed(albedo * light, distance)
        if house.surface == "house" and house.roof == "gable" and side % 2 and house.pick(5) < 0.6:
            return sky.hazed(albedo * light, distance)  # a fire wall
        glass, trim, pane = _windows(house, texture, length, salt, u, v, pixel_u, pixel_v, direct)
        frame = np.float32(0.25 if house.surface == "glass" else 0.75)
        albedo += (trim * np.float32(0.8))[..., None] * (frame - albedo)
        colour = albedo * light
        return sky.hazed(colour + glass[..., None] * (pane - colour), distance)

    return shade


def _windows(
    house: Building,
    texture: Texture,
    length: float,
    salt: int,
    u: Field,
    v: Field,
    pixel_u: float,
    pixel_v: float,
    direct: float,
) -> tuple[Field, Field, Field]:
    """Return coverage of the panes, of panes with their frames, and the colour of the panes."""
    glazed = house.surface == "glass"
    storey = 1.9 if house.surface == "dormer" else 3.1 + 0.8 * house.pick(71)
    bays = max(round(length / (2.2 + 1.3 * house.pick(37))), 1) if storey > 2 else 1
    duty_u, duty_v = (0.9, 0.72) if glazed else (0.36 + 0.16 * house.pick(17), 0.56)
    axis, floors = u * np.float32(bays / length), (v - np.float32(0.4)) / np.float32(storey)
    fu, fv = pixel_u * bays / length, pixel_v / storey
    below = step(house.eaves - house.base - v, 0.25, 0.3 + pixel_v)
    rows = pulse(floors, duty_v, fv) * below
    glass = pulse(axis, duty_u, fu) * rows
    trim = pulse(axis, duty_u + 0.12, fu) * pulse(floors, duty_v + 0.1, fv) * below
    if not glazed:
        glass = glass * (1 - pulse(axis, 0.03, fu))
    # One pane differs from the next; where a pixel holds several, they fade to the mean pane.
    one = np.float32(1 - min(max(1.6 * max(fu, fv) - 0.4, 0.0), 1.0))
    kind = texture.cell(axis, floors, salt)
    mean = GLASS.mean(axis=0)
    pane = mean + one * (GLASS.take(((kind + 1) * 3.999).astype(np.int32), axis=0) - mean)
    if glazed:
        pane = pane * (0.35 + 0.65 * step(v, 0, 60))[..., None]
    pane = pane * (1 - np.float32(0.7) * pulse(floors + 0.36, 0.2, fv))[..., None]
    odd = texture.cell(axis + 13, floors + 5, salt)
    pane = pane + (one * (odd > 0.98))[..., None] * (LAMP - pane)
    if direct > 0 and house.pick(53) < 0.32:
        pane = pane + (one * (odd < -0.95))[..., None] * (GLINT - pane)
    return glass, trim, pane


def _tiles(house: Building, texture: Texture, slant: float) -> Shade:
    """Return the shade of a pitched roof: rows of tiles, stains, roof lights."""
    colour = TILES[int(house.pick(613) * len(TILES))]
    light = sky.SUN * np.float32(max(slant, 0)) + sky.AMBIENT * np.float32(1.2)
    salt = np.float32(90 * house.style)

    def shade(u: Field, v: Field, distance: Field, pixel_u: float, pixel_v: float) -> Field:
        rows = 1 - np.float32(0.3) * pulse(v / 0.42, 0.3, pixel_v / 0.42)
        stain = 1 + 0.25 * texture.fractal(u / 2.5 + salt, v / 4 + salt, 5, pixel_v / 2.5)
        tiled = (rows * stain)[..., None] * (colour * light)
        if house.roof == "spire":
            return sky.hazed(tiled, distance)
        windows = pulse(u / 3.4, 0.3, pixel_u / 3.4) * pulse(v / 3.1 - 0.2, 0.38, pixel_v / 3.1)
        windows = windows * (texture.cell(u / 3.4, v / 3.1 - 0.2, int(salt)) > 0.4)
        shine = GLINT if house.pick(83) < 0.03 and slant > 0 else GLASS[2]
        return sky.hazed(tiled + windows[..., None] * (shine - tiled), distance)

    return shade


def _gravel(house: Building, texture: Texture) -> Shade:
    """Return the shade of a flat roof: gravel inside a parapet; of a car, its paint."""
    light = sky.SUN * np.float32(SUN[2]) + sky.AMBIENT * np.float32(1.4)
    salt = np.float32(90 * house.style)

    def shade(u: Field, v: Field, distance: Field, pixel_u: float, pixel_v: float) -> Field:
        patch = texture.fractal(u / 5 + salt, v / 5 + salt, 5, pixel_v / 5)
        border = np.minimum(np.minimum(u, house.wide - u), np.minimum(v, house.deep - v))
        rim = step(0.5 - border, 0, 0.05 + pixel_v)
        grey = 0.14 + 0.16 * house.pick(7) + 0.05 * patch + 0.25 * rim
        colour = grey[..., None] * light
        if house.surface == "car":
            colour = 0 * colour + sky.AMBIENT * PAINT[int(house.pick(997) * len(PAINT))]
        return sky.hazed(colour, distance)

    return shade
