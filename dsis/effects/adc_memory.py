"""Memory of the converter: a conversion carries over the residue of the one before."""

from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from dsis.compiled import inlined, kernel
from dsis.effects.effect import Effect, Exposure, Image, Stage


class AdcMemory(Effect):
    """A conversion carries over some of the residue that the one before left in the converter.

    v'(i) = v(i) + d (frac((v(i - 1) + black - c) / P) - 1/2). Converters of several steps
    (pipeline, sub-ranging) take a coarse decision off the sample and amplify the residue, which
    rises over P codes and falls back by one step at c + n P; capacitors shared between samples, or
    not reset, keep a part of it. d is what the step makes of the next sample of the line, in DN:
    the correlation with it is negative where the noise straddles a step (d > 0) and slightly
    positive between. The first sample of a line has the last of it before it.
    """

    kind: Literal["adc_memory"] = "adc_memory"
    step_dn: Annotated[float, Field(gt=-100, lt=100, examples=[0.4])]
    period_codes: Annotated[int, Field(ge=4, le=32768, examples=[128])]
    at_code: Annotated[float, Field(gt=-65536, lt=65536, examples=[12.0])]
    along: Literal["rows", "columns"] = "rows"

    stage: ClassVar[Stage] = Stage.READ_OUT
    rank: ClassVar[int] = 90  # what the converter is given
    draws: ClassVar[bool] = False
    reference: ClassVar[str] = (
        "Chiu, Gray & Nikolic, A 14-b 12-MS/s CMOS pipeline ADC with over 100-dB SFDR, IEEE J. "
        "Solid-State Circuits 39, 2004 (memory of shared capacitors); IEEE Std 1241-2010"
    )
    measures: ClassVar[frozenset[str]] = frozenset(
        {
            "level",
            "pixel_variance",
            "row_variance",
            "column_variance",
            "correlation_0_1",
            "correlation_1_0",
            "spectral_peak",
        }
    )
    confounders: ClassVar[str] = (
        "readout_memory correlates neighbours alike at all signals; here the sign and size of the "
        "correlation follow the codes."
    )

    def apply(self, image: Image, exposure: Exposure) -> Image:
        """Add the residue of the sample before."""
        first = np.float32(exposure.read_out.black_level_dn - self.at_code)
        along_rows, rows = self.along == "rows", len(image)
        return _with_residues(
            np.ascontiguousarray(image).reshape(rows, -1),
            (0, image[0, 0].size) if along_rows else (1, 0),
            first,
            np.float32(self.period_codes),
            np.float32(self.step_dn),
        ).reshape(image.shape)

    def reach_pixels(self) -> int:
        """Return how far away a pixel may matter."""
        return 1


@kernel
def _with_residues(
    image: Image, before: tuple[int, int], first: np.float32, period: np.float32, step: np.float32
) -> Image:
    """Return an image (row, sample) with the residue of what is so far `before`: down, right.

    The first has the last before it.
    """
    rows, size = image.shape
    down, right = before
    out = np.empty_like(image)
    for y in range(rows):
        line, own, into = image[y - down], image[y], out[y]
        _add_residues(line[size - right :], own[:right], first, period, step, into[:right])
        _add_residues(line[: size - right], own[right:], first, period, step, into[right:])
    return out


@inlined
def _add_residues(
    line: Image, own: Image, first: np.float32, period: np.float32, step: np.float32, out: Image
) -> None:
    for x in range(out.size):
        phase = (line[x] + first) / period
        out[x] = own[x] + (phase - np.floor(phase) - np.float32(0.5)) * step
