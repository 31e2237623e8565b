"""Line settling: the read-out has not settled where lines begin, or end."""

from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from dsis.effects.effect import Effect, Exposure, Image, OperatingPoint, Stage

Edge = Literal["left", "right", "top", "bottom"]


class LineSettling(Effect):
    """Offset and gain that decay from an edge of the sensor, the same in all frames.

    v = Q (1 + g s) + o s with s = exp(-d / L), d the distance in pixels from the edge where the
    amplifier comes out of its pause: the `left` of rows that are read from there. Charge and its
    noise are scaled.
    """

    kind: Literal["line_settling"] = "line_settling"
    offset_dn: Annotated[float, Field(gt=-65536, lt=65536, examples=[20.0])] = 0.0
    gain_percent: Annotated[float, Field(gt=-100, lt=100, examples=[4.0])] = 0.0
    length_pixels: Annotated[float, Field(gt=0, examples=[5.0])]
    edge: Edge = "left"

    stage: ClassVar[Stage] = Stage.READ_OUT
    rank: ClassVar[int] = -190  # behind the gains of amplifiers, before the read noise
    reference: ClassVar[str] = "Janesick, Scientific Charge-Coupled Devices, SPIE Press, 2001"
    measures: ClassVar[frozenset[str]] = frozenset(
        {
            "level",
            "pixel_variance",
            "variance_spread",
            "kurtosis",
            "fixed_row_variance",
            "fixed_column_variance",
            "fixed_smooth_variance",
        }
    )
    confounders: ClassVar[str] = (
        "column_fpn and column_prnu are alike in all columns; shading is as wide as the sensor; "
        "amp_glow grows with exposure time."
    )

    def apply(self, image: Image, exposure: Exposure) -> Image:
        """Add the offset to what the gain has scaled, near the edge."""
        grid = exposure.grid
        (rows, columns), y, x = grid.sensor_shape, grid.row_numbers(), grid.column_numbers()
        distance = {"left": x, "right": columns - 1 - x, "top": y, "bottom": rows - 1 - y}[
            self.edge
        ]
        share = np.exp(-distance / self.length_pixels)
        gain = (1 + self.gain_percent / 100 * share).astype(np.float32)
        made: Image = image * gain + (self.offset_dn * share).astype(np.float32)
        return made

    def contributions(self, point: OperatingPoint) -> Mapping[str, float]:
        """Return what the decay makes of the mean level and of shot noise, over all pixels."""
        first, second = (self.mean_share((point.rows, point.columns), power) for power in (1, 2))
        gain = self.gain_percent / 100
        return {
            "level": (gain * point.signal_dn + self.offset_dn) * first,
            "pixel_variance": (2 * gain * first + gain**2 * second) * point.shot_variance_dn2,
        }

    def mean_share(self, shape: tuple[int, int], power: int = 1) -> float:
        """Return the mean of s to a power over a sensor of rows and columns: a geometric sum."""
        lines = shape[self.edge in ("left", "right")]
        fall = power / self.length_pixels
        return float(np.expm1(-lines * fall) / np.expm1(-fall)) / lines
