"""Brighter-fatter effect: collected charge repels what is still to come."""

from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from dsis.effects.effect import Effect, Exposure, Image, OperatingPoint, Stage

_ALIKE = 0.0  # anisotropy: both axes are alike


class BrighterFatter(Effect):
    """Charge is shared with nearest neighbours in proportion to the charge that is there.

    Q'(p) = Q(p) + a sum_n (Q(n) + Q(p)) / 2 (Q(n) - Q(p)): at a mean signal S the share a S goes
    to each neighbour. A flat keeps its mean; covariances grow as 2 a m S^2 and the variance falls
    by 8 a m S^2. Neighbouring sites of a mosaic, of whatever colour, are coupled. Pixels
    are not bounded alike along both axes: a (1 + e) is the rate along rows, a (1 - e) that along
    columns, e the `anisotropy`.
    """

    kind: Literal["brighter_fatter"] = "brighter_fatter"
    per_dn: Annotated[float, Field(ge=0, le=1e-3, examples=[5e-6])]
    anisotropy: Annotated[float, Field(ge=-1, le=1, exclude_if=_ALIKE.__eq__)] = _ALIKE

    stage: ClassVar[Stage] = Stage.CHARGE
    rank: ClassVar[int] = -50
    draws: ClassVar[bool] = False
    responds: ClassVar[bool] = True
    reference: ClassVar[str] = (
        "Antilogus et al., The brighter-fatter effect and pixel correlations in CCD sensors, JINST "
        "9, 2014; Astier et al., The shape of the photon transfer curve, A&A 629, 2019; Guyonnet "
        "et al., Evidence for self-interaction of charge distribution in charge-coupled devices, "
        "A&A 575, 2015 (axes)"
    )
    measures: ClassVar[frozenset[str]] = frozenset(
        {
            "level",  # where neighbours are of another colour
            "pixel_variance",
            "row_variance",
            "column_variance",
            "frame_variance",
            "skewness",
            "kurtosis",
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
        "crosstalk's correlation does not grow with the signal; nonlinearity bends the mean and "
        "leaves no covariance."
    )

    def apply(self, image: Image, exposure: Exposure) -> Image:
        """Exchange charge between neighbouring sites."""
        del exposure
        return self.exchanged(image)

    def exchanged(self, image: Image) -> Image:
        """Return what becomes of the charge of neighbouring sites."""
        made, square = image.copy(), image * image
        for axis, rate in enumerate(self._rates):
            flow = np.diff(np.float32(rate / 2) * square, axis=axis)
            here, there = (
                (slice(None),) * axis + (slice(-1),),
                (slice(None),) * axis + (slice(1, None),),
            )
            made[here] += flow
            made[there] -= flow
        return made

    @property
    def _rates(self) -> tuple[float, float]:
        """Rates per DN along columns (from row to row) and along rows."""
        return self.per_dn * (1 - self.anisotropy), self.per_dn * (1 + self.anisotropy)

    def reach_pixels(self) -> int:
        """Return how far away a pixel may matter."""
        return 1

    def contributions(self, point: OperatingPoint) -> Mapping[str, float]:
        """Return what a share a S to each neighbour makes of shot noise (leading order in V)."""
        down, across = (rate * max(point.signal_dn, 0.0) for rate in self._rates)
        kernel = dict.fromkeys([(0, 1), (0, -1)], across) | dict.fromkeys([(1, 0), (-1, 0)], down)
        kernel[0, 0] = 1 - 2 * (across + down)
        return point.filtered(point.shot_variance_dn2, kernel) | {"level": 0.0}
