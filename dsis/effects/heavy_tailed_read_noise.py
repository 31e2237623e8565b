"""Heavy-tailed read noise: large deviations are commoner than a normal law has them."""

from collections.abc import Mapping
from functools import lru_cache
from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from scipy.special import ndtr, stdtrit

from dsis.compiled import kernel
from dsis.effects.effect import Effect, Exposure, Image, OperatingPoint, Stage

# The field's largest deviate is 6.7; between knots 2^-11 apart a straight line is off by 1e-5.
_KNOTS_PER_SIGMA, _SIGMAS = 2048, 7


class HeavyTailedReadNoise(Effect):
    """Read noise follows Student's t of the base model's variance, in every pixel alike.

    n = sigma sqrt((k - 2) / k) t, t ~ Student(k), k = `tail_df`: excess kurtosis 6 / (k - 4). The
    value is the quantile of the base model's own normal deviate.
    """

    kind: Literal["heavy_tailed_read_noise"] = "heavy_tailed_read_noise"
    tail_df: Annotated[float, Field(gt=2, examples=[12.0])]

    stage: ClassVar[Stage] = Stage.READ_OUT
    rank: ClassVar[int] = -100
    reference: ClassVar[str] = "Wei et al., A physics-based noise formation model (ELD), CVPR 2020"
    measures: ClassVar[frozenset[str]] = frozenset({"kurtosis", "variance_spread"})
    confounders: ClassVar[str] = (
        "read_noise_spread and rts are properties of single pixels: their variance maps persist "
        "from exposure to exposure; coarse codes fake kurtosis."
    )
    reshapes: ClassVar[str] = "read_noise"

    def apply(self, image: Image, exposure: Exposure) -> Image:
        """Leave the image: the read noise itself is reshaped."""
        del exposure
        return image

    def reshape(self, deviates: Image, exposure: Exposure) -> Image:
        """Return the quantiles of Student's t, scaled to variance 1, of normal deviates."""
        del exposure
        out = np.empty_like(deviates, order="C")
        table = _upper_half(self.tail_df)
        _interpolate(np.ascontiguousarray(deviates).reshape(-1), table, out.reshape(-1))
        return out

    def contributions(self, point: OperatingPoint) -> Mapping[str, float]:
        """Return the read noise's share of 6 / (k - 4), which exists for k > 4."""
        if self.tail_df <= 4:
            return {}
        share = point.read_variance_dn2 / point.variance_dn2
        return {"kurtosis": 6 / (self.tail_df - 4) * share**2}


@lru_cache(maxsize=8)
def _upper_half(tail_df: float) -> NDArray[np.float32]:
    """Return t of variance 1 at the normal deviates 0, 1 / 2048 .. 7."""
    knots = np.arange(_KNOTS_PER_SIGMA * _SIGMAS + 1) / _KNOTS_PER_SIGMA
    scale = np.sqrt((tail_df - 2) / tail_df)
    # The lower half, for its tail is exact where 1 - p is not.
    table: NDArray[np.float32] = (-scale * stdtrit(tail_df, ndtr(-knots))).astype(np.float32)
    return table


@kernel
def _interpolate(
    deviates: NDArray[np.float32], table: NDArray[np.float32], out: NDArray[np.float32]
) -> None:
    for i in range(deviates.size):
        place = abs(deviates[i]) * np.float32(_KNOTS_PER_SIGMA)
        knot = min(int(place), table.size - 2)
        size = table[knot] + (place - np.float32(knot)) * (table[knot + 1] - table[knot])
        out[i] = size if deviates[i] >= 0 else -size
