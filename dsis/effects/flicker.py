"""Flicker: the light of the whole frame fluctuates."""

from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from dsis.cfa import Cfa
from dsis.effects.effect import Effect, Exposure, Image, OperatingPoint, Stage
from dsis.grid import PixelGrid

_POINT = PixelGrid(1, 1, Cfa.MONO)


class Flicker(Effect):
    """One Gaussian gain of the light per frame, independent from frame to frame.

    S'(t, y, x) = S(y, x) (1 + e(t)), e ~ N(0, sigma). The variance of frame means grows with
    (sigma S)^2, in all channels together; darks are still.
    """

    kind: Literal["flicker"] = "flicker"
    sigma_percent: Annotated[float, Field(ge=0, lt=30, examples=[0.3])]

    stage: ClassVar[Stage] = Stage.LIGHT
    reference: ClassVar[str] = "EMVA Standard 1288, release 3.1 (stability of the light source)"
    measures: ClassVar[frozenset[str]] = frozenset({"frame_variance"})
    confounders: ClassVar[str] = (
        "black_level_drift does not grow with the signal and is there in darks."
    )

    def apply(self, image: Image, exposure: Exposure) -> Image:
        """Multiply by the light of the frame."""
        one = exposure.temporal.rows("flicker", _POINT, exposure.frame)
        return image * np.float32(1 + self.sigma_percent / 100 * float(one[0]))

    def contributions(self, point: OperatingPoint) -> Mapping[str, float]:
        """Return (sigma S)^2 for the frame variance."""
        return {"frame_variance": (self.sigma_percent / 100 * point.signal_dn) ** 2}
