"""Broad-leaved trees: crowns of leafy lobes on a trunk, painted as sprites that face the eye."""

import math
from dataclasses import dataclass

import numpy as np

from dsis.scenes import sky
from dsis.scenes.texture import Texture, step
from dsis.scenes.view import Point, View

LOBES = 9


@dataclass(frozen=True)
class Tree:
    """A tree: position of its foot and height in metres, `style` 0..1 for shape and colour."""

    x: float
    y: float
    base: float
    height: float
    style: float

    def occluder(self) -> list[Point]:
        """Return nothing: one sees through."""
        return []

    def paint(self, view: View, texture: Texture, azimuth: float, lowest_row: float) -> None:
        """Paint the tree into the view; the sun is on the left.

        Parameters
        ----------
        view
            Painted in place.
        texture
            Shape of leaves and twigs.
        azimuth
            Of the tree in radians: tells the turn of the cylinder.
        lowest_row
            What lies below this row is hidden by nearer things and need not be painted.
        """
        distance = math.hypot(self.x, self.y)
        scale = view.focal_px / distance  # pixels per metre
        column, foot = view.project((self.x, self.y, self.base), azimuth)
        wide, tall = 0.36 * self.height, self.height
        reach = 1.35 * wide * scale
        top, bottom, left, right = view.box(
            column - reach, foot - 1.1 * tall * scale, column + reach, min(foot + 1, lowest_row)
        )
        if top >= bottom or left >= right:
            return
        x = ((np.arange(left, right) + 0.5 - column) / scale).astype(np.float32)[None, :]
        z = ((foot - np.arange(top, bottom) - 0.5) / scale).astype(np.float32)[:, None]
        pixel = 1 / scale
        seed = 100 * self.style + 3 * azimuth
        leaf = texture.fractal(0.9 * x + np.float32(seed), 1.1 * z + np.float32(seed), 6, pixel)
        surface = np.full(leaf.shape, -1e3, np.float32)
        light = np.zeros_like(leaf)
        for n in range(LOBES):
            angle, out = 2.4 * n + 6 * self.style, 0.62 * math.sqrt(n / LOBES)
            radius = tall * (0.21 + 0.05 * math.sin(5 * angle))
            dx = (x - wide * out * math.cos(angle)) / radius
            dz = (z - tall * (0.62 + 0.3 * out * math.sin(angle))) / (0.85 * radius)
            inside = radius * (1 - np.sqrt(dx * dx + dz * dz)) + np.float32(0.05 * tall) * leaf
            toward = 0.8 * dz - 0.55 * dx + 0.1 * math.sin(9 * angle)
            light = np.where(inside > surface, toward, light)
            surface = np.maximum(surface, inside)
        crown = np.clip(surface / pixel + 0.5, 0, 1)
        trunk = np.clip((0.022 * tall - np.abs(x)) / pixel + 0.5, 0, 1) * (z < 0.6 * tall)
        brightness = step(light + 0.9 * leaf, -1.0, 1.7) ** 2
        dark = np.array([0.004, 0.007, 0.003], np.float32)
        green = np.array([0.15 + 0.12 * self.style, 0.24, 0.045], np.float32)
        bark = np.array([0.03, 0.024, 0.018], np.float32)
        leaves = dark + brightness[..., None] * (green - dark)
        colour = np.where((crown > 0.02)[..., None], leaves, bark)
        air = np.full(leaf.shape, distance, np.float32)
        view.blend(top, left, sky.hazed(colour, air), np.maximum(crown, trunk))
