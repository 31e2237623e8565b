"""Dark current: charge that collects without light."""

from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from dsis.effects.effect import Effect, Exposure, Image, OperatingPoint, Stage


class DarkCurrent(Effect):
    """A mean dark signal that grows with the exposure time, with its shot noise.

    S'(y, x) = S(y, x) + d T. Darks of two exposure times show the mean and the variance grow.
    """

    kind: Literal["dark_current"] = "dark_current"
    dn_per_s: Annotated[float, Field(ge=0, examples=[400.0])]

    stage: ClassVar[Stage] = Stage.LIGHT
    rank: ClassVar[int] = 50  # after what acts on light alone
    draws: ClassVar[bool] = False
    reference: ClassVar[str] = "EMVA Standard 1288, release 3.1, section 7"
    measures: ClassVar[frozenset[str]] = frozenset({"level", "pixel_variance"})
    grows_with_time: ClassVar[bool] = True
    confounders: ClassVar[str] = (
        "A wrong black level does not grow with time; black_level_drift looks alike where "
        "exposures were recorded in the order of their times."
    )

    def apply(self, image: Image, exposure: Exposure) -> Image:
        """Add the dark charge."""
        return image + np.float32(self.dn_per_s * exposure.exposure_time_s)

    def contributions(self, point: OperatingPoint) -> Mapping[str, float]:
        """Return d T for the level and its shot noise."""
        charge = self.dn_per_s * point.exposure_time_s
        return {"level": charge, "pixel_variance": point.slope_dn * charge}
