"""Line flicker: mains light seen through a rolling shutter."""

from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from dsis.cfa import Cfa
from dsis.effects.effect import Effect, Exposure, Image, OperatingPoint, Stage
from dsis.grid import PixelGrid

_POINT = PixelGrid(1, 1, Cfa.MONO)
_FRAMES = 2**32  # modulo which they are counted: those before the first come last


def _free(turns: object) -> bool:
    return turns is None


def _counted(frame: int) -> int:
    """Return the number of a frame, negative before the first one."""
    return frame - _FRAMES if frame >= _FRAMES // 2 else frame


class LineFlicker(Effect):
    """Sinusoidal bands in proportion to the signal, their phase another in each frame.

    S'(t, y, x) = S(y, x) (1 + d sin(2 pi c y / H + phi(t))): d the depth of modulation, (max - min)
    / (max + min), c cycles in the H rows of the sensor. Row means gain the variance (d S)^2 / 2.
    The phase is drawn anew for each frame; or, where the lamp and the frames keep their rates, it
    moves on by a share of a turn from frame to frame, from one that is drawn for each exposure.
    """

    kind: Literal["line_flicker"] = "line_flicker"
    depth_percent: Annotated[float, Field(ge=0, le=100, examples=[0.5])]
    cycles_per_frame: Annotated[float, Field(gt=0, examples=[3.3])]
    turns_per_frame: Annotated[
        Annotated[float, Field(ge=0, lt=1)] | None, Field(exclude_if=_free)
    ] = None

    stage: ClassVar[Stage] = Stage.LIGHT
    reference: ClassVar[str] = (
        "Sheinin, Schechner & Kutulakos, Computational imaging on the electric grid, CVPR 2017"
    )
    measures: ClassVar[frozenset[str]] = frozenset(
        {"row_variance", "frame_variance", "row_spectrum_peak"}
    )
    confounders: ClassVar[str] = (
        "row_noise does not grow with the signal and is white along columns; periodic_noise does "
        "not grow either."
    )

    def apply(self, image: Image, exposure: Exposure) -> Image:
        """Multiply each row by its light."""
        number = exposure.frame if self.turns_per_frame is None else 0
        turn = float(exposure.temporal.uniform("line_flicker", _POINT, number)[0, 0])
        if self.turns_per_frame is not None:
            turn += self.turns_per_frame * _counted(exposure.frame)
        height = exposure.grid.sensor_shape[0]
        phase = self.cycles_per_frame / height * exposure.grid.row_numbers() + turn
        gain = 1 + self.depth_percent / 100 * np.sin(2 * np.pi * phase)
        made: Image = image * gain.astype(np.float32)
        return made

    def contributions(self, point: OperatingPoint) -> Mapping[str, float]:
        """Return the bands' variance as row and frame variance: whole cycles leave the frame."""
        variance = (self.depth_percent / 100 * point.signal_dn) ** 2 / 2
        per_row = self.cycles_per_frame / point.rows
        in_mean = (np.sinc(self.cycles_per_frame) / np.sinc(per_row)) ** 2
        found = point.components(variance, variance, variance * in_mean, variance * in_mean)
        return {
            "row_variance": found["row_variance"],
            "frame_variance": found["frame_variance"],
        }
