"""Shading: light falls off from the centre of the sensor to its corners."""

from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from dsis.effects.effect import Effect, Exposure, Image, OperatingPoint, Stage


class Shading(Effect):
    """A fixed smooth fall-off of light, quadratic in the distance from the sensor's centre.

    S'(y, x) = S(y, x) (1 - f r^2 / R^2), r the distance from the centre and R the corner's. On a
    whole sensor the mean falls by f S / 3, for the mean of r^2 / R^2 is 1/3.
    """

    kind: Literal["shading"] = "shading"
    falloff_percent: Annotated[float, Field(ge=0, le=100, examples=[4.0])]

    stage: ClassVar[Stage] = Stage.LIGHT
    reference: ClassVar[str] = "EMVA Standard 1288, release 3.1 (homogeneity of the light)"
    measures: ClassVar[frozenset[str]] = frozenset(
        {
            "level",
            "pixel_variance",
            "variance_spread",
            "kurtosis",
            "fixed_smooth_variance",
        }
    )
    confounders: ClassVar[str] = (
        "prnu and line patterns are not smooth; amp_glow grows with the exposure time and is there "
        "in darkness."
    )

    def apply(self, image: Image, exposure: Exposure) -> Image:
        """Multiply by the light that reaches each pixel."""
        rows, columns = exposure.grid.sensor_shape
        y = exposure.grid.row_numbers() - (rows - 1) / 2
        x = exposure.grid.column_numbers() - (columns - 1) / 2
        share = (y**2 + x**2) / ((rows / 2) ** 2 + (columns / 2) ** 2)
        return image * (1 - self.falloff_percent / 100 * share).astype(np.float32)

    def contributions(self, point: OperatingPoint) -> Mapping[str, float]:
        """Return what mean and shot noise lose, and the variance of r^2 over the whole sensor."""
        f, h2, w2 = self.falloff_percent / 100, point.rows**2, point.columns**2
        lost = f * (h2 + w2 - 2) / (3 * (h2 + w2))
        surface = ((h2 - 1) * (h2 - 4) + (w2 - 1) * (w2 - 4)) / 180 / ((h2 + w2) / 4) ** 2
        return {
            "level": -lost * point.signal_dn,
            "pixel_variance": -lost * point.shot_variance_dn2,
            "fixed_smooth_variance": surface * (f * point.signal_dn) ** 2,
        }
