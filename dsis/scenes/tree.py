"""Broad-leaved trees: crowns of leafy lobes on a trunk, painted as sprites that face the eye."""

import math
from dataclasses import dataclass

import numpy as np

from dsis.scenes import sky
from dsis.scenes.texture import Texture, step
from dsis.scenes.view import Point, View

LOBES = 14


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
        wide, tall = 0.4 * self.height, self.height
        reach = 1.35 * wide * scale
        top, bottom, left, right = view.box(
            
            column - reach,
            foot - 1.1 * tall * scale,
            column + 1.7 * reach,
            min(foot + 0.05 * tall * scale, lowest_row),

        )
        if top >= bottom or left >= right:
            return
        x = ((np.arange(left, right) + 0.5 - column) / scale).astype(np.float32)[None, :]
        z = ((foot - np.arange(top, bottom) - 0.5) / scale).astype(np.float32)[:, None]
        pixel = 1 / scale
        seed = np.float32(100 * self.style + 3 * azimuth)
        leaf = texture.fractal(1.3 * x + seed, 1.5 * z + seed, 7, 1.3 * pixel)
        # A smooth union of lobes: each weighs by how far its surface stands out.
        weights, light, surface = np.zeros_like(leaf), np.zeros_like(leaf), -tall + 0 * leaf
        for n in range(LOBES):
            angle, out = 2.4 * n + 6 * self.style, math.sqrt((n + 0.5) / LOBES)
            radius = tall * (0.2 - 0.07 * out + 0.04 * math.sin(5 * angle))
            dx = (x - 0.78 * wide * out * math.cos(angle)) / radius
            dz = (z - tall * (0.55 + 0.28 * out * math.sin(angle))) / (0.85 * radius)
            inside = radius * (1 - np.sqrt(dx * dx + dz * dz))
            weight = np.exp(np.clip(np.float32(40 / tall) * inside, -30, 30))
            light += weight * (0.45 * dz - 0.4 * dx + np.float32(0.5 * math.sin(9 * angle)))
            weights += weight
            surface = np.maximum(surface, inside)
        light = light / np.maximum(weights, 1e-9) + (0.9 * z / tall - 0.6 * x / wide - 0.55)
        crown = np.clip((surface + np.float32(0.06 * tall) * leaf) / pixel + 0.5, 0, 1)
        thick = 0.024 * tall * (1.3 - z / tall)
        trunk = np.clip((thick - np.abs(x)) / pixel + 0.5, 0, 1) * ((z < 0.6 * tall) & (z > 0))
        brightness = step(light + 1.1 * leaf, -1.5, 1.9) ** 2
        dark = np.array([0.004, 0.007, 0.003], np.float32)
        green = np.array([0.17 + 0.13 * self.style, 0.27, 0.05], np.float32)
        bark = np.array([0.03, 0.024, 0.018], np.float32)
        leaves = dark + brightness[..., None] * (green - dark)
        colour = np.where((crown > 0.02)[..., None], leaves, bark)
        far = np.full(leaf.shape, distance, np.float32)
        shadow = step(1 - ((x - 0.4 * tall) / (0.5 * tall)) ** 2 - (z / (0.045 * tall)) ** 2, 0, 0.9)
        view.blend(top, left, sky.hazed(0 * colour + dark, far, view.air), np.float32(0.7) * shadow)
        view.blend(top, left, sky.hazed(colour, far, view.air), np.maximum(crown, trunk))
