"""Non-linearity: a smooth bend of the response."""

from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from dsis.compiled import kernel
from dsis.effects.effect import Effect, Exposure, Image, OperatingPoint, Stage


class Nonlinearity(Effect):
    """A quadratic bend between black and 85 % of full scale.

    v = Q + a Q (0.85 F - Q), F the full scale: the largest deviation from the straight line
    through black and 0.85 F, in the middle between them, is the given percentage of F. The
    variance follows the local gain squared, so the photon transfer curve bends twice as much.
    """

    kind: Literal["nonlinearity"] = "nonlinearity"
    # Beyond 15 % the response would fall again below full scale.
    percent_full_scale: Annotated[float, Field(ge=-15, le=15, examples=[1.0])]

    stage: ClassVar[Stage] = Stage.CHARGE
    rank: ClassVar[int] = 90
    draws: ClassVar[bool] = False
    reference: ClassVar[str] = "EMVA Standard 1288, release 3.1, section 6 (linearity)"
    measures: ClassVar[frozenset[str]] = frozenset({"level", "pixel_variance"})
    confounders: ClassVar[str] = (
        "Drift of the light looks alike where the light was not measured; dual_gain changes the "
        "variance without the mean; brighter_fatter leaves the mean straight."
    )

    def apply(self, image: Image, exposure: Exposure) -> Image:
        """Bend the response."""
        full_scale = exposure.read_out.full_scale_dn
        bend, end = np.float32(self._bend(full_scale)), np.float32(0.85 * full_scale)
        flat = np.ascontiguousarray(image).reshape(-1)
        return _bent(flat, bend, end, np.float32(full_scale)).reshape(image.shape)

    def contributions(self, point: OperatingPoint) -> Mapping[str, float]:
        """Return the shift of the mean, and what the local gain makes of shot noise."""
        bend, end = self._bend(point.full_scale_dn), 0.85 * point.full_scale_dn
        s, v = point.signal_dn, point.shot_variance_dn2
        gain = 1 + bend * (end - 2 * s)
        return {
            "level": bend * (s * (end - s) - v),
            "pixel_variance": v * (gain**2 - 1) + 2 * (bend * v) ** 2,
        }

    def _bend(self, full_scale_dn: float) -> float:
        """Return a, 1/DN: the parabola's top is p F above the line at 0.425 F."""
        return self.percent_full_scale / 100 * full_scale_dn / (0.425 * full_scale_dn) ** 2


@kernel
def _bent(signal: Image, bend: np.float32, end: np.float32, full_scale: np.float32) -> Image:
    """Return a signal with its bend; beyond full scale that of full scale."""
    out = np.empty_like(signal)
    for i in range(signal.size):
        own = min(signal[i], full_scale)
        out[i] = signal[i] + bend * own * (end - own)
    return out
