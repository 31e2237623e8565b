"""Dark-signal non-uniformity: every pixel has its own offset."""

from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from dsis.effects.effect import MOST_DN, Effect, Exposure, Image, OperatingPoint, Stage
from dsis.lines import shifted


class Dsnu(Effect):
    """Fixed Gaussian offsets of mean 0, one per pixel, in darkness and light alike.

    v(y, x) = S(y, x) + o(y, x), o ~ N(0, sigma). The mean frame's pixel variance grows by sigma^2
    at every signal and exposure time.
    """

    kind: Literal["dsnu"] = "dsnu"
    sigma_dn: Annotated[float, Field(ge=0, le=MOST_DN, examples=[4.0])]

    stage: ClassVar[Stage] = Stage.READ_OUT
    reference: ClassVar[str] = "EMVA Standard 1288, release 3.1, section 4"
    measures: ClassVar[frozenset[str]] = frozenset({"fixed_pixel_variance"})
    confounders: ClassVar[str] = (
        "prnu grows with the signal, hot_pixels with the exposure time; column_fpn is common to a "
        "column."
    )

    def apply(self, image: Image, exposure: Exposure) -> Image:
        """Add the offset of each pixel."""
        offsets = exposure.sensor.fixed("dsnu", exposure.grid, threads=exposure.threads)
        return shifted(image, offsets, np.float32(self.sigma_dn))

    def contributions(self, point: OperatingPoint) -> Mapping[str, float]:
        """Return sigma^2 for the fixed pixel variance."""
        del point
        return {"fixed_pixel_variance": self.sigma_dn**2}
