"""Drift of the black level: the offset of the whole frame wanders."""

from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from dsis.cfa import Cfa
from dsis.effects.effect import MOST_DN, Effect, Exposure, Image, OperatingPoint, Stage
from dsis.grid import PixelGrid


class BlackLevelDrift(Effect):
    """One Gaussian offset per frame, for all signals, channels and darks alike.

    v(t, y, x) = S(y, x) + b(t), b(t) = rho b(t - 1) + sqrt(1 - rho^2) n(t): an autoregressive
    walk of standard deviation sigma and correlation rho (`persistence`); rho 0 is white.
    """

    kind: Literal["black_level_drift"] = "black_level_drift"
    sigma_dn: Annotated[float, Field(ge=0, le=MOST_DN, examples=[6.0])]
    persistence: Annotated[float, Field(ge=0, lt=1)] = 0.0

    stage: ClassVar[Stage] = Stage.READ_OUT
    reference: ClassVar[str] = "EMVA Standard 1288, release 3.1 (stability of the dark signal)"
    measures: ClassVar[frozenset[str]] = frozenset({"frame_variance"})
    confounders: ClassVar[str] = "flicker grows with the signal and vanishes in darks."

    def apply(self, image: Image, exposure: Exposure) -> Image:
        """Add the offset of the frame."""
        # Time runs along the columns of one row: the walk can start anywhere.
        time = PixelGrid(1, exposure.frame + 1, Cfa.MONO)
        steps = exposure.temporal.columns("black_level_drift", time).astype(np.float64)
        weights = np.sqrt(1 - self.persistence**2) * self.persistence ** np.arange(steps.size)
        weights[-1] = self.persistence ** (steps.size - 1)  # frame 0 has the walk's own spread
        return image + np.float32(self.sigma_dn * float((weights * steps[::-1]).sum()))

    def contributions(self, point: OperatingPoint) -> Mapping[str, float]:
        """Return the variance of the frame means about the mean of `frames` of them."""
        k = np.arange(1, point.frames)
        rho_sum = float(((point.frames - k) * self.persistence**k).sum())
        within = 1 - 2 * rho_sum / (point.frames * (point.frames - 1))
        return {"frame_variance": self.sigma_dn**2 * within}
