"""Buildings: a box with a roof, and what stands on the roof."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

from dsis.scenes.light import SUNWARD
from dsis.scenes.surfaces import Wall, flat_roof, pick, tiles
from dsis.scenes.texture import Texture
from dsis.scenes.view import Point, View

DETAILED_M = 620.0  # nearer than this, roofs carry chimneys and dormers


@dataclass(frozen=True)
class Building:
    """A box with a roof; lengths in metres.

    Attributes
    ----------
    x, y
        Centre.
    yaw
        Turn of the wide side from the x axis, in radians.
    wide, deep
        Plan.
    base, eaves
        Heights of the foot and the top of the walls.
    roof
        "flat", "gable" (ridge along the wide side) or "spire".
    kind
        As of `dsis.scenes.surfaces.Wall`.
    style
        0..1: implies colours, pitch of the windows and so on.
    """

    x: float
    y: float
    yaw: float
    wide: float
    deep: float
    base: float
    eaves: float
    roof: str
    kind: str
    style: float

    @property
    def pitch(self) -> float:
        """Slope of the roof."""
        return {"flat": 0.0, "gable": 0.65 + 0.4 * pick(self.style, 29), "spire": 4.5}[self.roof]

    def at(self, a: float, b: float, z: float) -> Point:
        """Return the world point `a` along and `b` across the plan from its centre."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return self.x + c * a - s * b, self.y + s * a + c * b, z

    def plan(self, z: float) -> list[Point]:
        """Return the corners at height z, counter-clockwise from above."""
        a, b = self.wide / 2, self.deep / 2
        return [self.at(-a, -b, z), self.at(a, -b, z), self.at(a, b, z), self.at(-a, b, z)]

    def occluder(self) -> list[Point]:
        """Return the points below which the box hides what is behind it."""
        return self.plan(self.eaves)

    def paint(self, view: View, texture: Texture, azimuth: float, lowest_row: float) -> None:
        """Paint walls, roof and what stands on it; parameters as of `Tree.paint`."""
        foot, top = self.plan(self.base), self.plan(self.eaves)
        half = self.wide / 2 if self.roof == "gable" else 0.0
        peak = self.eaves + self.pitch * self.deep / 2
        left, right = self.at(-half, 0, peak), self.at(half, 0, peak)
        for side in range(4):
            n = (side + 1) % 4
            length = self.deep if side % 2 else self.wide
            east, north = foot[n][0] - foot[side][0], foot[n][1] - foot[side][1]
            sunny = (north * SUNWARD[0] - east * SUNWARD[1]) / length
            gable = self.roof == "gable" and side % 2 == 1
            kind = "plain" if gable and pick(self.style, 5) < 0.6 else self.kind  # a fire wall
            outline = [foot[side], foot[n], top[n], top[side]]
            if gable:
                outline.insert(3, right if side == 1 else left)
            wall = Wall(texture, kind, self.style, side, self.base, self.eaves, length, sunny)
            view.facet(outline, azimuth, wall.shade, lowest_row)
            if self.roof == "spire" or (self.roof == "gable" and not gable):
                slanted = (self.pitch * sunny + SUNWARD[2]) / math.hypot(self.pitch, 1)
                peaks = {"spire": [left], "gable": [right, left] if side == 0 else [left, right]}
                shade = tiles(texture, self.style, slanted, windows=self.roof == "gable")
                view.facet([top[side], top[n], *peaks[self.roof]], azimuth, shade, lowest_row)
        if self.roof == "flat":
            shade = flat_roof(texture, self.kind, self.style, self.wide, self.deep)
            view.facet(top, azimuth, shade, lowest_row)
        if self.kind == "house" and math.hypot(self.x, self.y) < DETAILED_M:
            for thing in self._on_the_roof():
                thing.paint(view, texture, azimuth, lowest_row)

    def _on_the_roof(self) -> Iterator["Building"]:
        """Yield lift housings or chimneys and dormers, the far ones first."""

        def box(
            a: float, b: float, wide: float, deep: float, rise: float, tall: float, kind: str
        ) -> "Building":
            x, y, base = self.at(a, b, self.eaves + rise)
            return Building(
                x, y, self.yaw, wide, deep, base, base + tall, "flat", kind, pick(self.style, 11)
            )

        shift = pick(self.style, 43) - 0.5
        if self.roof == "flat" and self.wide > 10:
            a = shift * (self.wide - 6)
            yield box(a, 0.05 * self.deep, 4.5, 3.5, 0, 2.6, "plain")
            yield box(0.6 * a - 2, -0.25 * self.deep, 1.6, 1.2, 0, 1.1, "plain")
        if self.roof == "gable":
            ridge = self.pitch * self.deep / 2
            yield box(
                shift * (self.wide - 2), 0.3, 1.3, 0.8, 0.7 * ridge, 0.3 * ridge + 1.3, "brick"
            )
            c, s = math.cos(self.yaw), math.sin(self.yaw)
            facing = (c * self.y - s * self.x) / math.hypot(self.x, self.y)
            if facing > 0.6 and pick(self.style, 19) < 0.6:
                count, run = int(self.wide / 4.2), 1.9 / self.pitch
                for n in range(count):
                    a = (n + 0.5 - count / 2) * self.wide / count
                    b = 1.0 + run / 2 - self.deep / 2
                    yield box(a, b, 1.7, run, self.pitch, 1.9, "dormer")
