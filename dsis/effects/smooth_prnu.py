"""Smooth photo-response non-uniformity: neighbouring pixels share some of their gain."""

from collections.abc import Mapping
from functools import lru_cache, partial
from math import ceil
from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from scipy import fft

from dsis.cfa import Cfa
from dsis.effects.effect import Effect, Exposure, Image, OperatingPoint, Stage
from dsis.grid import PixelGrid
from dsis.kept import Kept
from dsis.lines import gained

_FIELDS = Kept(32 << 20)  # every frame of a sensor asks for its field
_MARGIN = 8.0  # correlation lengths from one end of the sensor around to the other
_PLACE = 1 << 20  # row and column of the sensor's first pixel among the draws


class SmoothPrnu(Effect):
    """Fixed Gaussian gains that neighbours share: dust, cover glass, layers of uneven thickness.

    S'(y, x) = S(y, x) (1 + k(y, x)), k a Gaussian field of mean 0 over the sensor, of standard
    deviation sigma and correlation exp(-r / L) at a distance of r pixels, whatever their colours:
    its power sigma^2 2 pi L^2 / (1 + (2 pi L f)^2)^(3/2) lies at low spatial frequencies f. The
    covariance is exact, but for the mean, to exp(-8); for L beyond an eighth of the sensor to
    exp(-n / L), n its shorter side. The temporal variance keeps its mean: shot noise follows S'.
    """

    kind: Literal["smooth_prnu"] = "smooth_prnu"
    sigma_percent: Annotated[float, Field(ge=0, lt=100, examples=[1.5])]
    length_pixels: Annotated[float, Field(gt=0, examples=[5.0])]

    stage: ClassVar[Stage] = Stage.LIGHT
    reference: ClassVar[str] = (
        "EMVA Standard 1288, release 3.1 (spectrograms of the PRNU); the field by circulant "
        "embedding: Dietrich & Newsam, SIAM Journal on Scientific Computing 18, 1997"
    )
    measures: ClassVar[frozenset[str]] = frozenset(
        {
            "fixed_pixel_variance",
            "fixed_row_variance",
            "fixed_column_variance",
            "fixed_smooth_variance",
            "fixed_correlation_0_1",
            "fixed_correlation_1_0",
            "variance_spread",
        }
    )
    confounders: ClassVar[str] = (
        "prnu is white; shading is as wide as the sensor and the same on every one; crosstalk and "
        "spatial_filtering correlate what is new in each frame too."
    )

    def apply(self, image: Image, exposure: Exposure) -> Image:
        """Multiply each pixel by its gain."""
        grid = exposure.grid
        key = exposure.sensor, grid.sensor_shape, self.length_pixels
        gains = _FIELDS.of(key, partial(_field, exposure, self.length_pixels))
        first, left = grid.first_row, grid.first_column
        seen = gains[first : first + grid.rows, left : left + grid.columns]
        size = np.float32(self.sigma_percent / 100)
        if image.ndim == 2:
            return gained(image, seen, size)
        own = size * seen + np.float32(1)
        made: Image = image * own.reshape(*own.shape, *(1,) * (image.ndim - 2))
        return made

    def contributions(self, point: OperatingPoint) -> Mapping[str, float]:
        """Return its share for the shot variance: gains that pixels share are as many."""
        spread = self.sigma_percent / 100
        return {"variance_spread": (spread * point.shot_variance_dn2 / point.variance_dn2) ** 2}


def _field(exposure: Exposure, length: float) -> NDArray[np.float32]:
    """Return the field of a whole sensor, of variance 1 and mean 0: float32 (row, column).

    White noise of a torus, larger than the sensor, is given the amplitudes of the covariance. Each
    place has its own draw, whatever the torus' size: the field depends on the length smoothly.
    """
    rows, columns = exposure.grid.sensor_shape
    around = _around(rows, length), _around(columns, length)
    above, left = (around[0] - rows) // 2, (around[1] - columns) // 2
    place = PixelGrid(*around, Cfa.MONO, _PLACE - above, _PLACE - left)
    white = exposure.sensor.normal("smooth_prnu", place, threads=exposure.threads)
    bins = fft.rfft2(white, overwrite_x=True)
    bins *= _amplitudes(around, length)
    whole = fft.irfft2(bins, around, overwrite_x=True)
    field = whole[above : above + rows, left : left + columns]
    return np.array(field - field.mean(dtype=np.float64), np.float32)


def _around(size: int, length: float) -> int:
    """Return the pixels around the torus: its ends are as far apart as the field's memory."""
    return int(fft.next_fast_len(size + min(size, ceil(_MARGIN * length)), real=True))


@lru_cache(maxsize=4)
def _amplitudes(around: tuple[int, int], length: float) -> NDArray[np.float32]:
    """Return the root of the torus' spectrum of variance 1; what is below 0 counts as 0."""
    y, x = (np.minimum(np.arange(size), size - np.arange(size)) for size in around)
    covariance = np.exp(-np.hypot(y[:, None], x) / length)
    power = np.maximum(fft.rfft2(covariance).real, 0.0)
    made = fft.irfft2(power, around)[0, 0]
    amplitudes: NDArray[np.float32] = np.sqrt(power / made).astype(np.float32)
    amplitudes.flags.writeable = False
    return amplitudes
