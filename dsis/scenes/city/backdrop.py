"""What lies behind the city: the sky, and wooded hills along the horizon."""

import numpy as np
from numpy.typing import NDArray

HILLS = ((0.0062, 15000.0, 3.0, 0), (0.0042, 9500.0, 7.0, 1))  # rise, distance in m, per radian


def paint_hills(
    image: NDArray[np.float32],
    slopes: NDArray[np.float64],
    azimuths: NDArray[np.float64],
    seed: int,
    haze_per_m: NDArray[np.float64],
    haze_rgb: NDArray[np.float64],
) -> None:
    """Paint two ridges of hills over the sky in `image`, (row, column, 3), the far one first.

    `slopes` and `azimuths` are those of rows and columns; a pixel on the ridge is part hill.
    """
    rng = np.random.Generator(np.random.PCG64([seed, 3]))
    pixel = float(slopes[0] - slopes[1])
    last = int(np.searchsorted(-slopes, 0.012))
    for rise, distance, rate, ridge in HILLS:
        waves = rate * 1.9 ** np.arange(9)
        turns = waves[:, None] * azimuths + rng.uniform(0, 6.3, (9, 1))
        sizes = 0.62 ** np.arange(9)[:, None]
        fine = np.clip(1.5 - waves[:, None] * pixel, 0, 1)
        profile = rise * (1.15 + (sizes * fine * np.sin(turns)).sum(axis=0) / 1.7)
        cover = np.clip(0.5 + (profile - slopes[:last, None]) / pixel, 0, 1)[..., None]
        wood = np.zeros((last, azimuths.size))
        for n in range(7):
            u = 90 * 1.7**n
            steep = rng.uniform(2.0, 6.0)
            shift = rng.uniform(0, 6.3, 2)
            keep = 0.75**n * np.clip(1.3 - u * steep * pixel, 0, 1)
            wood += (
                keep
                * np.sin(u * azimuths + shift[0] + 2 * np.sin(0.37 * u * azimuths))
                * np.sin(u * steep * slopes[:last, None] + shift[1] + np.sin(0.51 * u * azimuths))
            )
        green = np.where(wood > 0.35, 0.55, 1.0 + 0.12 * wood)[..., None] * np.array(
            [(0.045, 0.060, 0.028), (0.060, 0.075, 0.032)][ridge]
        )
        air = np.exp(-haze_per_m * distance)
        seen = green * air + (1 - air) * haze_rgb
        image[:last] += (cover * (seen - image[:last])).astype(np.float32)
