"""Memory of the converter: a conversion carries over the residue of the one before."""

from math import ceil, log
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from dsis.compiled import kernel
from dsis.effects.effect import Effect, Exposure, Image, Stage

_MOST_KEPT = 0.7  # of a step over a period: more is no converter
_AT_ONCE = 16  # lines
_LEAST_DN = 1e-5  # what is left of a sample is below rounding


class AdcMemory(Effect):
    """A conversion carries over some of the residue that the one before left in the converter.

    v'(i) = v(i) + d (frac((v'(i - 1) + black - c) / P) - 1/2). Converters of several steps
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
            "correlation_0_2",
            "correlation_2_0",
            "skewness",
            "kurtosis",
            "variance_spread",
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
        along_rows = self.along == "rows"
        lines = image if along_rows else image.swapaxes(0, 1)
        found = np.empty((lines.shape[0], lines.shape[1], image[0, 0].size), image.dtype)
        _carry(
            np.ascontiguousarray(lines).reshape(found.shape),
            first,
            np.float32(self.period_codes),
            np.float32(self.step_dn),
            found,
        )
        made = found.reshape(lines.shape)
        return np.ascontiguousarray(made if along_rows else made.swapaxes(0, 1))

    def reach_pixels(self) -> int:
        """Return how far away a pixel may matter."""
        share = min(abs(self.step_dn) / self.period_codes, _MOST_KEPT)
        if not share:
            return 1
        return 1 + ceil(max(log(_LEAST_DN / abs(self.step_dn)) / log(share), 0.0))


@kernel
def _carry(
    lines: Image, first: np.float32, period: np.float32, step: np.float32, out: Image
) -> None:
    """Add, sample by sample, the residue of the one before as it was converted.

    Lines are (line, sample, plane). The first has the last before it, as that was without memory.
    """
    count, size, planes = lines.shape
    before = np.empty(_AT_ONCE, lines.dtype)
    for start in range(0, count, _AT_ONCE):
        some = min(_AT_ONCE, count - start)
        for p in range(planes):
            for k in range(some):
                before[k] = lines[start + k, size - 1, p]
            for x in range(size):
                for k in range(some):  # each waits for its own last sample, not for the others'
                    phase = (before[k] + first) / period
                    before[k] = (
                        lines[start + k, x, p] + (phase - np.floor(phase) - np.float32(0.5)) * step
                    )
                    out[start + k, x, p] = before[k]
