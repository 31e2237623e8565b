"""Saturation: a pixel holds so much charge and no more."""

from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field
from scipy.special import ndtr

from dsis.effects.effect import Effect, Exposure, Image, OperatingPoint, Stage


class Saturation(Effect):
    """Charge stops growing at the full well, below the white level.

    Q' = min(Q, full well), after shot noise: near the full well the variance falls to that of the
    read noise and the skew turns negative.
    """

    kind: Literal["saturation"] = "saturation"
    full_well_dn: Annotated[float, Field(gt=0, examples=[5010.0])]

    stage: ClassVar[Stage] = Stage.CHARGE
    draws: ClassVar[bool] = False
    reference: ClassVar[str] = "Janesick, Photon Transfer, SPIE Press, 2007"
    measures: ClassVar[frozenset[str]] = frozenset(
        {
            "level",
            "pixel_variance",
            "skewness",
            "kurtosis",
            "variance_spread",
            "code_imbalance",
        }
    )
    confounders: ClassVar[str] = (
        "Clipping at the white level has no read noise on top; nonlinearity bends long before."
    )

    def apply(self, image: Image, exposure: Exposure) -> Image:
        """Cut charge at the full well."""
        del exposure
        return np.minimum(image, np.float32(self.full_well_dn))

    def contributions(self, point: OperatingPoint) -> Mapping[str, float]:
        """Return mean and variance of a censored normal law less those of the whole."""
        sigma = np.sqrt(point.shot_variance_dn2)
        if not sigma:
            return {"level": min(self.full_well_dn - point.signal_dn, 0.0), "pixel_variance": 0.0}
        z = (self.full_well_dn - point.signal_dn) / sigma
        density, below = np.exp(-z * z / 2) / np.sqrt(2 * np.pi), ndtr(z)
        mean = -density + z * (1 - below)
        square = below - z * density + z * z * (1 - below)
        return {
            "level": float(sigma * mean),
            "pixel_variance": float(sigma**2 * (square - mean**2 - 1)),
        }
