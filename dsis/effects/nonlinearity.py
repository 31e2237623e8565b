"""Non-linearity: a smooth bend of the response."""

from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from dsis.compiled import kernel
from dsis.effects.effect import Effect, Exposure, Image, OperatingPoint, Stage

_END = 0.85  # of full scale: where the straight line ends
_LOW = 1e-4  # of the line's length: what falls below only may be a law's steep beginning
_PARABOLA = 1.0
_LOGARITHM = 1e-6  # exponents as small are that of -u ln u, to float32
_NODES, _WEIGHTS = np.polynomial.hermite_e.hermegauss(41)
_WEIGHTS = _WEIGHTS / _WEIGHTS.sum()


class Nonlinearity(Effect):
    """A smooth bend between black and 85 % of full scale.

    With u = Q / (0.85 F), F the full scale, and an exponent k,
    v = Q + c u (1 - u^k) / k: a parabola where k = 1; its top moves towards black as k falls (a
    power law near 1; -u ln u at k = 0), and to the bright end as k grows (a knee). c makes the
    largest deviation from the straight line through black and 0.85 F the given percentage of F.
    The variance follows the local gain squared, so the photon transfer curve bends twice as much.
    """

    kind: Literal["nonlinearity"] = "nonlinearity"
    # Beyond 15 % a parabola would fall again below full scale.
    percent_full_scale: Annotated[float, Field(ge=-15, le=15, examples=[1.0])]
    exponent: Annotated[float, Field(ge=-0.9, le=30, exclude_if=_PARABOLA.__eq__)] = _PARABOLA

    stage: ClassVar[Stage] = Stage.CHARGE
    rank: ClassVar[int] = 90
    draws: ClassVar[bool] = False
    responds: ClassVar[bool] = True
    reference: ClassVar[str] = "EMVA Standard 1288, release 3.1, section 6 (linearity)"
    measures: ClassVar[frozenset[str]] = frozenset({"level", "pixel_variance"})
    confounders: ClassVar[str] = (
        "Drift of the light looks alike where the light was not measured; dual_gain changes the "
        "variance without the mean; brighter_fatter leaves the mean straight."
    )

    @model_validator(mode="after")
    def _rises(self) -> Self:
        """Refuse a response that falls somewhere between black and full scale."""
        k = self.exponent
        size = self.percent_full_scale / 100 / (_END * bend_peak(k))
        slopes = [1 + size * _slope(u, k) for u in (_LOW, 1 / _END)]
        if k != _PARABOLA and min(slopes) <= 0:
            message = (
                f"exponent is {k:g}, which does not go with percent_full_scale = "
                f"{self.percent_full_scale:g}: the response must rise up to full scale"
            )
            raise ValueError(message)
        return self

    def apply(self, image: Image, exposure: Exposure) -> Image:
        """Bend the response."""
        return self._bent(image, exposure.read_out.full_scale_dn)

    def _bent(self, image: Image, full_scale_dn: float) -> Image:
        """Return a signal with its bend, DN; beyond full scale that of full scale."""
        if self.exponent == _PARABOLA:
            full, end = np.float32(full_scale_dn), np.float32(_END * full_scale_dn)
            flat = np.ascontiguousarray(image).reshape(-1)
            bend = np.float32(self._bend(full_scale_dn))
            return _parabola(flat, bend, end, full).reshape(image.shape)
        size = self.percent_full_scale / 100 * full_scale_dn / bend_peak(self.exponent)
        u = np.clip(image, 0, full_scale_dn).astype(np.float64) / (_END * full_scale_dn)
        return image + (size * bend_shape(u, self.exponent)).astype(np.float32)

    def contributions(self, point: OperatingPoint) -> Mapping[str, float]:
        """Return the shift of the mean, and what the local gain makes of shot noise.

        Of a parabola in closed form; of another law, which has none, by Gauss-Hermite quadrature.
        """
        s, v = point.signal_dn, point.shot_variance_dn2
        if self.exponent != _PARABOLA:
            at = (s + np.sqrt(v) * _NODES).astype(np.float32)
            made = self._bent(at, point.full_scale_dn).astype(np.float64) - s
            mean = float(_WEIGHTS @ made)
            return {
                "level": mean,
                "pixel_variance": float(_WEIGHTS @ (made - mean) ** 2) - v,
            }
        bend, end = self._bend(point.full_scale_dn), _END * point.full_scale_dn
        gain = 1 + bend * (end - 2 * s)
        return {
            "level": bend * (s * (end - s) - v),
            "pixel_variance": v * (gain**2 - 1) + 2 * (bend * v) ** 2,
        }

    def _bend(self, full_scale_dn: float) -> float:
        """Return a, 1/DN: the parabola's top is p F above the line at 0.425 F."""
        return self.percent_full_scale / 100 * full_scale_dn / (0.425 * full_scale_dn) ** 2


def bend_shape(u: NDArray[np.float64], exponent: float) -> NDArray[np.float64]:
    """Return u (1 - u^k) / k, -u ln u where k is 0: 0 where u, which is not negative, is."""
    logs = np.log(u, out=np.zeros_like(u), where=u > 0)
    return -u * (np.expm1(exponent * logs) / exponent if abs(exponent) > _LOGARITHM else logs)


def bend_peak(exponent: float) -> float:
    """Return the largest u (1 - u^k) / k of u from 0 to 1: at u^k = 1 / (1 + k)."""
    at = np.exp(-np.log1p(exponent) / exponent if abs(exponent) > _LOGARITHM else -1.0)
    return float(at / (1 + exponent))


def _slope(u: float, exponent: float) -> float:
    """Return the slope of u (1 - u^k) / k."""
    if abs(exponent) <= _LOGARITHM:
        return float(-np.log(u) - 1)
    power = np.expm1(exponent * np.log(u))
    return float(-power / exponent - power - 1)


@kernel
def _parabola(signal: Image, bend: np.float32, end: np.float32, full_scale: np.float32) -> Image:
    """Return a signal with its bend; beyond full scale that of full scale."""
    out = np.empty_like(signal)
    for i in range(signal.size):
        own = min(signal[i], full_scale)
        out[i] = signal[i] + bend * own * (end - own)
    return out
