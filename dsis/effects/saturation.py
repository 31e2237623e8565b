"""Saturation: a pixel holds so much charge and no more."""

from collections.abc import Mapping
from operator import not_
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field
from scipy.special import ndtr

from dsis.effects.effect import MOST_DN, Effect, Exposure, Image, OperatingPoint, Stage

_OF_PIXELS = frozenset({"fixed_pixel_variance"})
_NODES, _WEIGHTS = np.polynomial.hermite_e.hermegauss(41)
_WEIGHTS = _WEIGHTS / _WEIGHTS.sum()
_LEAST_DN = 1e-6  # a limit that is less soft is hard, in single precision


class Saturation(Effect):
    """Charge stops growing at the full well, below the white level.

    Q' = min(Q, full well), after shot noise: near the full well the variance falls to that of the
    read noise and the skew turns negative. Where a pixel that fills up collects less and less, the
    limit is soft, of a softness k: Q' = full well - k ln(1 + exp((full well - Q) / k)). Pixels'
    full wells differ by a standard deviation of `spread_percent`, normal and fixed per sensor.
    """

    kind: Literal["saturation"] = "saturation"
    full_well_dn: Annotated[float, Field(gt=0, le=MOST_DN, examples=[5010.0])]
    softness_dn: Annotated[float, Field(ge=0, le=MOST_DN, exclude_if=not_)] = 0.0
    spread_percent: Annotated[float, Field(ge=0, le=20, exclude_if=not_)] = 0.0

    stage: ClassVar[Stage] = Stage.CHARGE
    draws: ClassVar[bool] = False  # its size, the mean, is the same on every sensor
    responds: ClassVar[bool] = True
    reference: ClassVar[str] = "Janesick, Photon Transfer, SPIE Press, 2007"
    measures: ClassVar[frozenset[str]] = (
        frozenset(
            {
                "level",
                "pixel_variance",
                "skewness",
                "kurtosis",
                "variance_spread",
                "code_imbalance",
            }
        )
        | _OF_PIXELS
    )
    confounders: ClassVar[str] = (
        "Clipping at the white level has no read noise on top; nonlinearity bends long before."
    )

    @property
    def changes(self) -> frozenset[str]:
        """The pixels' own only where they differ."""
        return self.measures if self.spread_percent else self.measures - _OF_PIXELS

    @property
    def drawn(self) -> bool:
        """Whether pixels differ."""
        return bool(self.spread_percent)

    def apply(self, image: Image, exposure: Exposure) -> Image:
        """Cut charge at the full well of each pixel."""
        full = np.asarray(np.float32(self.full_well_dn))
        if self.spread_percent:
            own = exposure.sensor.fixed("full_well", exposure.grid, threads=exposure.threads)
            full = full * np.maximum(1 + np.float32(self.spread_percent / 100) * own, 0)
        return self._limited(image, full)

    def _limited(self, image: Image, full: Image) -> Image:
        if self.softness_dn < _LEAST_DN:
            return np.minimum(image, full)
        k = np.float32(self.softness_dn)
        left: Image = full - k * np.logaddexp(np.float32(0), (full - image) / k)
        return left

    def contributions(self, point: OperatingPoint) -> Mapping[str, float]:
        """Return mean and variance of a censored normal law less those of the whole.

        Of a soft limit, which has no closed form, by Gauss-Hermite quadrature; so are the means
        over pixels whose full wells differ, and how far their levels do.
        """
        if not self.spread_percent:
            level, variance = self._censored(point, self.full_well_dn)
            return {"level": level, "pixel_variance": variance}
        wells = self.full_well_dn * (1 + self.spread_percent / 100 * _NODES)
        levels, variances = np.transpose([self._censored(point, float(one)) for one in wells])
        level = float(_WEIGHTS @ levels)
        return {
            "level": level,
            "pixel_variance": float(_WEIGHTS @ variances),
            "fixed_pixel_variance": float(_WEIGHTS @ (levels - level) ** 2),
        }

    def _censored(self, point: OperatingPoint, full: float) -> tuple[float, float]:
        """Return what one full well does to the mean and the variance of a pixel."""
        sigma = np.sqrt(point.shot_variance_dn2)
        if self.softness_dn:
            at = (point.signal_dn + sigma * _NODES).astype(np.float32)
            made = self._limited(at, np.asarray(np.float32(full))).astype(np.float64)
            made -= point.signal_dn
            mean = float(_WEIGHTS @ made)
            return mean, float(_WEIGHTS @ (made - mean) ** 2 - sigma**2)
        if not sigma:
            return min(full - point.signal_dn, 0.0), 0.0
        z = (full - point.signal_dn) / sigma
        density, below = np.exp(-z * z / 2) / np.sqrt(2 * np.pi), ndtr(z)
        mean = -density + z * (1 - below)
        square = below - z * density + z * z * (1 - below)
        return float(sigma * mean), float(sigma**2 * (square - mean**2 - 1))
