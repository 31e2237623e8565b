"""Periodic noise: interference at one spatial frequency."""

from collections.abc import Mapping
from functools import lru_cache
from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, field_validator

from dsis.cfa import Cfa
from dsis.compiled import kernel
from dsis.effects.effect import MOST_DN, Effect, Exposure, Image, OperatingPoint, Stage
from dsis.grid import PixelGrid

Frequency = Annotated[float, Field(ge=-0.5, le=0.5)]
_POINT = PixelGrid(1, 1, Cfa.MONO)
Line = NDArray[np.complex64]


class PeriodicNoise(Effect):
    """A sinusoid over the sensor, its phase new in each frame, the same at all signals.

    v(t, y, x) = S(y, x) + A cos(2 pi (u x + w y) + phi(t)), phi uniform; (u, w) = `frequency` in
    cycles per pixel, x first. It adds A^2 / 2 to the temporal variance, in one spectral bin.
    """

    kind: Literal["periodic_noise"] = "periodic_noise"
    amplitude_dn: Annotated[float, Field(ge=0, le=MOST_DN, examples=[2.0])]
    frequency: Annotated[tuple[Frequency, Frequency], Field(examples=[(0.21, 0.13)])]

    stage: ClassVar[Stage] = Stage.READ_OUT
    reference: ClassVar[str] = "Holst & Lomheim, CMOS/CCD Sensors and Camera Systems, SPIE, 2011"
    measures: ClassVar[frozenset[str]] = frozenset(
        {
            "pixel_variance",
            "row_variance",
            "column_variance",
            "frame_variance",
            "kurtosis",
            "correlation_0_1",
            "correlation_1_0",
            "correlation_1_1",
            "correlation_0_2",
            "correlation_2_0",
            "frame_correlation",
            "spectral_peak",
            "row_spectrum_peak",
            "variance_spread",
            "code_imbalance",
        }
    )
    confounders: ClassVar[str] = (
        "bistable_pattern has two phases only; line_flicker lies along columns and grows with the "
        "signal."
    )

    @field_validator("frequency")
    @classmethod
    def _not_constant(cls, value: tuple[float, float]) -> tuple[float, float]:
        if value == (0.0, 0.0):
            message = "is [0, 0], must not be: that is black_level_drift"
            raise ValueError(message)
        return value

    def apply(self, image: Image, exposure: Exposure) -> Image:
        """Add the wave of the frame."""
        grid, (u, w) = exposure.grid, self.frequency
        turn = float(exposure.temporal.uniform("periodic_noise", _POINT, exposure.frame)[0, 0])
        # cos(a + b) from rows and columns: one product per pixel instead of one cosine.
        planes = image.size // (grid.rows * grid.columns)
        return _with_wave(
            np.ascontiguousarray(image).reshape(grid.rows, -1),
            _down(w, grid),
            np.repeat(_along(u, turn, grid), planes),
            np.float32(self.amplitude_dn),
        ).reshape(image.shape)

    def contributions(self, point: OperatingPoint) -> Mapping[str, float]:
        """Return A^2 / 2, split between pixels and means of lines, and its covariances."""
        (u, w), variance = self.frequency, self.amplitude_dn**2 / 2
        in_row = (np.sinc(u * point.columns) / np.sinc(u)) ** 2
        in_column = (np.sinc(w * point.rows) / np.sinc(w)) ** 2
        return point.components(
            variance, variance * in_row, variance * in_column, variance * in_row * in_column
        )


@lru_cache(maxsize=16)
def _down(w: float, grid: PixelGrid) -> Line:
    """Return the wave of each row: the same in all frames."""
    down: Line = np.exp(2j * np.pi * w * grid.row_numbers()).astype(np.complex64).reshape(-1)
    down.flags.writeable = False
    return down


@lru_cache(maxsize=1024)
def _along(u: float, turn: float, grid: PixelGrid) -> Line:
    """Return the wave of each column in a frame: the same of all cameras with the same draws."""
    wave = np.exp(2j * np.pi * (u * grid.column_numbers() + turn))
    along: Line = wave.astype(np.complex64).reshape(-1)
    along.flags.writeable = False
    return along


@kernel
def _with_wave(image: Image, down: Line, along: Line, amplitude: np.float32) -> Image:
    """Return an image (row, sample) with the amplitude times the real part of down x along."""
    out = np.empty(image.shape, np.float32)
    cosine, sine = along.real.copy(), along.imag.copy()
    for y in range(image.shape[0]):
        line, into, real, imaginary = image[y], out[y], down[y].real, down[y].imag
        for x in range(into.size):
            into[x] = line[x] + (real * cosine[x] - imaginary * sine[x]) * amplitude
    return out
