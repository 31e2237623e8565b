"""Hot pixels: a few pixels with a large dark current."""

from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field
from scipy.special import ndtr, ndtri

from dsis.effects.effect import MOST_DN, Effect, Exposure, Image, OperatingPoint, Stage


class HotPixels(Effect):
    """A share of the pixels has an exponentially distributed dark current of the given mean.

    S'(y, x) = S(y, x) + d(y, x) T, d ~ Exp(mean) with probability p, else 0. The extra charge has
    shot noise and grows with the exposure time, pixel by pixel.
    """

    kind: Literal["hot_pixels"] = "hot_pixels"
    pixel_fraction: Annotated[float, Field(ge=0, le=0.5, examples=[0.02])]
    mean_dn_per_s: Annotated[float, Field(ge=0, le=MOST_DN, examples=[300.0])]

    stage: ClassVar[Stage] = Stage.LIGHT
    rank: ClassVar[int] = 50  # after what acts on light alone
    reference: ClassVar[str] = (
        "Widenhorn et al., Temperature dependence of dark current in a CCD, Proc. SPIE 4669, 2002"
    )
    measures: ClassVar[frozenset[str]] = frozenset(
        {
            "level",
            "pixel_variance",
            "fixed_pixel_variance",
            "variance_spread",
            "kurtosis",
            "code_imbalance",
        }
    )
    grows_with_time: ClassVar[bool] = True
    confounders: ClassVar[str] = (
        "dsnu does not grow with time and is Gaussian; rts pixels jump; stuck pixels do not "
        "depend on time."
    )

    def apply(self, image: Image, exposure: Exposure) -> Image:
        """Add the dark charge of the hot pixels."""
        if not self.pixel_fraction:
            return image
        deviates = exposure.sensor.fixed("hot_pixels", exposure.grid, threads=exposure.threads)
        hot = deviates < ndtri(self.pixel_fraction)
        # Below the threshold the normal law's tail is uniform: it gives the height as well.
        tail = ndtr(deviates[hot].astype(np.float64)) / self.pixel_fraction
        made = image.copy()
        made[hot] -= self.mean_dn_per_s * exposure.exposure_time_s * np.log(tail)
        return made

    def contributions(self, point: OperatingPoint) -> Mapping[str, float]:
        """Return mean, shot noise and fixed variance p (2 - p) (mean T)^2 of the dark charge."""
        p, charge = self.pixel_fraction, self.mean_dn_per_s * point.exposure_time_s
        return {
            "level": p * charge,
            "pixel_variance": point.slope_dn * p * charge,
            "fixed_pixel_variance": p * (2 - p) * charge**2,
        }
