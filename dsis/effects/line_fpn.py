"""Fixed row and column patterns: one offset per line of the sensor, the same in all frames."""

from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from dsis.effects.effect import MOST_DN, Effect, Exposure, Image, OperatingPoint, Stage
from dsis.lines import moved


class RowFpn(Effect):
    """One fixed Gaussian offset per row, the same for all signals and channels.

    v(y, x) = S(y, x) + r(y), r ~ N(0, sigma). It adds sigma^2 to the variance of the mean frame's
    row means; temporal statistics do not see it.
    """

    kind: Literal["row_fpn"] = "row_fpn"
    sigma_dn: Annotated[float, Field(ge=0, le=MOST_DN, examples=[6.0])]

    stage: ClassVar[Stage] = Stage.READ_OUT
    reference: ClassVar[str] = (
        "D'Agostino & Webb, Three-dimensional analysis framework and measurement methodology for "
        "imaging system noise, Proc. SPIE 1488, 1991"
    )
    measures: ClassVar[frozenset[str]] = frozenset({"fixed_row_variance"})
    confounders: ClassVar[str] = (
        "row_noise is new in each frame; shading is smooth and grows with the signal; "
        "tap_mismatch grows with the signal."
    )

    def apply(self, image: Image, exposure: Exposure) -> Image:
        """Add the offset of each row."""
        offsets = exposure.sensor.rows("row_fpn", exposure.grid)
        return moved(image, np.float32(self.sigma_dn) * offsets.reshape(-1, 1))

    def contributions(self, point: OperatingPoint) -> Mapping[str, float]:
        """Return sigma^2 for the fixed row variance."""
        del point
        return {"fixed_row_variance": self.sigma_dn**2}


class ColumnFpn(Effect):
    """One fixed Gaussian offset per column, the same for all signals and channels.

    v(y, x) = S(y, x) + c(x), c ~ N(0, sigma). It adds sigma^2 to the variance of the mean frame's
    column means; temporal statistics do not see it.
    """

    kind: Literal["column_fpn"] = "column_fpn"
    sigma_dn: Annotated[float, Field(ge=0, le=MOST_DN, examples=[6.0])]

    stage: ClassVar[Stage] = Stage.READ_OUT
    reference: ClassVar[str] = (
        "El Gamal & Eltoukhy, CMOS image sensors, IEEE Circuits and Devices Magazine 21(3), 2005"
    )
    measures: ClassVar[frozenset[str]] = frozenset({"fixed_column_variance"})
    confounders: ClassVar[str] = (
        "column_noise is new in each frame; dsnu has no structure along columns; tap_mismatch "
        "grows with the signal."
    )

    def apply(self, image: Image, exposure: Exposure) -> Image:
        """Add the offset of each column."""
        offsets = exposure.sensor.columns("column_fpn", exposure.grid)
        return moved(image, np.float32(self.sigma_dn) * offsets.reshape(1, -1))

    def contributions(self, point: OperatingPoint) -> Mapping[str, float]:
        """Return sigma^2 for the fixed column variance."""
        del point
        return {"fixed_column_variance": self.sigma_dn**2}
