"""Crosstalk: charge leaks to neighbouring pixels after it was collected."""

from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from dsis.effects.effect import Effect, Exposure, Image, OperatingPoint, Stage


class Crosstalk(Effect):
    """Each pixel loses a fixed share of its charge to each nearest neighbour and gains as much.

    Q'(p) = Q(p) + f sum_n (Q(n) - Q(p)) over the neighbours n along rows and columns, or along one
    of them; none leaves the array. Shot noise of neighbouring sites, of whatever colour, becomes
    correlated by 2 f (1 - 4 f) / ((1 - 4 f)^2 + 4 f^2) at all signals; read noise stays white.
    """

    kind: Literal["crosstalk"] = "crosstalk"
    fraction: Annotated[float, Field(gt=0, le=0.2, examples=[0.02])]
    along: Literal["both", "rows", "columns"] = "both"

    stage: ClassVar[Stage] = Stage.CHARGE
    rank: ClassVar[int] = -20
    draws: ClassVar[bool] = False
    responds: ClassVar[bool] = True
    reference: ClassVar[str] = (
        "Moore, Ninkov & Forrest, Quantum efficiency overestimation and deterministic cross talk "
        "resulting from interpixel capacitance, Optical Engineering 45, 2006"
    )
    measures: ClassVar[frozenset[str]] = frozenset(
        {
            "level",  # where neighbours are of another colour
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
        "brighter_fatter's correlation grows with the signal; spatial_filtering correlates darks "
        "too, and only sites of one colour."
    )

    def apply(self, image: Image, exposure: Exposure) -> Image:
        """Exchange charge between neighbouring sites."""
        del exposure
        return self.exchanged(image)

    def exchanged(self, image: Image) -> Image:
        """Return what becomes of the charge of neighbouring sites."""
        made, share = image.copy(), np.float32(self.fraction)
        if self.along != "columns":
            flow = share * (image[:, 1:] - image[:, :-1])
            made[:, :-1] += flow
            made[:, 1:] -= flow
        if self.along != "rows":
            flow = share * (image[1:] - image[:-1])
            made[:-1] += flow
            made[1:] -= flow
        return made

    def reach_pixels(self) -> int:
        """Return how far away a pixel may matter."""
        return 1

    def contributions(self, point: OperatingPoint) -> Mapping[str, float]:
        """Return what the kernel makes of white shot noise under light alike for all colours."""
        f, kernel = self.fraction, {(0, 0): 1.0}
        for neighbours, here in (
            (((0, 1), (0, -1)), self.along != "columns"),
            (((1, 0), (-1, 0)), self.along != "rows"),
        ):
            if here:
                kernel |= dict.fromkeys(neighbours, f)
                kernel[0, 0] -= 2 * f
        return point.filtered(point.shot_variance_dn2, kernel) | {"level": 0.0}
