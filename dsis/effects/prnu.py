"""Photo-response non-uniformity: every pixel has its own gain."""

from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from dsis.effects.effect import Effect, Exposure, Image, OperatingPoint, Stage
from dsis.lines import gained


class Prnu(Effect):
    """Fixed Gaussian gains of mean 1, one per pixel, of the light that is collected.

    S'(y, x) = S(y, x) (1 + k(y, x)), k ~ N(0, sigma). The mean frame's pixel variance grows with
    (sigma S)^2; the temporal variance keeps its mean, for shot noise follows S'.
    """

    kind: Literal["prnu"] = "prnu"
    sigma_percent: Annotated[float, Field(ge=0, lt=100, examples=[1.5])]

    stage: ClassVar[Stage] = Stage.LIGHT
    reference: ClassVar[str] = "EMVA Standard 1288, release 3.1, section 4"
    measures: ClassVar[frozenset[str]] = frozenset({"fixed_pixel_variance", "variance_spread"})
    confounders: ClassVar[str] = "dsnu stays as the signal grows; shading is smooth."

    def apply(self, image: Image, exposure: Exposure) -> Image:
        """Multiply each pixel by its gain."""
        gains = exposure.sensor.fixed("prnu", exposure.grid, threads=exposure.threads)
        return gained(image, gains, np.float32(self.sigma_percent / 100))

    def contributions(self, point: OperatingPoint) -> Mapping[str, float]:
        """Return (sigma S)^2 for the fixed pixel variance, its share for the shot variance."""
        spread = self.sigma_percent / 100
        return {
            "fixed_pixel_variance": (spread * point.signal_dn) ** 2,
            "variance_spread": (spread * point.shot_variance_dn2 / point.variance_dn2) ** 2,
        }
