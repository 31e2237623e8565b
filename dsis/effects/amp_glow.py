"""Amplifier glow: light of the electronics, brightest at an edge or corner of the sensor."""

from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from dsis.effects.effect import MOST_DN, Effect, Exposure, Image, OperatingPoint, Stage

_PLACES = {
    "top_left": (0, 0),
    "top_right": (0, 1),
    "bottom_left": (1, 0),
    "bottom_right": (1, 1),
    "top": (0, None),
    "bottom": (1, None),
    "left": (None, 0),
    "right": (None, 1),
}


class AmpGlow(Effect):
    """A smooth glow that falls off exponentially from an edge or corner and grows with time.

    S'(y, x) = S(y, x) + g T exp(-r / L), r the distance from the place where it is brightest and
    L = `extent` of the sensor's longer side. It has shot noise and is there without light.
    """

    kind: Literal["amp_glow"] = "amp_glow"
    dn_per_s: Annotated[float, Field(ge=0, le=MOST_DN, examples=[1500.0])]
    place: Literal[
        "top_left",
        "top_right",
        "bottom_left",
        "bottom_right",
        "top",
        "bottom",
        "left",
        "right",
    ] = "top_left"
    extent: Annotated[float, Field(gt=0, le=10)] = 0.25

    stage: ClassVar[Stage] = Stage.LIGHT
    rank: ClassVar[int] = 50  # after what acts on light alone
    draws: ClassVar[bool] = False
    reference: ClassVar[str] = "Janesick, Scientific Charge-Coupled Devices, SPIE Press, 2001"
    measures: ClassVar[frozenset[str]] = frozenset(
        {
            "level",
            "pixel_variance",
            "variance_spread",
            "kurtosis",
            "fixed_pixel_variance",
            "fixed_row_variance",
            "fixed_column_variance",
            "fixed_smooth_variance",
            "fixed_correlation_0_1",
            "fixed_correlation_1_0",
            "code_imbalance",
        }
    )
    grows_with_time: ClassVar[bool] = True
    confounders: ClassVar[str] = (
        "dark_current is the same everywhere; shading grows with the light and vanishes in darks."
    )

    def apply(self, image: Image, exposure: Exposure) -> Image:
        """Add the glow."""
        grid = exposure.grid
        (rows, columns), (low, right) = grid.sensor_shape, _PLACES[self.place]
        y = 0.0 if low is None else np.abs(grid.row_numbers() + 0.5 - low * rows)
        x = 0.0 if right is None else np.abs(grid.column_numbers() + 0.5 - right * columns)
        glow = np.exp(-np.hypot(y, x) / (self.extent * max(rows, columns)))
        charge = self.dn_per_s * exposure.exposure_time_s * glow
        made: Image = image + charge.astype(np.float32)
        return made

    def contributions(self, point: OperatingPoint) -> Mapping[str, float]:
        """Return the mean of the glow and its shot noise; for a corner only where time is 0."""
        low, right = _PLACES[self.place]
        charge = self.dn_per_s * point.exposure_time_s
        if charge and low is not None and right is not None:
            return {}
        length = self.extent * max(point.rows, point.columns)
        side = point.columns if low is None else point.rows
        mean = charge * length / side * -np.expm1(-side / length)
        return {"level": mean, "pixel_variance": point.slope_dn * mean}
