"""Line settling: the read-out has not settled where lines begin, or end."""

from collections.abc import Mapping
from functools import lru_cache
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from dsis.effects.effect import Effect, Exposure, Image, OperatingPoint, Stage
from dsis.grid import PixelGrid
from dsis.lines import Line, settled

Edge = Literal["left", "right", "top", "bottom"]


class LineSettling(Effect):
    """Offset and gain that decay from an edge of the sensor, the same in all frames.

    v = Q (1 + g exp(-d / G)) + o exp(-d / L), d the distance in pixels from the edge where the
    amplifier comes out of its pause: the `left` of rows that are read from there. Charge and its
    noise are scaled. The gain may come to rest sooner or later than the clamp that holds the
    offset: `gain_length_pixels` is G; unless given, it is L, `length_pixels`.
    """

    kind: Literal["line_settling"] = "line_settling"
    offset_dn: Annotated[float, Field(gt=-65536, lt=65536, examples=[20.0])] = 0.0
    gain_percent: Annotated[float, Field(gt=-100, lt=100, examples=[4.0])] = 0.0
    length_pixels: Annotated[float, Field(gt=0, examples=[5.0])]
    gain_length_pixels: Annotated[float, Field(gt=0)] | None = None
    edge: Edge = "left"

    stage: ClassVar[Stage] = Stage.READ_OUT
    rank: ClassVar[int] = -190  # behind the gains of amplifiers, before the read noise
    draws: ClassVar[bool] = False
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
        return settled(image, *_decays(self, exposure.grid))

    @property
    def gain_length(self) -> float:
        """Pixels after which 1 / e is left of the gain."""
        return self.gain_length_pixels or self.length_pixels

    def contributions(self, point: OperatingPoint) -> Mapping[str, float]:
        """Return what the decay makes of the mean level and of shot noise, over all pixels."""
        shape, gain = (point.rows, point.columns), self.gain_percent / 100
        first, second = (self._mean_share(shape, self.gain_length / n) for n in (1, 2))
        return {
            "level": gain * point.signal_dn * first + self.mean_offset_dn(shape),
            "pixel_variance": (2 * gain * first + gain**2 * second) * point.shot_variance_dn2,
        }

    def mean_offset_dn(self, shape: tuple[int, int]) -> float:
        """Return the mean offset of a sensor of rows and columns, DN."""
        return self.offset_dn * self._mean_share(shape, self.length_pixels)

    def mean_gain(self, shape: tuple[int, int]) -> float:
        """Return the mean gain of a sensor of rows and columns."""
        return 1 + self.gain_percent / 100 * self._mean_share(shape, self.gain_length)

    def _mean_share(self, shape: tuple[int, int], length: float) -> float:
        """Return the mean of a decay over a sensor of rows and columns: a geometric sum."""
        lines = shape[self.edge in ("left", "right")]
        return float(np.expm1(-lines / length) / np.expm1(-1 / length)) / lines


@lru_cache(maxsize=16)
def _decays(effect: LineSettling, grid: PixelGrid) -> tuple[Line, Line]:
    """Return the gain and the offset, DN, of each line of a grid: the same in all frames."""
    (rows, columns), y, x = grid.sensor_shape, grid.row_numbers(), grid.column_numbers()
    distance = {"left": x, "right": columns - 1 - x, "top": y, "bottom": rows - 1 - y}[effect.edge]
    share, of_gain = (
        np.exp(-distance / length) for length in (effect.length_pixels, effect.gain_length)
    )
    gain = (1 + effect.gain_percent / 100 * of_gain).astype(np.float32)
    offset = (effect.offset_dn * share).astype(np.float32)
    for line in (gain, offset):
        line.flags.writeable = False
    return gain, offset
