"""Channel imbalance: the two greens of a Bayer mosaic differ."""

from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from dsis.cfa import GREEN, RED, Cfa, pattern
from dsis.effects.effect import Effect, Exposure, Image, OperatingPoint, ReadOut, Stage


class ChannelImbalance(Effect):
    """Green pixels in rows with red collect more light than those in rows with blue.

    S' = S (1 + g / 2) at Gr and S (1 - g / 2) at Gb; red and blue stay. In full planes the green
    plane's rows follow the camera's colour filters.
    """

    kind: Literal["channel_imbalance"] = "channel_imbalance"
    gain_percent: Annotated[float, Field(gt=-100, lt=100, examples=[2.0])]

    stage: ClassVar[Stage] = Stage.LIGHT
    draws: ClassVar[bool] = False
    reference: ClassVar[str] = "Hirakawa, Cross-talk explained, IEEE ICIP 2008"
    measures: ClassVar[frozenset[str]] = frozenset({"level", "pixel_variance"})
    confounders: ClassVar[str] = (
        "row_fpn does not grow with the signal; tap_mismatch of even and odd rows changes red and "
        "blue too."
    )

    def apply(self, image: Image, exposure: Exposure) -> Image:
        """Scale the greens."""
        colours = pattern(exposure.grid.cfa or exposure.read_out.cfa)
        with_red = (colours == RED).any(1)[exposure.grid.row_numbers() % 2]
        half = self.gain_percent / 200
        gain = np.where(with_red, 1 + half, 1 - half).astype(np.float32)
        if exposure.grid.cfa is None:
            green = np.arange(image.shape[2]) == GREEN
        else:
            y, x = exposure.grid.row_numbers(), exposure.grid.column_numbers()
            green = colours[y % 2, x % 2] == GREEN
        return np.where(green, image * gain, image)

    def unfit_for(self, read_out: ReadOut) -> str:
        """Refuse a camera without greens."""
        return "needs a Bayer mosaic, but cfa is MONO" if read_out.cfa is Cfa.MONO else ""

    def contributions(self, point: OperatingPoint) -> Mapping[str, float]:
        """Return what Gr gains; Gb loses as much."""
        half = self.gain_percent / 200
        return {
            "level": half * point.signal_dn,
            "pixel_variance": half * point.shot_variance_dn2,
        }
