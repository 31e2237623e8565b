"""Impulses: rare spikes that hit one pixel of one frame."""

from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field
from scipy.special import ndtr, ndtri

from dsis.effects.effect import MOST_DN, Effect, Exposure, Image, OperatingPoint, Stage


class Impulse(Effect):
    """Rare one-off charges, cosmic rays say, exponentially distributed with the given mean.

    Q'(t, y, x) = Q(t, y, x) + h, h ~ Exp(mean_dn) with probability p = rate / 10^6, else 0.
    """

    kind: Literal["impulse"] = "impulse"
    per_megapixel_frame: Annotated[float, Field(ge=0, le=1e5, examples=[2000.0])]
    mean_dn: Annotated[float, Field(gt=0, le=MOST_DN, examples=[60.0])] = 500.0

    stage: ClassVar[Stage] = Stage.CHARGE
    rank: ClassVar[int] = -60
    reference: ClassVar[str] = (
        "Groom, Cosmic rays and other nonsense in astronomical CCD imagers, Experimental Astronomy "
        "14, 2002"
    )
    measures: ClassVar[frozenset[str]] = frozenset(
        {"level", "pixel_variance", "skewness", "kurtosis", "variance_spread"}
    )
    confounders: ClassVar[str] = (
        "rts and hot_pixels come back at the same pixels; heavy_tailed_read_noise is symmetric."
    )

    def apply(self, image: Image, exposure: Exposure) -> Image:
        """Add the charge of the pixels that are hit."""
        e, p = exposure, self.per_megapixel_frame / 1e6
        if not p:
            return image
        deviates = e.temporal.normal("impulse", e.grid, e.frame, e.threads)
        hit = deviates < ndtri(p)
        # Below the threshold the normal law's tail is uniform: it gives the height as well.
        tail = ndtr(deviates[hit].astype(np.float64)) / p
        made = image.copy()
        made[hit] -= self.mean_dn * np.log(tail)
        return made

    def contributions(self, point: OperatingPoint) -> Mapping[str, float]:
        """Return mean p h and variance p (2 - p) h^2 of the spikes."""
        del point
        p, h = self.per_megapixel_frame / 1e6, self.mean_dn
        return {"level": p * h, "pixel_variance": p * (2 - p) * h**2}
