"""Bistable pattern: a fixed pattern whose sign flips from frame to frame."""

from collections.abc import Mapping
from functools import lru_cache
from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, field_validator

from dsis.cfa import Cfa
from dsis.effects.effect import MOST_DN, Effect, Exposure, Image, OperatingPoint, Stage
from dsis.grid import PixelGrid
from dsis.lines import shifted

Frequency = Annotated[float, Field(ge=-0.5, le=0.5)]
_POINT = PixelGrid(1, 1, Cfa.MONO)


class BistablePattern(Effect):
    """A cosine pattern of fixed phase, multiplied by a random sign in each frame.

    v(t, y, x) = S(y, x) + s(t) A cos(2 pi (u x + w y)), s = -1 or 1 with equal chance; (u, w) =
    `frequency` in cycles per pixel, x first: (0.5, 0.5) is a checkerboard, (0.5, 0) are stripes.
    It adds A^2 to the temporal variance where u and w are 0 or 0.5, else A^2 / 2. A is half the
    peak to peak only where the sampled cosine reaches -1 and 1, as it does for 0.5; at other
    frequencies samples may miss the crests (u = 1/3: 1 and -1/2).
    """

    kind: Literal["bistable_pattern"] = "bistable_pattern"
    amplitude_dn: Annotated[float, Field(ge=0, le=MOST_DN, examples=[1.5])]
    frequency: Annotated[tuple[Frequency, Frequency], Field(examples=[(0.5, 0.5)])]

    stage: ClassVar[Stage] = Stage.READ_OUT
    reference: ClassVar[str] = "Holst & Lomheim, CMOS/CCD Sensors and Camera Systems, SPIE, 2011"
    measures: ClassVar[frozenset[str]] = frozenset(
        {
            "pixel_variance",
            "row_variance",
            "column_variance",
            "frame_variance",
            "kurtosis",
            "correlation_0_1",
            "correlation_1_0",
            "correlation_1_1",
            "correlation_0_2",
            "correlation_2_0",
            "frame_correlation",
            "spectral_peak",
            "row_spectrum_peak",
            "variance_spread",
            "code_imbalance",
        }
    )
    confounders: ClassVar[str] = (
        "periodic_noise takes every phase; projected on the pattern, frames form two heaps."
    )

    @field_validator("frequency")
    @classmethod
    def _not_constant(cls, value: tuple[float, float]) -> tuple[float, float]:
        if value == (0.0, 0.0):
            message = "is [0, 0], must not be: that is no pattern"
            raise ValueError(message)
        return value

    def apply(self, image: Image, exposure: Exposure) -> Image:
        """Add the pattern with the frame's sign."""
        draw = exposure.temporal.uniform("bistable_pattern", _POINT, exposure.frame)[0, 0]
        sign = np.float32(1 if draw < 0.5 else -1)
        pattern = _cosine(exposure.grid, self.frequency)
        if pattern.shape != image.shape:  # one for all channels
            return image + sign * np.float32(self.amplitude_dn) * pattern
        return shifted(image, pattern, sign * np.float32(self.amplitude_dn))

    def contributions(self, point: OperatingPoint) -> Mapping[str, float]:
        """Return the pattern's variance, split between pixels and means of lines and frame."""
        u, w = self.frequency
        turns = u * np.arange(point.columns) + w * np.arange(point.rows)[:, np.newaxis]
        pattern = self.amplitude_dn * np.cos(2 * np.pi * turns)
        return point.components(
            float((pattern**2).mean()),
            float((pattern.mean(1) ** 2).mean()),
            float((pattern.mean(0) ** 2).mean()),
            float(pattern.mean() ** 2),
        )


@lru_cache(maxsize=4)
def _cosine(grid: PixelGrid, frequency: tuple[float, float]) -> NDArray[np.float32]:
    """Return cos(2 pi (u x + w y)): the same in all frames, and most of the effect's time."""
    u, w = frequency
    turns = u * grid.column_numbers() + w * grid.row_numbers()
    pattern: NDArray[np.float32] = np.cos(2 * np.pi * turns).astype(np.float32)
    pattern.flags.writeable = False
    return pattern
