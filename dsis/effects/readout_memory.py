"""Read-out memory: a sample remembers what was read a few samples earlier."""

from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator

from dsis.compiled import kernel
from dsis.effects.effect import Effect, Exposure, Image, OperatingPoint, Stage

_NOISE: Literal["noise"] = "noise"
_SIGNAL: Literal["signal"] = "signal"
_FIXED = frozenset({"fixed_row_variance", "fixed_column_variance", "fixed_smooth_variance"})


class ReadoutMemory(Effect):
    """Of the sample read some pixels earlier along a line a share is seen once more.

    Of its noise, v'(i) = v(i) + f n(i - lag), n = v - S the deviation from the expected signal,
    which the clamp, the correlated double sampling or the converter bank has in common. A negative
    fraction takes noise away. Correlation f / (1 + f^2) at that lag and at no other; the first
    samples of a line have nothing to remember. S is what reaches the read-out of the expected
    signal, bent, shared out, cut and amplified as all of it is (nonlinearity, crosstalk,
    brighter-fatter, saturation, gains of amplifiers). Offsets that are fixed are remembered like
    the noise; so are what a limit that noise alone reaches takes from the mean, what lines have
    that have not settled, and the trail that image lag leaves.

    Or, where it `remembers` the signal, of all of it: v'(i) = v(i) + f (v(i - lag) - v(i)), as of
    an amplifier that has not settled, or of charge that stays behind. A flat of one colour keeps
    its level; colours mix where the lag is odd, edges blur. Correlation f (1 - f) / ((1 - f)^2 +
    f^2), variance times (1 - f)^2 + f^2. The first samples of a line stay as they are; or, where
    the read-out rests at `black` before a line (`before_line`), they are v (1 - f), darker by the
    share that all others remember.
    """

    kind: Literal["readout_memory"] = "readout_memory"
    fraction: Annotated[float, Field(gt=-1, lt=1, examples=[0.1])]
    lag_pixels: Annotated[int, Field(ge=1, examples=[2])]
    along: Literal["rows", "columns"] = "rows"
    remembers: Annotated[Literal["noise", "signal"], Field(exclude_if=_NOISE.__eq__)] = _NOISE
    before_line: Annotated[Literal["signal", "black"], Field(exclude_if=_SIGNAL.__eq__)] = _SIGNAL

    stage: ClassVar[Stage] = Stage.READ_OUT
    rank: ClassVar[int] = 50
    draws: ClassVar[bool] = False
    reference: ClassVar[str] = (
        "White, Lampe, Blaha & Mack, Characterization of surface channel CCD image arrays at low "
        "light levels, IEEE J. Solid-State Circuits 9, 1974"
    )
    measures: ClassVar[frozenset[str]] = frozenset(
        {
            "level",  # where offsets or a limit moved the mean, or colours mix
            "pixel_variance",
            "row_variance",
            "column_variance",
            "frame_variance",
            "correlation_0_1",
            "correlation_1_0",
            "correlation_1_1",
            "correlation_0_2",
            "correlation_2_0",
            "spectral_peak",
            "row_spectrum_peak",
            "variance_spread",
            *_FIXED,  # where lines begin at black
        }
    )
    confounders: ClassVar[str] = (
        "crosstalk acts on both sides, at lag 1 and on shot noise alone; row_noise is common to a "
        "whole row."
    )

    @model_validator(mode="after")
    def _of_signal(self) -> "ReadoutMemory":
        if self.before_line == "black" and self.remembers != "signal":
            message = 'before_line = "black" needs remembers = "signal": black is no noise'
            raise ValueError(message)
        return self

    @property
    def changes(self) -> frozenset[str]:
        """What it may change: fixed patterns where lines begin at black."""
        return self.measures if self.before_line == "black" else self.measures - _FIXED

    def apply(self, image: Image, exposure: Exposure) -> Image:
        """Add what is remembered."""
        if self.exchanges:
            return self._begun(self.exchanged(image), exposure)
        along_rows, rows = self.along == "rows", len(image)
        lag = self.lag_pixels * (image[0, 0].size if along_rows else 1)
        return _remembering(
            np.ascontiguousarray(image).reshape(rows, -1),
            np.ascontiguousarray(exposure.arriving_dn).reshape(rows, -1),
            np.float32(self.fraction),
            (0, lag) if along_rows else (lag, 0),
        ).reshape(image.shape)

    @property
    def asks_what_arrives(self) -> bool:
        """Whether it takes what is expected from samples: where it remembers their noise."""
        return self.remembers == _NOISE

    @property
    def exchanges(self) -> bool:
        """Whether samples of another colour are mixed in."""
        return self.remembers == "signal"

    def exchanged(self, image: Image) -> Image:
        """Return an image with a share of the samples before; of the noise alone, as it is."""
        if not self.exchanges:
            return image
        k, made = self.lag_pixels, image.copy()
        axis = int(self.along == "rows")
        own, into = np.moveaxis(image, axis, 0), np.moveaxis(made, axis, 0)
        into[k:] += np.float32(self.fraction) * (own[:-k] - own[k:])
        return made

    def _begun(self, image: Image, exposure: Exposure) -> Image:
        """Take from the first samples of lines what they would remember, if it is black."""
        if self.before_line == "black":
            grid = exposure.grid
            along_rows = self.along == "rows"
            places = grid.column_numbers() if along_rows else grid.row_numbers()
            first = places.reshape(-1) < self.lag_pixels
            np.moveaxis(image, int(along_rows), 0)[first] *= np.float32(1 - self.fraction)
        return image

    def reach_pixels(self) -> int:
        """Return how far away a pixel may matter."""
        return self.lag_pixels

    def contributions(self, point: OperatingPoint) -> Mapping[str, float]:
        """Return f^2 V for the variance and f V for the covariance at the lag; of all, a kernel's.

        Under light alike for all colours.
        """
        v = point.shot_variance_dn2 + point.read_variance_dn2
        f, k = self.fraction, self.lag_pixels
        across = point.columns if self.along == "rows" else point.rows
        lag = (0, k) if self.along == "rows" else (k, 0)
        if self.exchanges:
            black = f * min(k / across, 1.0) if self.before_line == "black" else 0.0
            kernel = point.filtered(v, {(0, 0): 1 - f, lag: f})
            return kernel | {"level": -black * point.signal_dn}
        noise = point.coupled({(0, 0): v * f**2 * max(across - k, 0) / across, lag: v * f})
        return noise | {"level": 0.0}  # of the effect alone


@kernel
def _remembering(
    image: Image, expected: Image, fraction: np.float32, lag: tuple[int, int]
) -> Image:
    """Return an image (row, sample) with a share of the noise some rows above and samples before.

    What has no such neighbour stays as it is.
    """
    out = image.copy()
    down, right = lag
    for y in range(down, image.shape[0]):
        line, light, into = image[y - down], expected[y - down], out[y, right:]
        for x in range(into.size):
            into[x] += (line[x] - light[x]) * fraction
    return out
