"""Sky and clouds."""

import numpy as np

from dsis.scenes.light import clear_sky, rgb
from dsis.scenes.texture import Field, Texture, step
from dsis.scenes.view import View

ROWS_AT_ONCE = 128  # bounds the memory
SHADED, SUNLIT = rgb(0.42, 0.47, 0.55), rgb(0.97, 0.95, 0.91)


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
        slope = view.slopes(first, first + ROWS_AT_ONCE)
        sky = np.broadcast_to(clear_sky(slope), (slope.size, azimuth.size, 3)).copy()
        if slope[0, 0] > 0:
            _clouds(sky, azimuth, slope, texture, cover)
        view.image[first : first + ROWS_AT_ONCE] = sky


def _clouds(sky: Field, azimuth: Field, slope: Field, texture: Texture, cover: float) -> None:
    """Blend heaps of cloud over `sky`, flatter towards the horizon."""
    # A level layer of clouds would smear into streaks at the horizon: use a dome instead.
    u, v = 6.5 * azimuth + 3, 6 * np.sqrt(np.maximum(slope, 0))
    body = texture.fractal(u, v, 5)
    thinner = body - texture.fractal(u - np.float32(0.12), v + np.float32(0.14), 3)
    edge = 0.62 - 0.9 * cover
    cloud = 0.94 * step(body, edge, edge + 0.5) * step(slope, 0.004, 0.03)
    colour = SHADED + step(thinner, -0.5, 0.55)[..., None] * (SUNLIT - SHADED)
    sky += cloud[..., None] * (colour - sky)
