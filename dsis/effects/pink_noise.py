"""Pink noise: 1/f noise of the amplifier along the order of read-out."""

from collections.abc import Mapping
from functools import lru_cache, partial
from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from scipy import fft

from dsis.cfa import Cfa
from dsis.effects.effect import MOST_DN, Effect, Exposure, Image, OperatingPoint, Stage
from dsis.grid import PixelGrid
from dsis.kept import Kept

_ROWS = "rows"
# Many cameras are simulated on the same draws; all frames of a proof fit.
_SERIES = Kept(96 << 20, patience=3)


class PinkNoise(Effect):
    """Noise whose power falls as 1/f along the read-out, line after line, sample after sample.

    v(t, i) = S(i) + b(t, i), where i = y W + x counts samples along rows, one row after the other,
    or i = x H + y along columns, where these are read one after the other: a Gaussian series of
    standard deviation sigma and power proportional to 1/f from two frames' length down to two
    samples, new in each frame. All sites of a mosaic are one series; the three planes share it.
    """

    kind: Literal["pink_noise"] = "pink_noise"
    sigma_dn: Annotated[float, Field(ge=0, le=MOST_DN, examples=[1.5])]
    along: Annotated[Literal["rows", "columns"], Field(exclude_if=_ROWS.__eq__)] = "rows"

    stage: ClassVar[Stage] = Stage.READ_OUT
    reference: ClassVar[str] = (
        "Rauscher, Teledyne H1RG, H2RG, and H4RG noise generator, PASP 127, 2015"
    )
    measures: ClassVar[frozenset[str]] = frozenset(
        {
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
        }
    )
    confounders: ClassVar[str] = (
        "row_noise and column_noise are white from line to line and constant along it, row_banding "
        "is constant along it; crosstalk falls off after one pixel, pink noise as the logarithm of "
        "the lag; black_level_drift moves whole frames and no lines."
    )

    def apply(self, image: Image, exposure: Exposure) -> Image:
        """Add the series in the order of read-out."""
        key = exposure.temporal, exposure.frame, exposure.grid, self.along
        series = _SERIES.of(key, partial(_series, exposure, self.along))
        own = np.float32(self.sigma_dn) * series
        made: Image = image + own.reshape(*own.shape, *(1,) * (image.ndim - 2))
        return made

    def contributions(self, point: OperatingPoint) -> Mapping[str, float]:
        """Return what the series' covariance makes of pixels, lines and frames."""
        along_rows = self.along == _ROWS
        h, w = (point.rows, point.columns)[:: 1 if along_rows else -1]
        length = _length(h, w)
        covariance = fft.irfft(_power(length), length) * length / 2 * self.sigma_dn**2
        x, y = np.arange(1 - w, w), np.arange(1 - h, h)
        in_rows, in_columns = (w - np.abs(x)) / w**2, (h - np.abs(y)) / h**2
        line = float((in_rows * covariance[x]).sum())
        across = float((in_columns * covariance[y * w]).sum())
        frame = sum(
            float(v * (in_rows * covariance[k * w + x]).sum())
            for k, v in zip(y, in_columns, strict=True)
        )
        row, column = (line, across) if along_rows else (across, line)
        return point.components(float(covariance[0]), row, column, frame)


def keep_series(most_bytes: int) -> None:
    """Keep up to so many bytes of series in this process, where the same draws come back."""
    _SERIES.keep(most_bytes)


def _series(exposure: Exposure, along: str) -> NDArray[np.float32]:
    """Return the series of variance 1 at the pixels of a frame: float32 (row, column)."""
    grid = exposure.grid
    shape = grid.sensor_shape
    count, samples = shape if along == _ROWS else shape[::-1]
    length = _length(count, samples)
    # Bin k of the spectrum is drawn at row k // samples: real part left, imaginary part right.
    lines = PixelGrid(-(-(length // 2 + 1) // samples), 2 * samples, Cfa.MONO)
    white = exposure.temporal.normal("pink_noise", lines, exposure.frame, exposure.threads)
    bins = white.reshape(-1).view(np.complex64)[: length // 2 + 1]
    bins *= _amplitudes(length)
    read = fft.irfft(bins, length, overwrite_x=True)[: count * samples].reshape(count, samples)
    series = read if along == _ROWS else read.T
    first, left = grid.first_row, grid.first_column
    seen = series[first : first + grid.rows, left : left + grid.columns]
    return np.array(seen, np.float32, order="C")  # a copy: the whole series is not kept


def _length(rows: int, columns: int) -> int:
    """Return the samples of the series: two frames, so that its ends do not meet."""
    return 2 * int(fft.next_fast_len(rows * columns, real=True))


@lru_cache(maxsize=2)
def _amplitudes(length: int) -> NDArray[np.float32]:
    """Return what makes standard normal parts of each bin a series of variance 1.

    Two parts of amplitude a add 4 a^2 / length^2 to the variance.
    """
    amplitudes: NDArray[np.float32] = (np.sqrt(_power(length)) * length / 2).astype(np.float32)
    amplitudes.flags.writeable = False
    return amplitudes


def _power(length: int) -> NDArray[np.float64]:
    """Return the variance in each bin of a series of variance 1: 1/f, none in the constant."""
    power = np.zeros(length // 2 + 1)
    power[1:-1] = 1 / np.arange(1, length // 2)
    share: NDArray[np.float64] = power / power.sum()
    return share
