"""Quantisation: codes coarser than one DN."""

from collections.abc import Mapping
from math import floor
from operator import not_
from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from dsis.effects.effect import MOST_DN, Effect, Exposure, Image, OperatingPoint, ReadOut, Stage

_ROUNDED = 1e-9  # of a step: 4095 / 1.05 is 3900


class Quantisation(Effect):
    """Codes come in steps: only phase + n step occur, n = 0, 1 .., at both ends too.

    c = phase + step min(round((v + black - phase) / step), floor((white - phase) / step)), no code
    below the phase; what a fractional step gives is rounded to whole codes, halves to even: codes
    that were multiplied by a digital gain leave some out. The phase is 0 where codes are multiples
    of the step, and another where black, from which steps were counted, is none. It is below the
    step and alike in all channels. Where the noise is wider than half a step the variance grows by
    (step^2 - 1) / 12, the finer rounding to whole codes having been there before.
    """

    kind: Literal["quantisation"] = "quantisation"
    step_dn: Annotated[float, Field(ge=1, le=MOST_DN, examples=[4.0])]
    phase_dn: Annotated[float, Field(ge=0, le=MOST_DN, exclude_if=not_)] = 0.0

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

    @model_validator(mode="after")
    def _within_a_step(self) -> Self:
        if self.phase_dn >= self.step_dn:
            message = f"phase_dn is {self.phase_dn:g}, must be below step_dn = {self.step_dn:g}"
            raise ValueError(message)
        return self

    def unfit_for(self, read_out: ReadOut) -> str:
        """Return why a camera cannot have this effect: no code is as large as its phase."""
        white = read_out.white_level_dn
        if self.phase_dn <= white:
            return ""
        return f"phase_dn is {self.phase_dn:g}, must be at most white_level = {white:g}"

    def apply(self, image: Image, exposure: Exposure) -> Image:
        """Round to whole steps from the phase on, none of them above the white level."""
        black, step = np.float32(exposure.read_out.black_level_dn), np.float32(self.step_dn)
        phase = np.float32(self.phase_dn)
        white = exposure.read_out.white_level_dn
        top = np.float32(last_step(white, self.step_dn, self.phase_dn))
        number = np.clip(np.rint((image + black - phase) / step), np.float32(0), top)
        if self.step_dn.is_integer() and self.phase_dn.is_integer():
            return np.asarray(step * number + phase - black)
        return whole_codes(number, self.step_dn, self.phase_dn).astype(np.float32) - black

    def contributions(self, point: OperatingPoint) -> Mapping[str, float]:
        """Return Sheppard's variance, where it holds, and the spacing of whole steps."""
        stated = {}
        if self.step_dn.is_integer():
            stated["code_spacing"] = self.step_dn - 1
        if point.variance_dn2 > self.step_dn**2 / 2:  # beyond, Sheppard's is exact to 1e-4
            stated |= {"level": 0.0, "pixel_variance": (self.step_dn**2 - 1) / 12}
        return stated


def whole_codes(number: NDArray[np.floating], step: float, phase: float) -> NDArray[np.float64]:
    """Return the whole codes that steps of any size become, of how many: halves go to even."""
    codes: NDArray[np.float64] = np.rint(phase + step * number.astype(np.float64))
    return codes


def last_step(white_dn: float, step: float, phase: float) -> float:
    """Return how many steps from a phase on reach the white level, or stay just below it."""
    return floor((white_dn - phase) / step + _ROUNDED)
