"""From the sums of an accumulator to the measures of an exposure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import nan
from typing import TYPE_CHECKING

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from dsis.compiled import pairwise_sum
from dsis.measures import kernels
from dsis.measures.autocovariance import Autocorrelation, LagTable, autocorrelation
from dsis.measures.codes import Codes
from dsis.measures.estimate import Estimate, estimate, unknown
from dsis.measures.fixed_pattern import FixedPattern, fixed_patterns
from dsis.measures.lag_products import lag_products
from dsis.measures.measured import Channel, Measured
from dsis.measures.moments import PixelMoments, kept
from dsis.measures.pairs import pair_variance
from dsis.measures.pixels import pair_moments, pixel_moments
from dsis.measures.plane import Plane, Sheets
from dsis.measures.spectra import line_peak, spectral_peak
from dsis.measures.variance_components import (
    Components,
    components,
    line_power,
    line_squares,
)
from dsis.measures.vocabulary import CORRELATION_LAGS, FIXED_CORRELATION_LAGS, MEASURES

if TYPE_CHECKING:
    from dsis.measures.accumulator import Accumulator

Array = NDArray[np.float64]
_Correlations = tuple[
    Mapping[str, Autocorrelation], Mapping[str, Autocorrelation], Mapping[str, float]
]
"""By channel: of temporal noise, of the fixed pattern, and the inflation of the former."""


@dataclass(frozen=True)
class _Noise:
    """Channels of one size before neighbours of other channels are looked at; all by plane."""

    sheet: Sheets
    moments: list[PixelMoments]
    rows: Array  # means of d: (plane, frame, row), as are the next two
    columns: Array
    means: Array
    row_power: Array
    column_power: Array
    mean_frames: Array
    first_rows: Array  # means of the first frame: (plane, row), (plane, column)
    first_columns: Array
    powers: NDArray[np.floating]
    surfaces: Array  # (frame, plane, row degree, column degree)

    @property
    def size(self) -> tuple[int, int]:
        """Rows and columns of a channel."""
        return self.sheet.planes[0].shape

    def parts(self, inflations: Mapping[str, float]) -> list[Components]:
        """Return the components of each channel, by the inflation of its correlations."""
        (n, m), frames = self.size, self.means.shape[1]
        pixels = [
            (one.variance, one.variance_error2 * inflations[plane.name])
            for one, plane in zip(self.moments, self.sheet.planes, strict=True)
        ]
        of_rows = line_squares(self.row_power, frames, n, m)
        of_columns = line_squares(self.column_power, frames, m, n)
        return components(of_rows, of_columns, self.means, (n, m), pixels)


def measured(sums: Accumulator) -> Measured:
    """Return the measures of what an accumulator has summed; needs two frames."""
    noise = [_noise(sums, sheet) for sheet in sums.sheets]
    temporal = _temporal_correlations(sums, noise)
    inflations = {name: moving.inflation() for name, moving in temporal.items()}
    parts = [one.parts(inflations) for one in noise]
    fixed = [
        fixed_patterns(
            one.mean_frames,
            one.sheet.planes[0].smooth,
            one.surfaces,
            one.rows,
            one.columns,
            own,
            sums.threads,
        )
        for one, own in zip(noise, parts, strict=True)
    ]
    # What was not summed is as good as white, and said to be unknown.
    spatial = temporal
    if sums.neighbours:
        still = _fixed_correlations(sums, noise, fixed)
        spatial = {name: still[name].less(temporal[name], sums.frames) for name in still}
    found: dict[str, Channel] = {}
    for one, own, patterns in zip(noise, parts, fixed, strict=True):
        found |= _channels(sums, one, own, patterns, (temporal, spatial, inflations))
    channels = {plane.name: found[plane.name] for plane in sums.planes}
    return Measured(sums.frames, sums.cfa, sums.region, sums.black_level, channels)


def _noise(sums: Accumulator, sheet: Sheets) -> _Noise:
    """Return the noise of channels of one size."""
    rows, columns = sheet.lines(np.array(sums.row_sums), np.array(sums.column_sums))
    of_phases = np.array(sums.means)
    means = np.array([of_phases[:, y, x] for y, x in (plane.start for plane in sheet.planes)])
    total = sums.centred.astype(np.float64) if sums.moments is None else sums.moments[0]
    shift = -float(sums.black_level)
    mean_frames, changes, first_rows, first_columns = kernels.mean_frames(
        sums.first, total, sums.frames, sheet.places, (rows, columns), shift
    )
    return _Noise(
        sheet,
        _pixel_moments(sums, sheet),
        rows,
        columns,
        means,
        line_power(rows, means),
        line_power(columns, means),
        mean_frames,
        first_rows,
        first_columns,
        _temporal_powers(sums, sheet, changes) if sums.power else sheet.power,
        np.array(sheet.surfaces),
    )


def _pixel_moments(sums: Accumulator, sheet: Sheets) -> list[PixelMoments]:
    """Return what the pixels of each channel of one size show over time."""
    frames, (n, m) = sums.frames, sheet.planes[0].shape
    share, last, threads = kept(frames, n, m, 2), sums.centred, sums.threads
    if sums.moments is None:
        found = [pair_moments(last, one.place, (n, m), share, threads) for one in sheet.planes]
    else:
        found = pixel_moments(sums.moments, last, frames, sheet.places, (n, m), share, threads)
    return [PixelMoments(frames, n, m, *one) for one in found]


def _temporal_powers(sums: Accumulator, sheet: Sheets, changes: Array) -> NDArray[np.floating]:
    """Return the power of each plane over frames, less that of their mean: (plane, row, column).

    `changes` of the mean since the first frame: (plane, row, column). Of two frames it is half of
    the second's, and half of the power is left.
    """
    frames, (n, m) = sums.frames, sheet.planes[0].shape
    if sums.moments is None:
        return sheet.power / (2 * n * m)
    # As exact as the transforms of the frames, from whose power its own is taken off.
    transforms = scipy.fft.rfft2(changes.astype(np.float32), workers=sums.threads, overwrite_x=True)
    return kernels.temporal_powers(sheet.power, transforms, m, frames)


def _temporal_correlations(
    sums: Accumulator, noise: Sequence[_Noise]
) -> dict[str, Autocorrelation]:
    """Return the correlations of the residual: sums of u u' less those of its mean over time."""
    if (
        sums.moments is None
    ):  # the first is zero: the mean is half the second, products are quarters
        left = sums.lag_sums / 4
    elif sums.neighbours:
        mean = (sums.moments[0] / sums.frames).astype(np.float32)
        left = lag_products(mean, sums.reach, sums.threads)
    else:
        left = np.zeros_like(sums.lag_sums)
    table = LagTable.of(sums.reach, sums.lag_sums - sums.frames * left, sums.shape)
    variances = np.empty((2, 2))
    for sheet in noise:
        for plane, moments in zip(sheet.sheet.planes, sheet.moments, strict=True):
            variances[plane.pixels] = moments.variance
    return {
        plane.name: autocorrelation(table, plane.phases, variances, plane.shape, sums.frames - 1)
        for plane in sums.planes
    }


def _fixed_correlations(
    sums: Accumulator, noise: Sequence[_Noise], fixed: Sequence[Sequence[FixedPattern]]
) -> dict[str, Autocorrelation]:
    mosaic, variances = np.empty(sums.shape, np.float32), np.empty((2, 2))
    for sheet, patterns in zip(noise, fixed, strict=True):
        for plane, pattern in zip(sheet.sheet.planes, patterns, strict=True):
            mosaic[plane.pixels] = pattern.pixels
            variances[plane.pixels] = pattern.mean_square
    table = LagTable.of(sums.reach, lag_products(mosaic, sums.reach, sums.threads), sums.shape)
    return {
        plane.name: autocorrelation(
            table, plane.phases, variances, plane.shape, 1, plane.smooth.kinds
        )
        for plane in sums.planes
    }


def _correlations(
    sums: Accumulator, of: Autocorrelation, lags: Mapping[str, tuple[int, int]]
) -> dict[str, Estimate]:
    """Return the correlations at some lags by name, unknown where products were not summed."""
    return of.at(lags) if sums.neighbours else dict.fromkeys(lags, unknown(0.0))


def _channels(
    sums: Accumulator,
    noise: _Noise,
    parts: Sequence[Components],
    fixed: Sequence[FixedPattern],
    correlations: _Correlations,
) -> dict[str, Channel]:
    """Return the measures of channels of one size by name."""
    (n, m), frames = noise.size, sums.frames
    temporal, still, inflations = correlations
    row_power = noise.row_power * (m / (frames - 1))
    column_power = noise.column_power * (n / (frames - 1))
    row_means = noise.rows + noise.first_rows[:, np.newaxis]
    column_means = noise.columns + noise.first_columns[:, np.newaxis]
    squares, means = [one.tolist() for one in sums.pair_squares], noise.means.tolist()
    channels = {}
    for k, plane in enumerate(noise.sheet.planes):
        name, moments, part, power = plane.name, noise.moments[k], parts[k], noise.powers[k]
        codes = sums.codes.of(plane.phases)
        level = pairwise_sum(noise.mean_frames[k].reshape(-1)) / (n * m)
        estimates = {
            "level": _level(level, part, fixed[k]),
            **part.estimates(),
            **moments.estimates(inflations[name]),
            **_correlations(sums, temporal[name], CORRELATION_LAGS),
            "spectral_peak": spectral_peak(power, m, frames - 1) if sums.power else unknown(),
            "row_spectrum_peak": line_peak(row_power[k], n, frames - 1),
            "code_spacing": codes.spacing() if codes else unknown(1.0),
            "code_imbalance": codes.imbalance(part.ms_pixel) if codes else unknown(0.0),
            **fixed[k].estimates,
            **_correlations(sums, still[name], FIXED_CORRELATION_LAGS),
        }
        channels[name] = Channel(
            {name: estimates[name] for name in MEASURES},
            moments.kurtosis_within_pixels(),
            pair_variance(*_pairs(squares, plane, means[k]), part),
            noise.mean_frames[k],
            moments.variance_map,
            moments.neighbour,
            fixed[k].pixels,
            temporal[name].covariance,
            still[name].covariance,
            power,
            row_power[k],
            column_power[k],
            row_means[k],
            column_means[k],
            noise.means[k] + pairwise_sum(noise.first_rows[k]) / n,
            codes,
            *_clipped(sums, codes),
        )
    return channels


def _clipped(sums: Accumulator, codes: Codes | None) -> tuple[float, float]:
    """Return the share of samples at or beyond the first and the last code; nan where unknown."""
    low, high = sums.lowest_code, sums.white_level
    if not codes:
        return nan, nan
    if low is not None and high is not None:
        low, high = codes.ends(low, high)
    return (
        nan if low is None else codes.share_at_most(low),
        nan if high is None else codes.share_at_least(high),
    )


def _pairs(
    squares: Sequence[list[list[float]]], plane: Plane, means: Sequence[float]
) -> tuple[list[float], list[float]]:
    """Return mean squares and means of the difference of each pair of frames.

    From sums of squares by phase, of each pair, and means of each frame.
    """
    n, m = plane.shape
    phases, pairs = plane.phases, range(1, 2 * len(squares), 2)
    mean_squares = [sum([square[y][x] for y, x in phases]) / (n * m) for square in squares]
    return mean_squares, [means[k] - means[k - 1] for k in pairs]


def _level(value: float, part: Components, fixed: FixedPattern) -> Estimate:
    """Return the level: error of the frame means' wander and of the fixed pattern's own mean."""
    n, m = part.rows, part.columns
    scatter = sum(
        fixed.estimates[f"fixed_{name}_variance"].value / lines
        for name, lines in (("pixel", n * m), ("row", n), ("column", m))
    )
    still = part.ms_pixel / (part.frames * n * m)
    # The parts are unbiased, so each may come out below zero; their sum may not.
    error = max(part.ms_frame / (part.frames * n * m) + scatter, still / 4)
    return estimate(value, error, np.nan, still)
