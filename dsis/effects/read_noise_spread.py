"""Spread of read noise: every pixel has its own read-noise level."""

from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from dsis.effects.effect import Effect, Exposure, Image, OperatingPoint, Stage


class ReadNoiseSpread(Effect):
    """The read noise's standard deviation is log-normal over pixels, fixed per sensor.

    sigma(y, x) = sigma exp(s k(y, x) - s^2), k ~ N(0, 1), s = `log_sigma`: the variance keeps its
    mean over pixels; its relative spread is exp(4 s^2) - 1.
    """

    kind: Literal["read_noise_spread"] = "read_noise_spread"
    log_sigma: Annotated[float, Field(ge=0, le=2, examples=[0.15])]

    stage: ClassVar[Stage] = Stage.READ_OUT
    rank: ClassVar[int] = -99  # scales what heavier tails have shaped
    reference: ClassVar[str] = (
        "Huang et al., Video-rate nanoscopy using sCMOS camera-specific single-molecule "
        "localization algorithms, Nature Methods 10, 2013"
    )
    measures: ClassVar[frozenset[str]] = frozenset(
        {"pixel_variance", "kurtosis", "variance_spread"}
    )
    confounders: ClassVar[str] = (
        "heavy_tailed_read_noise leaves every pixel's variance alike; rts pixels are few and jump."
    )
    reshapes: ClassVar[str] = "read_noise"

    def apply(self, image: Image, exposure: Exposure) -> Image:
        """Leave the image: the read noise itself is reshaped."""
        del exposure
        return image

    def reshape(self, deviates: Image, exposure: Exposure) -> Image:
        """Return the deviates times each pixel's own level."""
        own = exposure.sensor.fixed("read_noise_spread", exposure.grid)
        s = np.float32(self.log_sigma)
        scaled: Image = deviates * np.exp(s * own - s * s)
        return scaled

    def contributions(self, point: OperatingPoint) -> Mapping[str, float]:
        """Return the spread of the variance and the kurtosis of the mixture, 3 times as much."""
        share = point.read_variance_dn2 / point.variance_dn2
        spread = float(np.expm1(4 * self.log_sigma**2)) * share**2
        return {"pixel_variance": 0.0, "variance_spread": spread, "kurtosis": 3 * spread}
