"""What covers the landscape: meadow, fields, woods, rock and water."""

import numpy as np
from numpy.typing import NDArray

from dsis.scenes.light import GLINT, rgb
from dsis.scenes.relief import EYE_M
from dsis.scenes.texture import Field, Texture, pulse, step
from dsis.scenes.view import View

CROPS = np.array(
    [
        [0.42, 0.34, 0.13], [0.50, 0.43, 0.06], [0.12, 0.20, 0.05], [0.16, 0.11, 0.07],
        [0.20, 0.26, 0.08], [0.34, 0.32, 0.14], [0.15, 0.23, 0.06], [0.26, 0.28, 0.10],
    ],
    np.float32,
)  # fmt: skip


def _upright(
    texture: Texture,
    az: Field,
    distance: Field,
    v: Field,
    size_m: float,
    octaves: int,
    pixel: Field,
) -> Field:
    """Return noise in features `size_m` wide across the view, whatever the distance.

    Azimuth times distance would shear it along a column; so use the powers of two on both sides
    of the distance, fading from one to the other.
    """
    level = np.log2(distance)
    band = np.floor(level)
    total: Field = np.zeros_like(distance)
    for power, weight in ((band, band + 1 - level), (band + 1, level - band)):
        u = az * np.exp2(power) / np.float32(size_m) + 17 * power
        total += np.sqrt(weight) * texture.fractal(u, v, octaves, pixel / np.float32(size_m))
    return total


def meadow(view: View, texture: Texture, az: Field, distance: Field) -> Field:
    """Return the albedo of grass, dry grass and flowers, (point, 3)."""
    x, y = distance * np.sin(az), distance * np.cos(az)
    pixel = distance / np.float32(view.focal_px)
    tall = 12 * np.log(distance)  # metres up the picture: the slope passes 12 m below the eye
    tuft = texture.fractal(x / 3, y / 3, 5, pixel * distance / 40)
    blade = _upright(texture, az, distance, tall / 0.3, 0.10, 4, pixel)
    dry = step(texture.fractal(x / 14 + 70, y / 14, 4), -0.6, 1.0)
    green, straw = rgb(0.15, 0.21, 0.04), rgb(0.33, 0.30, 0.11)
    colour = (green + dry[:, None] * (straw - green)) * np.exp(0.3 * tuft + 0.42 * blade)[:, None]
    bloom = _upright(texture, az + 5, distance, tall / 0.09, 0.09, 1, pixel)
    patch = step(texture.fractal(x / 9 + 30, y / 9 + 9, 2), 0.0, 0.9)
    flowers = step(bloom + 0.35 * patch, 0.8, 0.95) * step(patch, 0, 0.3)
    petals = np.where((tuft > 0)[:, None], rgb(0.8, 0.78, 0.7), rgb(0.75, 0.6, 0.05))
    mixed: Field = colour + flowers[:, None] * (petals - colour)
    return mixed


def country(
    view: View, texture: Texture, az: Field, distance: Field, height: Field, wood: Field
) -> Field:
    """Return the albedo of fields, alps, woods and rock, in the shadow of clouds, (point, 3)."""
    x, y = distance * np.sin(az), distance * np.cos(az)
    pixel = distance / np.float32(view.focal_px)
    deep = pixel * np.minimum(distance / np.maximum(EYE_M - height, 9), 30)
    bend = np.float32(0.3) * texture.value(x / 500, y / 500)
    p, q = (0.8 * x - 0.6 * y) / 150 + bend, (0.6 * x + 0.8 * y) / 260 - bend
    q += 0.5 * np.floor(p)
    crop = CROPS.take((3.999 * (1 + texture.cell(p, q, 3))).astype(np.int32), axis=0)
    across = np.where(texture.cell(p, q, 5) > 0, 15 * p, 26 * q)
    hedge = 1 - pulse(p, 0.975, deep / 150) * pulse(q, 0.985, deep / 260)
    patchy = texture.fractal(x / 40, y / 40, 4, deep / 40)
    colour = crop * (0.86 + 0.25 * pulse(across, 0.5, deep / 10) + 0.12 * patchy)[:, None]
    colour += hedge[:, None] * (rgb(0.02, 0.035, 0.012) - colour)
    alp = rgb(0.17, 0.21, 0.07) * (1 + 0.3 * patchy[:, None])
    colour += step(height, 60, 110)[:, None] * (alp - colour)
    crown = _upright(texture, az, distance, (height + 0.3 * distance) / 4.5, 6.5, 4, pixel)
    trees = (0.1 + step(crown, -1.0, 1.2) ** 1.5)[:, None] * rgb(0.11, 0.155, 0.045)
    colour += np.minimum(8 * wood, 1)[:, None] * (trees - colour)
    rock = rgb(0.34, 0.32, 0.30) * (0.9 + 0.3 * crown[:, None])
    colour += step(height + 60 * crown, 400, 620)[:, None] * (rock - colour)
    clouds = step(texture.fractal(x / 1300, y / 1300 + 8, 3), -0.55, -0.1)
    shaded: Field = colour * (0.2 + 0.8 * clouds)[:, None]
    return shaded


def water(
    view: View,
    texture: Texture,
    scene: Field,
    at: tuple[NDArray[np.int64], NDArray[np.int64]],
    az: Field,
    distance: Field,
    bank: Field,
) -> Field:
    """Return the lake: sky and banks mirrored in ripples, the deep below, the sun's glitter."""
    slope, over = EYE_M / distance, scene.shape[0] / view.image.shape[0]
    ripple = texture.fractal(120 * az, 350 * slope, 4, 350 / view.focal_px)
    calm = step(texture.fractal(6 * az, 60 * slope, 3), -0.4, 0.5)
    mirrored = np.abs(over * (2 * view.horizon_row + 0.012 * view.focal_px * ripple) - at[0])
    above = np.minimum(mirrored.astype(np.int64), scene.shape[0] - 1)
    deep = rgb(0.008, 0.018, 0.022)
    colour = deep + (0.36 + 0.16 * calm)[:, None] * (scene[above, at[1]] - deep)
    colour += step(bank + 0.25 * ripple, 0.3, 0.7)[:, None] * (rgb(0.02, 0.035, 0.03) - colour)
    colour *= (1 + 0.25 * ripple * (1 - calm))[:, None]
    spark = texture.value(180 * az + 7, 900 * slope) + 0.1 * texture.value(5 * az, 40 * slope)
    glitter: Field = colour + step(spark, 0.82, 1.03)[:, None] * (GLINT - colour)
    return glitter
