"""Quantisation: codes coarser than one DN."""

from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from dsis.effects.effect import Effect, Exposure, Image, OperatingPoint, Stage


class Quantisation(Effect):
    """Codes come in steps: only whole multiples of a whole step occur, at both ends too.

    c = step min(round((v + black) / step), floor(white / step)); the converter then rounds what a
    fractional step gives to whole codes. Where the noise is wider than half a step the variance
    grows by (step^2 - 1) / 12, the finer rounding to whole codes having been there before.
    """

    kind: Literal["quantisation"] = "quantisation"
    step_dn: Annotated[float, Field(ge=1, examples=[4.0])]

    stage: ClassVar[Stage] = Stage.CODE
    rank: ClassVar[int] = 60
    draws: ClassVar[bool] = False
    reference: ClassVar[str] = "Widrow & Kollar, Quantization Noise, Cambridge, 2008"
    measures: ClassVar[frozenset[str]] = frozenset(
        {
            "level",
            "pixel_variance",
            "kurtosis",
            "skewness",
            "code_spacing",
            "code_imbalance",
            "variance_spread",
        }
    )
    confounders: ClassVar[str] = (
        "Every moment of narrow noise: judge codes first. adc_dnl uses all codes, unequally."
    )

    def apply(self, image: Image, exposure: Exposure) -> Image:
        """Round to whole steps, none of them above the white level."""
        black, step = np.float32(exposure.read_out.black_level_dn), np.float32(self.step_dn)
        top = np.float32(exposure.read_out.white_level_dn // self.step_dn)
        codes: Image = step * np.minimum(np.rint((image + black) / step), top)
        return codes - black

    def contributions(self, point: OperatingPoint) -> Mapping[str, float]:
        """Return Sheppard's variance, where it holds, and the spacing of whole steps."""
        stated = {}
        if self.step_dn.is_integer():
            stated["code_spacing"] = self.step_dn - 1
        if point.variance_dn2 > self.step_dn**2 / 2:  # beyond, Sheppard's is exact to 1e-4
            stated |= {"level": 0.0, "pixel_variance": (self.step_dn**2 - 1) / 12}
        return stated
