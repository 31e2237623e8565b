"""Fixed gains of rows and columns: one factor per line of the sensor, the same in all frames."""

from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from dsis.effects.effect import Effect, Exposure, Image, OperatingPoint, Stage


class RowPrnu(Effect):
    """Fixed Gaussian gains of mean 1, one per row, of the light that is collected.

    S'(y, x) = S(y, x) (1 + g(y)), g ~ N(0, sigma). The variance of the mean frame's row means grows
    with (sigma S)^2; the temporal variance keeps its mean, for shot noise follows S'.
    """

    kind: Literal["row_prnu"] = "row_prnu"
    sigma_percent: Annotated[float, Field(ge=0, lt=100, examples=[1.5])]

    stage: ClassVar[Stage] = Stage.LIGHT
    reference: ClassVar[str] = "EMVA Standard 1288, release 4.0 (row and column PRNU)"
    measures: ClassVar[frozenset[str]] = frozenset({"fixed_row_variance"})
    confounders: ClassVar[str] = (
        "row_fpn stays as the signal grows; shading is smooth; tap_mismatch of even and odd rows "
        "alternates."
    )

    def apply(self, image: Image, exposure: Exposure) -> Image:
        """Multiply each row by its gain."""
        gains = exposure.sensor.rows("row_prnu", exposure.grid)
        return image * _factors(gains, self.sigma_percent, (-1,) + (1,) * (image.ndim - 1))

    def contributions(self, point: OperatingPoint) -> Mapping[str, float]:
        """Return (sigma S)^2 for the fixed row variance."""
        return {"fixed_row_variance": _spread_dn2(self.sigma_percent, point)}


class ColumnPrnu(Effect):
    """Fixed Gaussian gains of mean 1, one per column, as of column amplifiers or a slit's edges.

    S'(y, x) = S(y, x) (1 + g(x)), g ~ N(0, sigma). The variance of the mean frame's column means
    grows with (sigma S)^2; the temporal variance keeps its mean, for shot noise follows S'.
    """

    kind: Literal["column_prnu"] = "column_prnu"
    sigma_percent: Annotated[float, Field(ge=0, lt=100, examples=[1.5])]

    stage: ClassVar[Stage] = Stage.LIGHT
    reference: ClassVar[str] = "EMVA Standard 1288, release 4.0 (row and column PRNU)"
    measures: ClassVar[frozenset[str]] = frozenset({"fixed_column_variance"})
    confounders: ClassVar[str] = (
        "column_fpn stays as the signal grows; shading is smooth; tap_mismatch of even and odd "
        "columns alternates."
    )

    def apply(self, image: Image, exposure: Exposure) -> Image:
        """Multiply each column by its gain."""
        gains = exposure.sensor.columns("column_prnu", exposure.grid)
        return image * _factors(gains, self.sigma_percent, (1, -1) + (1,) * (image.ndim - 2))

    def contributions(self, point: OperatingPoint) -> Mapping[str, float]:
        """Return (sigma S)^2 for the fixed column variance."""
        return {"fixed_column_variance": _spread_dn2(self.sigma_percent, point)}


def _factors(gains: Image, sigma_percent: float, shape: tuple[int, ...]) -> Image:
    return (np.float32(1) + np.float32(sigma_percent / 100) * gains).reshape(shape)


def _spread_dn2(sigma_percent: float, point: OperatingPoint) -> float:
    return (sigma_percent / 100 * point.signal_dn) ** 2
