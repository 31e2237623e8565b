"""Dark current: charge that collects without light."""

from collections.abc import Mapping
from operator import not_
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from dsis.effects.effect import MOST_DN, Effect, Exposure, Image, OperatingPoint, Stage

MOST_APART = 3.0  # standard deviation of a logarithm: more is no law of a sensor
_OF_PIXELS = frozenset({"fixed_pixel_variance", "variance_spread", "kurtosis"})


class DarkCurrent(Effect):
    """A dark signal that grows with the exposure time, alike in all pixels or log-normal over them.

    It has its shot noise. S'(y, x) = S(y, x) + d(y, x) T. Darks of two exposure times show the mean
    and the variance grow. In all pixels d is the same, or log-normal: d exp(s k(y, x) - s^2 / 2),
    k ~ N(0, 1) and fixed per sensor, s = `log_sigma`. The mean is d then too, and
    d sqrt(exp(s^2) - 1) its standard deviation over pixels, the dark current non-uniformity (DCNU).
    """

    kind: Literal["dark_current"] = "dark_current"
    dn_per_s: Annotated[float, Field(ge=0, le=MOST_DN, examples=[400.0])]
    log_sigma: Annotated[float, Field(ge=0, le=MOST_APART, exclude_if=not_)] = 0.0

    stage: ClassVar[Stage] = Stage.LIGHT
    rank: ClassVar[int] = 50  # after what acts on light alone
    draws: ClassVar[bool] = False  # its size, the mean, is the same on every sensor
    reference: ClassVar[str] = (
        "EMVA Standard 1288, release 3.1, section 7; Baer, A model for dark current "
        "characterization and simulation, Proc. SPIE 6068, 2006"
    )
    measures: ClassVar[frozenset[str]] = frozenset({"level", "pixel_variance"}) | _OF_PIXELS
    grows_with_time: ClassVar[bool] = True
    confounders: ClassVar[str] = (
        "A wrong black level does not grow with time; black_level_drift looks alike where "
        "exposures were recorded in the order of their times. Of hot_pixels there are few, each "
        "far brighter than most."
    )

    @property
    def changes(self) -> frozenset[str]:
        """Level and variance, and the pixels' own where they differ."""
        return self.measures if self.log_sigma else self.measures - _OF_PIXELS

    @property
    def drawn(self) -> bool:
        """Whether pixels differ."""
        return bool(self.log_sigma)

    def apply(self, image: Image, exposure: Exposure) -> Image:
        """Add the dark charge."""
        charge = self.dn_per_s * exposure.exposure_time_s
        if not self.log_sigma or not charge:
            return image + np.float32(charge)
        own = exposure.sensor.fixed("dark_current", exposure.grid, threads=exposure.threads)
        s = np.float32(self.log_sigma)
        made: Image = image + np.float32(charge) * np.exp(s * own - s * s / 2)
        return made

    def contributions(self, point: OperatingPoint) -> Mapping[str, float]:
        """Return d T for the level and its shot noise, and what differs between pixels."""
        charge = self.dn_per_s * point.exposure_time_s
        found = {"level": charge, "pixel_variance": point.slope_dn * charge}
        if self.log_sigma:
            found["fixed_pixel_variance"] = charge**2 * float(np.expm1(self.log_sigma**2))
        return found
