"""Temporal row and column noise: one fresh offset per line and frame."""

from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from dsis.effects.effect import MOST_DN, Effect, Exposure, Image, OperatingPoint, Stage
from dsis.lines import moved


class RowNoise(Effect):
    """One fresh Gaussian offset per row and frame, the same for all signals and channels.

    v(t, y, x) = S(y, x) + r(t, y), r ~ N(0, sigma). It adds sigma^2 to the temporal variance of
    row means and nothing that a mean frame would show.
    """

    kind: Literal["row_noise"] = "row_noise"
    sigma_dn: Annotated[float, Field(ge=0, le=MOST_DN, examples=[6.0])]

    stage: ClassVar[Stage] = Stage.READ_OUT
    reference: ClassVar[str] = "Wei et al., A physics-based noise formation model (ELD), CVPR 2020"
    measures: ClassVar[frozenset[str]] = frozenset({"row_variance"})
    confounders: ClassVar[str] = (
        "line_flicker grows with the signal and has one frequency; pink_noise and row_banding "
        "correlate neighbouring rows."
    )

    def apply(self, image: Image, exposure: Exposure) -> Image:
        """Add the offset of each row."""
        offsets = exposure.temporal.rows("row_noise", exposure.grid, exposure.frame)
        return moved(image, np.float32(self.sigma_dn) * offsets.reshape(-1, 1))

    def contributions(self, point: OperatingPoint) -> Mapping[str, float]:
        """Return sigma^2 for the row variance."""
        del point
        return {"row_variance": self.sigma_dn**2}


class ColumnNoise(Effect):
    """One fresh Gaussian offset per column and frame, the same for all signals and channels.

    v(t, y, x) = S(y, x) + c(t, x), c ~ N(0, sigma). It adds sigma^2 to the temporal variance of
    column means and nothing that a mean frame would show.
    """

    kind: Literal["column_noise"] = "column_noise"
    sigma_dn: Annotated[float, Field(ge=0, le=MOST_DN, examples=[6.0])]

    stage: ClassVar[Stage] = Stage.READ_OUT
    reference: ClassVar[str] = "Wei et al., A physics-based noise formation model (ELD), CVPR 2020"
    measures: ClassVar[frozenset[str]] = frozenset({"column_variance"})
    confounders: ClassVar[str] = "column_fpn is the same in all frames: a mean frame shows it."

    def apply(self, image: Image, exposure: Exposure) -> Image:
        """Add the offset of each column."""
        offsets = exposure.temporal.columns("column_noise", exposure.grid, exposure.frame)
        return moved(image, np.float32(self.sigma_dn) * offsets.reshape(1, -1))

    def contributions(self, point: OperatingPoint) -> Mapping[str, float]:
        """Return sigma^2 for the column variance."""
        del point
        return {"column_variance": self.sigma_dn**2}
