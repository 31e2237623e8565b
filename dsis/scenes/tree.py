"""Broad-leaved trees: crowns of leafy lobes on a trunk, painted as sprites that face the eye."""

import math
from dataclasses import dataclass

import numpy as np

from dsis.scenes.light import rgb
from dsis.scenes.texture import Field, Texture, step
from dsis.scenes.view import Point, View

LOBES = 14
DARK, BARK = rgb(0.003, 0.005, 0.002), rgb(0.03, 0.024, 0.018)


@dataclass(frozen=True)
class Tree:
    """A tree: its foot and height in metres, and a style 0..1 that tells shape and colour."""

    x: float
    y: float
    base: float
    height: float
    style: float

    def occluder(self) -> list[Point]:
        """Return nothing: one sees through."""
        return []

    def paint(self, view: View, texture: Texture, azimuth: float, lowest_row: float) -> None:
        """Paint the tree and its shadow; the sun is on the left.

        Parameters
        ----------
        view
            Painted in place.
        texture
            Shape of leaves and twigs.
        azimuth
            Of the tree in radians: tells the turn of the cylinder.
        lowest_row
            What lies below is hidden by nearer things and need not be painted.
        """
        distance = math.hypot(self.x, self.y)
        px_per_m, tall = view.focal_px / distance, self.height
        column, foot = view.project((self.x, self.y, self.base), azimuth)
        size = tall * px_per_m
        top, bottom, left, right = view.box(
            (column - 0.55 * size, column + 0.92 * size),
            (foot - 1.1 * size, min(foot + 0.05 * size, lowest_row)),
        )
        if top >= bottom or left >= right:
            return
        x = ((np.arange(left, right) + 0.5 - column) / size).astype(np.float32)[None, :]
        z = ((foot - np.arange(top, bottom) - 0.5) / size).astype(np.float32)[:, None]
        shift = np.float32(100 * self.style + 3 * azimuth)
        u, v, pixel = tall * x + shift, tall * z + shift, 1 / px_per_m
        leaf = texture.fractal(1.3 * u, 1.5 * v, 4, 1.3 * pixel)
        leaf += 0.5 * texture.fractal(7 * u, 8 * v, 4, 7 * pixel)
        surface, light = self._crown(x, z)
        crown = np.clip((surface + np.float32(0.05) * leaf) * size + 0.5, 0, 1)
        trunk = np.clip((0.024 * (1.3 - z) - np.abs(x)) * size + 0.5, 0, 1) * ((z > 0) & (z < 0.6))
        green = rgb(0.16 + 0.12 * self.style, 0.26, 0.05)
        leaves = DARK + (step(light + 0.9 * leaf, -1.6, 2.0) ** 2)[..., None] * (green - DARK)
        colour = np.where((crown > 0.02)[..., None], leaves, BARK * (1 + 0.5 * leaf)[..., None])
        shadow = step(1 - ((x - 0.4) / 0.5) ** 2 - (z / 0.045) ** 2, 0, 0.9)
        far = np.full((1, 1), distance, np.float32)
        view.blend(top, left, DARK, far, np.float32(0.7) * shadow)
        view.blend(top, left, colour, far, np.maximum(crown, trunk))

    def _crown(self, x: Field, z: Field) -> tuple[Field, Field]:
        """Return how far inside the crown, and how lit, in units of the height: a union of lobes.

        The union is smooth: a lobe has the more weight the farther its surface stands out.
        """
        weights = np.zeros((z.size, x.size), np.float32)
        light, surface = np.zeros_like(weights), np.full_like(weights, -1)
        for n in range(LOBES):
            angle, out = 2.4 * n + 6 * self.style, math.sqrt((n + 0.5) / LOBES)
            radius = 0.2 - 0.07 * out + 0.04 * math.sin(5 * angle)
            dx = (x - 0.31 * out * math.cos(angle)) / radius
            dz = (z - 0.55 - 0.28 * out * math.sin(angle)) / (0.85 * radius)
            inside = radius * (1 - np.sqrt(dx * dx + dz * dz))
            weight = np.exp(40 * np.maximum(inside, -0.7))
            light += weight * (0.45 * dz - 0.4 * dx + 0.4 * math.sin(9 * angle))
            weights += weight
            surface = np.maximum(surface, inside)
        return surface, light / weights + (0.9 * z - 1.5 * x - 0.5)
