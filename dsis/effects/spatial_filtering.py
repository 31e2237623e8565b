"""Spatial filtering: the camera smooths its raw data."""

from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from dsis.cfa import Cfa
from dsis.effects.effect import Effect, Exposure, Image, OperatingPoint, Stage


class SpatialFiltering(Effect):
    """A fixed kernel over each pixel and its four nearest neighbours of the same colour.

    v'(p) = v(p) + f sum_n (v(n) - v(p)), after all read-out noise: two sites away in a mosaic, one
    on a monochrome sensor and in full planes. All noise, darks included, becomes correlated by
    2 f (1 - 4 f) / ((1 - 4 f)^2 + 4 f^2) at that lag.
    """

    kind: Literal["spatial_filtering"] = "spatial_filtering"
    fraction: Annotated[float, Field(ge=0, le=0.2, examples=[0.02])]

    stage: ClassVar[Stage] = Stage.CODE
    rank: ClassVar[int] = -50
    draws: ClassVar[bool] = False
    reference: ClassVar[str] = "EMVA Standard 1288, release 3.1 (no preprocessing in the camera)"
    measures: ClassVar[frozenset[str]] = frozenset(
        {
            "pixel_variance",
            "row_variance",
            "column_variance",
            "frame_variance",
            "correlation_0_1",
            "correlation_1_0",
            "correlation_1_1",
            "correlation_0_2",
            "correlation_2_0",
            "spectral_peak",
            "row_spectrum_peak",
            "variance_spread",
        }
    )
    confounders: ClassVar[str] = (
        "crosstalk leaves read noise and darks white and couples neighbours of other colours."
    )

    def apply(self, image: Image, exposure: Exposure) -> Image:
        """Smooth each colour in itself."""
        step = 1 if exposure.grid.cfa in {None, Cfa.MONO} else 2
        made, share = image.copy(), np.float32(self.fraction)
        flow = share * (image[:, step:] - image[:, :-step])
        made[:, :-step] += flow
        made[:, step:] -= flow
        flow = share * (image[step:] - image[:-step])
        made[:-step] += flow
        made[step:] -= flow
        return made

    def reach_pixels(self) -> int:
        """Return how far away a pixel may matter."""
        return 2

    def contributions(self, point: OperatingPoint) -> Mapping[str, float]:
        """Return what the kernel makes of all noise of one colour; lags count its own sites."""
        f, v = self.fraction, point.shot_variance_dn2 + point.read_variance_dn2
        kernel = dict.fromkeys([(0, 1), (0, -1), (1, 0), (-1, 0)], f) | {(0, 0): 1 - 4 * f}
        return point.filtered(v, kernel)  # rounding comes later and stays white
