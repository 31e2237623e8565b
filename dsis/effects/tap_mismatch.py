"""Tap mismatch: regions of the sensor are read by different amplifiers."""

from collections.abc import Mapping
from math import ceil
from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from dsis.effects.effect import Effect, Exposure, Image, OperatingPoint, Stage

_MIDDLE = 0.5


class TapMismatch(Effect):
    """Two amplifiers of unequal gain read two regions of the sensor.

    v = Q (1 - g (1 - s)) in the first region and Q (1 + g s) in the second, where s is the share of
    the first: the mean gain is 1. Regions are the even and odd columns or rows (s = 1/2), or a left
    and a right, an upper and a lower part that meet at the seam, a share of all columns or rows:
    halves unless it is given. Charge and its noise are scaled.
    """

    kind: Literal["tap_mismatch"] = "tap_mismatch"
    gain_percent: Annotated[float, Field(gt=-100, lt=100, examples=[1.0])]
    regions: Literal["left_right", "top_bottom", "even_odd_columns", "even_odd_rows"] = "left_right"
    seam: Annotated[float, Field(gt=0, lt=1, exclude_if=_MIDDLE.__eq__)] = _MIDDLE

    stage: ClassVar[Stage] = Stage.READ_OUT
    rank: ClassVar[int] = -200  # before the read noise of the amplifier
    draws: ClassVar[bool] = False
    responds: ClassVar[bool] = True
    reference: ClassVar[str] = "Janesick, Scientific Charge-Coupled Devices, SPIE Press, 2001"
    measures: ClassVar[frozenset[str]] = frozenset(
        {
            "level",  # of a colour that one amplifier reads alone
            "pixel_variance",
            "variance_spread",
            "kurtosis",
            "fixed_row_variance",
            "fixed_column_variance",
            "fixed_smooth_variance",
        }
    )
    confounders: ClassVar[str] = (
        "column_fpn and row_fpn do not grow with the signal; shading has no step at the seam."
    )

    def apply(self, image: Image, exposure: Exposure) -> Image:
        """Scale each region by its amplifier's gain."""
        grid, share = exposure.grid, _MIDDLE
        (rows, columns), y, x = grid.sensor_shape, grid.row_numbers(), grid.column_numbers()
        match self.regions:
            case "left_right":
                second, share = self._parts(x, columns)
            case "top_bottom":
                second, share = self._parts(y, rows)
            case "even_odd_columns":
                second = x % 2 == 1
            case "even_odd_rows":
                second = y % 2 == 1
        gain = self.gain_percent / 100
        return image * np.where(
            second, np.float32(1 + gain * share), np.float32(1 - gain * (1 - share))
        )

    def _parts(self, line: NDArray[np.integer], lines: int) -> tuple[NDArray[np.bool_], float]:
        """Return which lines are of the second part, and the share of all that are of the first."""
        first = ceil(self.seam * lines)
        return line >= first, first / lines

    def contributions(self, point: OperatingPoint) -> Mapping[str, float]:
        """Return what two gains make of shot noise, on average, where both read all colours."""
        share = self.seam if self.regions in ("left_right", "top_bottom") else _MIDDLE
        parts = share * (1 - share)
        return {
            "level": 0.0,
            "pixel_variance": parts * (self.gain_percent / 100) ** 2 * point.shot_variance_dn2,
        }
