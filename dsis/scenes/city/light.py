"""Sun and air over the city. Linear light, Rec.709 primaries, white D65.

1.0 is a white diffuse surface that faces the sun; a radiance of 1.0 looks the same.
"""

import math

import numpy as np
from numpy.typing import NDArray

SUN_AZIMUTH_RAD = math.radians(-108)  # from the middle of the view, clockwise: left, behind the eye
SUN_ELEVATION_RAD = math.radians(43)
SUN_RADIUS_RAD = math.radians(0.27)
SUNWARD = np.array(
    [
        math.cos(SUN_ELEVATION_RAD) * math.sin(SUN_AZIMUTH_RAD),
        math.cos(SUN_ELEVATION_RAD) * math.cos(SUN_AZIMUTH_RAD),
        math.sin(SUN_ELEVATION_RAD),
    ]
)


Points = NDArray[np.float64]


def sun_points(count: int) -> Points:
    """Return unit vectors (point, 3) to points that cover the sun's disc evenly (a spiral)."""
    across = np.array([math.cos(SUN_AZIMUTH_RAD), -math.sin(SUN_AZIMUTH_RAD), 0.0])
    upward = np.cross(across, SUNWARD)
    n = np.arange(count)
    radius = SUN_RADIUS_RAD * np.sqrt((n + 0.5) / count)
    turn = n * math.pi * (3 - math.sqrt(5))
    aside = (radius * np.cos(turn))[:, None] * across + (radius * np.sin(turn))[:, None] * upward
    points: Points = SUNWARD + aside
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    return points


def sky_sets(samples: int, count: int) -> Points:
    """Return unit vectors about +z whose density is the cosine to it: float64 (sample, count, 3).

    The mean of the radiance from them is the irradiance over pi. Together the samples' sets are one
    low-discrepancy sequence (R2: Roberts, "The unreasonable effectiveness of quasirandom
    sequences", 2018), taken in turns so that each set covers the sky.
    """
    g = 1.32471795724474602596
    n = np.arange(1, samples * count + 1)
    a, b = (0.5 + n / g) % 1, (0.5 + n / g**2) % 1
    radius, turn = np.sqrt(a), 2 * math.pi * b
    points = np.stack([radius * np.cos(turn), radius * np.sin(turn), np.sqrt(1 - a)], axis=1)
    return np.ascontiguousarray(points.reshape(count, samples, 3).swapaxes(0, 1))
