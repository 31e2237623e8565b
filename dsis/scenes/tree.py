"""Trees: crowns of overlapping leafy lobes on a trunk, painted as flat sprites."""

import math

import numpy as np

from dsis.scenes import sky
from dsis.scenes.texture import Texture, step
from dsis.scenes.view import View

LOBES = 9


def paint(
    view: View,
    texture: Texture,
    foot: tuple[float, float, float],
    azimuth: float,
    height_m: float,
    style: float,
    sunward: float = -1.0,
) -> None:
    """Paint one broad-leaved tree.

    Parameters
    ----------
    view
        Painted in place.
    texture
        Shape of leaves and twigs.
    foot
        Where the trunk meets the ground.
    azimuth
        Of the tree, in radians: tells the turn of the cylinder.
    height_m
        From foot to top.
    style
        0..1, tells colour and shape.
    sunward
        -1 the sun is on the left, 1 on the right.
    """
    distance = math.hypot(foot[0], foot[1])
    scale = view.focal_px / distance  # pixels per metre
    column, bottom = view.project(foot, azimuth)
    wide = 0.36 * height_m
    top, last_row, left, last_column = view.box(
        column - 1.35 * wide * scale,
        bottom - 1.1 * height_m * scale,
        column + 1.35 * wide * scale,
        bottom + 1,
    )
    if top >= last_row or left >= last_column:
        return
    x = ((np.arange(left, last_column) + 0.5 - column) / scale).astype(np.float32)[None, :]
    z = ((bottom - np.arange(top, last_row) - 0.5) / scale).astype(np.float32)[:, None]
    pixel = 1 / scale
    seed = np.float32(100 * style + 3 * azimuth)
    leaf = texture.fractal(x * 0.9 + seed, z * 1.1 + seed, 5, 0.9 * pixel)
    ragged = 0.16 * height_m * 0.3 * leaf
    depth = np.full(leaf.shape, -1e3, np.float32)
    light = np.zeros_like(leaf)
    for n in range(LOBES):
        angle = 2.4 * n + 6 * style
        reach = math.sqrt(n / LOBES) * 0.62
        cx, cz = wide * reach * math.cos(angle), height_m * (0.62 + 0.30 * reach * math.sin(angle))
        radius = height_m * (0.21 + 0.05 * math.sin(5 * angle))
        dx, dz = (x - cx) / radius, (z - cz) / (0.85 * radius)
        ball = 1 - np.sqrt(dx * dx + dz * dz)
        inside = radius * ball + ragged
        toward = 0.55 * sunward * dx + 0.75 * dz + 0.1 * math.sin(9 * angle)
        front = inside > depth
        light = np.where(front, toward, light)
        depth = np.maximum(depth, inside)
    cover = np.clip(depth / pixel + 0.5, 0, 1)
    trunk = 0.022 * height_m
    stem = np.clip((trunk - np.abs(x)) / pixel + 0.5, 0, 1) * (z < 0.6 * height_m) * (z > 0)
    brightness = step(light + 0.9 * leaf, -1.0, 1.6)
    dark = np.array([0.006, 0.010, 0.004], np.float32)
    green = np.array([0.17 + 0.09 * style, 0.25, 0.05], np.float32)
    crown = dark + (brightness**2)[..., None] * (green - dark)
    bark = np.array([0.035, 0.028, 0.02], np.float32)
    colour = np.where((cover > 0.02)[..., None], crown, bark)
    air = np.full(leaf.shape, distance, np.float32)
    view.blend(top, left, sky.hazed(colour, air), np.maximum(cover, stem))
