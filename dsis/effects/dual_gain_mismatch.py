"""Dual-gain mismatch: the gains of two read-out paths disagree."""

from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from dsis.effects.effect import Effect, Exposure, Image, OperatingPoint, ReadOut, Stage


class DualGainMismatch(Effect):
    """Above the switch between read-out segments the gain is off: the mean steps there, or kinks.

    v' = v (1 + e) where the expected signal selects any segment but the first, which sets the
    scale; the noise of that path is scaled with it. Where offsets are set such that both paths
    read the same at the switch s, the mean kinks: v' = v (1 + e) - e s.
    """

    kind: Literal["dual_gain_mismatch"] = "dual_gain_mismatch"
    gain_error_percent: Annotated[float, Field(gt=-50, lt=50, examples=[1.0])]
    mean: Annotated[Literal["steps", "kinks"], Field(exclude_if=lambda mean: mean == "steps")] = (
        "steps"
    )

    stage: ClassVar[Stage] = Stage.READ_OUT
    rank: ClassVar[int] = -50  # the path's amplifier scales its read noise; lines come later
    draws: ClassVar[bool] = False
    responds: ClassVar[bool] = True
    reference: ClassVar[str] = (
        "Seybold et al., CIC 22, 2014, section 'Camera noise characteristics' (dual-gain read-out)"
    )
    measures: ClassVar[frozenset[str]] = frozenset({"level", "pixel_variance"})
    confounders: ClassVar[str] = (
        "nonlinearity is smooth; a wrong switch level moves the step of the variance and leaves "
        "the mean straight."
    )

    def apply(self, image: Image, exposure: Exposure) -> Image:
        """Scale what the upper paths read."""
        switch = exposure.read_out.segments.lower_dn[1]
        gain = np.float32(1 + self.gain_error_percent / 100)
        offset = np.float32(self._offset_dn(switch))
        return np.where(exposure.expected_dn >= switch, image * gain - offset, image)

    def _offset_dn(self, switch_dn: float) -> float:
        """Return by how much the second path reads less than its gain alone says."""
        return self.gain_error_percent / 100 * switch_dn if self.mean == "kinks" else 0.0

    def unfit_for(self, read_out: ReadOut) -> str:
        """Refuse a camera with one read-out path."""
        single = read_out.segments.lower_dn.size < 2
        return "needs a second [[noise.segment]]" if single else ""

    def contributions(self, point: OperatingPoint) -> Mapping[str, float]:
        """Return e S, or e (S - s), and ((1 + e)^2 - 1) V above the switch s, nothing below."""
        if not point.segment:
            return {"level": 0.0, "pixel_variance": 0.0}
        e = self.gain_error_percent / 100
        noise = point.shot_variance_dn2 + point.read_variance_dn2
        level = e * point.signal_dn - self._offset_dn(point.segment_from_dn)
        return {"level": level, "pixel_variance": ((1 + e) ** 2 - 1) * noise}
