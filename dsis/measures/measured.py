"""What was measured of one exposure: scalars with errors, and the arrays they came from."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from dsis.cfa import Cfa
from dsis.measures.codes import Codes
from dsis.measures.estimate import Estimate
from dsis.measures.pairs import PairVariance

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Channel:
    """One channel of one exposure; (row, column) are those of the channel's own pixels.

    Attributes
    ----------
    estimates
        Every scalar of `dsis.measures.MEASURES`.
    kurtosis_within_pixels
        Excess kurtosis of single pixels: not raised by pixels that differ in variance.
    pair_variance
        Equation (1) of the paper.
    mean_frame
        Mean over frames, DN above black: (row, column).
    variance_map
        Temporal variance of each pixel without row, column and frame noise, DN^2: (row, column).
    frame_covariance_map
        Mean product of each pixel's residual with the next frame's, DN^2: (row, column).
    fixed_pixels
        Mean frame without rows, columns and smooth surface, DN; holds 1/T of the temporal noise.
    temporal_autocovariance, fixed_autocovariance
        DN^2 at lags -L..L on the mosaic, other colours included: (2 L + 1, 2 L + 1). Temporal: of
        the pixel noise. Fixed: of the pixel pattern, what temporal noise leaves is taken off.
    power_spectrum
        Temporal power per bin, DN^2; white noise has the pixel variance everywhere: (row,
        columns // 2 + 1), half plane of a real transform of each frame less its mean.
    row_spectrum, column_spectrum
        The same of row means along rows, of column means along columns, times pixels a line.
    row_means, column_means, frame_means
        Of each frame, DN above black: (frame, row), (frame, column), (frame).
    codes
        Histogram of codes, DN as recorded; None where values are not whole.
    clipped_low, clipped_high
        Share of samples at or beyond the lowest code and the white level, or the steps next to
        them where codes are coarse; nan where unknown.
    """

    estimates: Mapping[str, Estimate]
    kurtosis_within_pixels: Estimate
    pair_variance: PairVariance
    mean_frame: Array
    variance_map: Array
    frame_covariance_map: Array
    fixed_pixels: Array
    temporal_autocovariance: Array
    fixed_autocovariance: Array
    power_spectrum: NDArray[np.floating]
    row_spectrum: Array
    column_spectrum: Array
    row_means: Array
    column_means: Array
    frame_means: Array
    codes: Codes | None
    clipped_low: float
    clipped_high: float

    @cached_property
    def moving_rows(self) -> Array:
        """Row means less the frame's, about their mean over frames, DN: (frame, row)."""
        return _moving(self.row_means, self.frame_means)

    @cached_property
    def moving_columns(self) -> Array:
        """The same of columns: (frame, column)."""
        return _moving(self.column_means, self.frame_means)


def _moving(means: Array, frame_means: Array) -> Array:
    moved = means - frame_means[:, np.newaxis]
    moved -= moved.sum(0) / len(moved)
    return moved


@dataclass(frozen=True)
class Measured:
    """The measures of one exposure.

    Attributes
    ----------
    frames
        Number of frames.
    cfa
        Colour filter array of the whole frame.
    region
        Rows and columns that were measured.
    black_level
        Pedestal that levels count from, DN.
    channels
        By name: MONO, or R, Gr, Gb, B.
    """

    frames: int
    cfa: Cfa
    region: tuple[slice, slice]
    black_level: float
    channels: Mapping[str, Channel]

    def estimates(self) -> dict[str, dict[str, Estimate]]:
        """Return the scalars by channel and name."""
        return {name: dict(channel.estimates) for name, channel in self.channels.items()}
