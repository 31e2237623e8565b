"""Sky, clouds and haze of both scenes, and the sun that lights them.

Light is linear, Rec.709 primaries, 1.0 = a white diffuse surface that faces the sun.
"""

import math

import numpy as np

from dsis.scenes.texture import Field, Texture, step
from dsis.scenes.view import View

ROWS_AT_ONCE = 128
SUN = np.array([0.80, 0.74, 0.64], np.float32)  # on a surface that faces it
AMBIENT = np.array([0.13, 0.17, 0.24], np.float32)  # of the open sky on an upright surface
_ZENITH = np.array([0.06, 0.19, 0.46], np.float32)
_RIM = np.array([0.47, 0.58, 0.68], np.float32)  # at the horizon, and the colour of haze
_HAZE_PER_M = np.array([0.9e-4, 1.1e-4, 1.4e-4], np.float32)
_CLEAR_M = 1200.0  # the air thins out towards the eye, which is high up


def sun_direction(azimuth: float, elevation: float) -> tuple[float, float, float]:
    """Return the unit vector towards the sun from angles in radians."""
    flat = math.cos(elevation)
    return flat * math.sin(azimuth), flat * math.cos(azimuth), math.sin(elevation)


def clear(slope: Field) -> Field:
    """Return the cloudless sky at a slope (any shape) above the horizon, (..., 3)."""
    down = np.exp(-np.maximum(slope, 0) / np.float32(0.11))[..., None]
    colour: Field = _ZENITH + down * (_RIM - _ZENITH)
    return colour


def hazed(colour: Field, distance: Field, strength: float = 1.0) -> Field:
    """Return a colour (..., 3) seen through `distance` (...) metres of air."""
    depth = distance * distance / (distance + np.float32(_CLEAR_M))
    through = np.exp(-strength * _HAZE_PER_M * depth[..., None])
    seen: Field = _RIM + through * (colour - _RIM)
    return seen


def paint(view: View, texture: Texture, cover: float) -> None:
    """Paint sky and clouds above the horizon, the horizon's own colour below it.

    Parameters
    ----------
    view
        Painted in place.
    texture
        Shape of the clouds.
    cover
        0 hardly a cloud .. 1 nearly closed.
    """
    azimuth = view.azimuths()
    for first in range(0, view.image.shape[0], ROWS_AT_ONCE):
        slope = view.slopes(first, min(first + ROWS_AT_ONCE, view.image.shape[0]))
        sky = np.broadcast_to(clear(slope), (*slope.shape[:1], azimuth.size, 3)).copy()
        if slope[0, 0] > 0:
            _clouds(sky, azimuth, slope, texture, cover)
        view.image[first : first + ROWS_AT_ONCE] = sky


def _clouds(sky: Field, azimuth: Field, slope: Field, texture: Texture, cover: float) -> None:
    """Blend heaps of cloud over `sky`: flatter and closer together towards the horizon."""
    # A level layer of clouds would smear into streaks at the horizon: use a dome instead.
    u, v = azimuth * np.float32(6.5) + np.float32(3), np.sqrt(np.maximum(slope, 0)) * np.float32(6)
    body = texture.fractal(u, v, 7, 6.5 / 1000)
    lit = body - texture.fractal(u - np.float32(0.12), v + np.float32(0.14), 4)
    bias = np.float32(0.62 - 0.9 * cover)
    cloud = step(body, bias, bias + 0.34) * step(slope, 0.004, 0.03)
    light = step(lit, -0.5, 0.55)[..., None]
    shade = np.array([0.42, 0.47, 0.55], np.float32)
    white = np.array([0.97, 0.95, 0.91], np.float32)
    sky += (cloud * np.float32(0.94))[..., None] * (shade + light * (white - shade) - sky)
