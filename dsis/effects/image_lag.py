"""Image lag: charge of a frame stays behind and is read with the next."""

from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from dsis.effects.effect import Effect, Exposure, Image, OperatingPoint, Stage


class ImageLag(Effect):
    """A share of each frame's charge is read one frame later.

    Q'(t) = (1 - f) Q(t) + f Q(t - 1). A static scene keeps its mean; shot noise of successive
    frames is correlated by f (1 - f) / ((1 - f)^2 + f^2), and a moving scene trails.
    """

    kind: Literal["image_lag"] = "image_lag"
    fraction: Annotated[float, Field(ge=0, le=0.5, examples=[0.04])]

    stage: ClassVar[Stage] = Stage.CHARGE
    rank: ClassVar[int] = 20
    draws: ClassVar[bool] = False
    looks_back: ClassVar[bool] = True
    reference: ClassVar[str] = (
        "Fossum & Hondongwa, A review of the pinned photodiode for CCD and CMOS image sensors, "
        "IEEE J. Electron Devices Society 2, 2014"
    )
    measures: ClassVar[frozenset[str]] = frozenset(
        {"pixel_variance", "frame_correlation", "fixed_pixel_variance"}
    )
    confounders: ClassVar[str] = (
        "rts correlates a few pixels only; black_level_drift is common to the whole frame; a "
        "temporal filter of the camera correlates read noise too."
    )

    def apply(self, image: Image, exposure: Exposure) -> Image:
        """Mix with the frame before."""
        share = np.float32(self.fraction)
        return (np.float32(1) - share) * image + share * exposure.earlier(1)

    def contributions(self, point: OperatingPoint) -> Mapping[str, float]:
        """Return what two taps make of shot noise; the sample variance of T frames included."""
        f, v = self.fraction, point.shot_variance_dn2
        covariance = v * f * (1 - f)
        variance = v * ((1 - f) ** 2 + f**2 - 1)
        return {
            "pixel_variance": variance - 2 * covariance / point.frames,
            "fixed_pixel_variance": 2 * covariance / point.frames,  # does not average out
            "frame_correlation": covariance / (point.variance_dn2 + variance),
        }
