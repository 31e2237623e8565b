"""Light of both scenes: sun, open sky and haze.

Linear light, Rec.709 primaries, white point D65; 1.0 is a white diffuse surface facing the sun.
"""

import math

import numpy as np

from dsis.scenes.texture import Field


def rgb(red: float, green: float, blue: float) -> Field:
    """Return a colour: float32 (3,)."""
    return np.array([red, green, blue], np.float32)


SUN = rgb(0.87, 0.83, 0.76)  # on a surface that faces it
AMBIENT = rgb(0.13, 0.17, 0.24)  # of the open sky on an upright surface
GLINT = rgb(3.8, 3.3, 2.5)  # the sun in glass or water, as much of it as a pixel holds
_AZIMUTH, _ELEVATION = -1.88, 0.46
SUNWARD = (  # unit vector: from the left, a little behind the eye
    math.cos(_ELEVATION) * math.sin(_AZIMUTH),
    math.cos(_ELEVATION) * math.cos(_AZIMUTH),
    math.sin(_ELEVATION),
)
_ZENITH = rgb(0.06, 0.19, 0.46)
_RIM = rgb(0.47, 0.58, 0.68)  # of the sky at the horizon, and of haze
_HAZE_PER_M = rgb(0.9e-4, 1.1e-4, 1.4e-4)
_CLEAR_M = 1200.0  # the air thins out towards the eye, which is high up


def clear_sky(slope: Field) -> Field:
    """Return the cloudless sky (..., 3) at a slope above the horizon (...)."""
    near = np.exp(-np.maximum(slope, 0) / np.float32(0.11))[..., None]
    colour: Field = _ZENITH + near * (_RIM - _ZENITH)
    return colour


def hazed(colour: Field, distance: Field, air: float = 1.0) -> Field:
    """Return a colour (..., 3) seen through `distance` (...) metres of air of that density."""
    depth = np.float32(air) * distance * distance / (distance + np.float32(_CLEAR_M))
    through = np.exp(-_HAZE_PER_M * depth[..., None])
    seen: Field = _RIM + through * (colour - _RIM)
    return seen
