"""From the sums of an accumulator to the measures of an exposure."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from dsis.measures import kernels
from dsis.measures.autocovariance import Autocorrelation, LagTable, autocorrelation
from dsis.measures.estimate import Estimate, estimate, unknown
from dsis.measures.fixed_pattern import FixedPattern, fixed_pattern
from dsis.measures.lag_products import lag_products
from dsis.measures.measured import Channel, Measured
from dsis.measures.moments import PixelMoments, kept
from dsis.measures.pairs import pair_variance
from dsis.measures.pixels import pair_moments, pixel_moments
from dsis.measures.plane import Plane, Sheets
from dsis.measures.spectra import line_peak, spectral_peak
from dsis.measures.variance_components import Components, components, line_power
from dsis.measures.vocabulary import CORRELATION_LAGS, FIXED_CORRELATION_LAGS, MEASURES

if TYPE_CHECKING:
    from dsis.measures.accumulator import Accumulator

Array = NDArray[np.float64]


@dataclass(frozen=True)
class _Noise:
    """One channel before neighbours of other channels are looked at."""

    plane: Plane
    moments: PixelMoments
    rows: Array  # means of d: (frame, row), as are the next two
    columns: Array
    means: Array
    row_power: Array
    column_power: Array
    first_rows: Array  # means of the first frame: (row), (column)
    first_columns: Array
    mean_frame: Array
    power: Array
    surfaces: Array


def measured(sums: Accumulator) -> Measured:
    """Return the measures of what an accumulator has summed; needs two frames."""
    found = {one.plane.name: one for sheet in sums.sheets for one in _noise(sums, sheet)}
    noise = [found[plane.name] for plane in sums.planes]
    temporal = _temporal_correlations(sums, noise)
    inflations = [moving.inflation() for moving in temporal]
    parts = [
        components(
            one.row_power,
            one.column_power,
            one.means,
            one.plane.shape,
            (one.moments.variance, one.moments.variance_error2 * inflation),
        )
        for one, inflation in zip(noise, inflations, strict=True)
    ]
    fixed = [
        fixed_pattern(
            one.mean_frame,
            one.plane.smooth,
            one.surfaces,
            one.rows,
            one.columns,
            part,
            sums.threads,
        )
        for one, part in zip(noise, parts, strict=True)
    ]
    # What was not summed is as good as white, and said to be unknown.
    spatial = _fixed_correlations(sums, noise, fixed) if sums.neighbours else temporal
    channels = {}
    for one, part, pattern, moving, inflation, still in zip(
        noise, parts, fixed, temporal, inflations, spatial, strict=True
    ):
        pair = (moving, still.less(moving, sums.frames) if sums.neighbours else still)
        channels[one.plane.name] = _channel(sums, one, part, pattern, pair, inflation)
    return Measured(sums.frames, sums.cfa, sums.region, sums.black_level, channels)


def _noise(sums: Accumulator, sheet: Sheets) -> list[_Noise]:
    """Return the noise of channels of one size."""
    frames, (count, n, m) = sums.frames, sheet.images.shape
    rows, columns = sheet.lines(np.array(sums.row_sums), np.array(sums.column_sums))
    means = np.array([[mean[plane.start] for mean in sums.means] for plane in sheet.planes])
    row_power, column_power = line_power(rows, means), line_power(columns, means)
    surfaces = np.array(sheet.surfaces)
    mean_frames, changes = np.empty((count, n, m)), np.empty((count, n, m))
    total = sums.centred.astype(np.float64) if sums.moments is None else sums.moments[0]
    first = [
        kernels.mean_frame(
            sums.first,
            total,
            frames,
            plane.place,
            rows[k],
            columns[k],
            -sums.black_level,
            mean_frames[k],
            changes[k],
        )
        for k, plane in enumerate(sheet.planes)
    ]
    powers = _temporal_powers(sums, sheet, changes) if sums.power else sheet.power
    noise = []
    for k, plane in enumerate(sheet.planes):
        share = kept(frames, n, m, 2)
        if sums.moments is None:
            found = pair_moments(sums.centred, plane.place, plane.shape, share, sums.threads)
        else:
            found = pixel_moments(
                sums.moments, sums.centred, frames, plane.place, plane.shape, share, sums.threads
            )
        variance, neighbour, scatter = found
        noise.append(
            _Noise(
                plane,
                PixelMoments(frames, n, m, variance, neighbour, scatter),
                rows[k],
                columns[k],
                means[k],
                row_power[k],
                column_power[k],
                *first[k],
                mean_frames[k],
                powers[k],
                np.ascontiguousarray(surfaces[:, k]),
            )
        )
    return noise


def _temporal_powers(sums: Accumulator, sheet: Sheets, changes: Array) -> list[Array]:
    """Return the power of each plane over frames, less that of their mean: (row, column).

    `changes` of the mean since the first frame: (plane, row, column). Of two frames it is half of
    the second's, and half of the power is left.
    """
    frames, (_, n, m) = sums.frames, sheet.images.shape
    if sums.moments is None:
        return [power / (2 * n * m) for power in sheet.power]
    # As exact as the transforms of the frames, from whose power its own is taken off.
    transform = scipy.fft.rfft2(changes.astype(np.float32), workers=sums.threads, overwrite_x=True)
    return [
        kernels.temporal_power(power, own, m, frames)
        for power, own in zip(sheet.power, transform, strict=True)
    ]


def _temporal_correlations(sums: Accumulator, noise: list[_Noise]) -> list[Autocorrelation]:
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
    for one in noise:
        for phase in one.plane.phases:
            variances[phase] = one.moments.variance
    return [
        autocorrelation(table, one.plane.phases, variances, one.plane.shape, sums.frames - 1)
        for one in noise
    ]


def _fixed_correlations(
    sums: Accumulator, noise: list[_Noise], fixed: list[FixedPattern]
) -> list[Autocorrelation]:
    mosaic, variances = np.empty(sums.shape, np.float32), np.empty((2, 2))
    for one, pattern in zip(noise, fixed, strict=True):
        mosaic[one.plane.pixels] = pattern.pixels
        for phase in one.plane.phases:
            variances[phase] = pattern.mean_square
    table = LagTable.of(sums.reach, lag_products(mosaic, sums.reach, sums.threads), sums.shape)
    return [
        autocorrelation(
            table, one.plane.phases, variances, one.plane.shape, 1, one.plane.smooth.kinds
        )
        for one in noise
    ]


def _correlations(
    sums: Accumulator, of: Autocorrelation, lags: Mapping[str, tuple[int, int]]
) -> dict[str, Estimate]:
    """Return the correlations at some lags by name, unknown where products were not summed."""
    return of.at(lags) if sums.neighbours else dict.fromkeys(lags, unknown(0.0))


def _channel(
    sums: Accumulator,
    one: _Noise,
    part: Components,
    fixed: FixedPattern,
    correlations: tuple[Autocorrelation, Autocorrelation],
    inflation: float,
) -> Channel:
    """Return the measures of one channel; `inflation` is that of its temporal correlations."""
    plane, frames, (temporal, still) = one.plane, sums.frames, correlations
    n, m = plane.shape
    row_power, column_power = (
        one.row_power * (m / (frames - 1)),
        one.column_power * (n / (frames - 1)),
    )
    first = float(one.first_rows.sum()) / n
    codes = sums.codes.of(plane.phases)
    estimates = {
        "level": _level(float(one.mean_frame.sum()) / (n * m), part, fixed),
        **part.estimates(),
        **one.moments.estimates(inflation),
        **_correlations(sums, temporal, CORRELATION_LAGS),
        "spectral_peak": spectral_peak(one.power, m, frames - 1) if sums.power else unknown(),
        "row_spectrum_peak": line_peak(row_power, n, frames - 1),
        "code_spacing": codes.spacing() if codes else unknown(1.0),
        "code_imbalance": codes.imbalance(part.ms_pixel) if codes else unknown(0.0),
        **fixed.estimates,
        **_correlations(sums, still, FIXED_CORRELATION_LAGS),
    }
    low, high = sums.lowest_code, sums.white_level
    if codes and low is not None and high is not None:
        low, high = codes.ends(low, high)
    return Channel(
        {name: estimates[name] for name in MEASURES},
        one.moments.kurtosis_within_pixels(),
        pair_variance(*_pairs(sums, plane, one.means), part),
        one.mean_frame,
        one.moments.variance_map,
        one.moments.neighbour,
        fixed.pixels,
        temporal.covariance,
        still.covariance,
        one.power,
        row_power,
        column_power,
        one.rows + one.first_rows,
        one.columns + one.first_columns,
        one.means + first,
        codes,
        codes.share_at_most(low) if codes and low is not None else np.nan,
        codes.share_at_least(high) if codes and high is not None else np.nan,
    )


def _pairs(sums: Accumulator, plane: Plane, means: Array) -> tuple[list[float], list[float]]:
    """Return mean squares and means of the difference of each pair of frames."""
    n, m = plane.shape
    squares = [
        sum(square[y][x] for y, x in plane.phases) / (n * m)
        for square in map(np.ndarray.tolist, sums.pair_squares)
    ]
    pairs = len(squares)
    return squares, (means[1 : 2 * pairs : 2] - means[: 2 * pairs : 2]).tolist()


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
