"""From the sums of an accumulator to the measures of an exposure."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dsis.measures import kernels
from dsis.measures.autocovariance import Autocorrelation, LagTable, autocorrelation
from dsis.measures.codes import LOWEST_CODE, Codes
from dsis.measures.estimate import Estimate, estimate, unknown
from dsis.measures.fixed_pattern import FixedPattern, fixed_pattern
from dsis.measures.measured import Channel, Measured
from dsis.measures.moments import PixelMoments
from dsis.measures.pairs import pair_variance
from dsis.measures.plane import Plane
from dsis.measures.spectra import line_peak, spectral_peak
from dsis.measures.variance_components import Components, components, line_power
from dsis.measures.vocabulary import CORRELATION_LAGS, FIXED_CORRELATION_LAGS, MEASURES

if TYPE_CHECKING:
    from dsis.measures.accumulator import Accumulator

Array = NDArray[np.float64]


@dataclass(frozen=True)
class _Noise:
    """Temporal noise of one channel before neighbours of other channels are looked at."""

    plane: Plane
    moments: PixelMoments
    rows: Array
    columns: Array
    means: Array
    offset: Array  # mean over frames of d


def measured(sums: Accumulator) -> Measured:
    """Return the measures of what an accumulator has summed; needs two frames."""
    noise = [_noise(sums, plane) for plane in sums.planes]
    temporal = _temporal_correlations(sums, noise)
    parts = [
        components(one.rows, one.columns, one.means, one.moments.variance_map, moving.inflation())
        for one, moving in zip(noise, temporal, strict=True)
    ]
    fixed = [_fixed(sums, one, part) for one, part in zip(noise, parts, strict=True)]
    spatial = _fixed_correlations(sums, noise, fixed)
    channels = {}
    for one, part, pattern, moving, still in zip(
        noise, parts, fixed, temporal, spatial, strict=True
    ):
        channels[one.plane.name] = _channel(
            sums, one, part, pattern, moving, still.less(moving, sums.frames)
        )
    return Measured(sums.frames, sums.cfa, sums.region, sums.black_level, channels)


def _noise(sums: Accumulator, plane: Plane) -> _Noise:
    moments = PixelMoments.of(
        sums.frames,
        tuple(part[plane.pixels] for part in sums.moments),
        sums.centred[plane.pixels].astype(np.float64),
    )
    rows, columns = np.array(plane.row_means), np.array(plane.column_means)
    means = np.array(plane.frame_means)
    offset = sums.moments[0][plane.pixels] / sums.frames
    offset = offset + rows.mean(0)[:, None] + columns.mean(0) - means.mean()
    return _Noise(plane, moments, rows, columns, means, offset)


def _temporal_correlations(sums: Accumulator, noise: list[_Noise]) -> list[Autocorrelation]:
    """Return the correlations of the residual: sums of u u' less those of its mean over time."""
    mean = (sums.moments[0] / sums.frames).astype(np.float32)
    left = kernels.lag_products(mean, sums.lags, sums.threads)
    table = LagTable.of(sums.lags, sums.lag_sums - sums.frames * left, sums.shape)
    variances = {
        phase: float(one.moments.variance_map.mean()) for one in noise for phase in one.plane.phases
    }
    return [
        autocorrelation(table, one.plane.phases, variances, one.plane.shape, sums.frames - 1)
        for one in noise
    ]


def _fixed(sums: Accumulator, one: _Noise, part: Components) -> FixedPattern:
    mean = sums.first[one.plane.pixels] + one.offset
    surfaces = np.array(one.plane.surfaces)
    return fixed_pattern(mean, one.plane.smooth, surfaces, one.rows, one.columns, part)


def _fixed_correlations(
    sums: Accumulator, noise: list[_Noise], fixed: list[FixedPattern]
) -> list[Autocorrelation]:
    mosaic = np.empty(sums.shape, np.float32)
    variances: dict[tuple[int, int], float] = {}
    for one, pattern in zip(noise, fixed, strict=True):
        mosaic[one.plane.pixels] = pattern.pixels
        variances |= dict.fromkeys(one.plane.phases, pattern.mean_square)
    products = kernels.lag_products(mosaic, sums.lags, sums.threads)
    table = LagTable.of(sums.lags, products, sums.shape)
    return [
        autocorrelation(
            table,
            one.plane.phases,
            variances,
            one.plane.shape,
            1,
            int(one.plane.smooth.mixed.sum()),
        )
        for one in noise
    ]


def _channel(
    sums: Accumulator,
    one: _Noise,
    part: Components,
    fixed: FixedPattern,
    temporal: Autocorrelation,
    still: Autocorrelation,
) -> Channel:
    plane, frames = one.plane, sums.frames
    n, m = plane.shape
    mean = sums.first[plane.pixels] + one.offset - sums.black_level
    flat = one.offset - one.means.mean()
    power = plane.power - frames * np.abs(np.fft.rfft2(flat)) ** 2
    power = np.maximum(power, 0.0) / (n * m * (frames - 1))
    row_power = line_power(one.rows - one.means[:, None]) * m / (frames - 1)
    column_power = line_power(one.columns - one.means[:, None]) * n / (frames - 1)
    codes = _codes(sums, plane)
    estimates = {
        "level": _level(float(mean.mean()), part, fixed),
        **part.estimates(),
        **one.moments.estimates(temporal.inflation()),
        **{name: temporal.at(lag) for name, lag in CORRELATION_LAGS.items()},
        "spectral_peak": spectral_peak(power, m, frames - 1),
        "row_spectrum_peak": line_peak(row_power, n, frames - 1),
        "code_spacing": codes.spacing() if codes else unknown(1.0),
        "code_imbalance": codes.imbalance(part.ms_pixel) if codes else unknown(0.0),
        **fixed.estimates,
        **{name: still.at(lag) for name, lag in FIXED_CORRELATION_LAGS.items()},
    }
    first = sums.first[plane.pixels].astype(np.float64) - sums.black_level
    low, high = sums.lowest_code, sums.white_level
    return Channel(
        {name: estimates[name] for name in MEASURES},
        one.moments.kurtosis_within_pixels(),
        pair_variance(plane.pair_squares, plane.pair_means, part),
        mean,
        one.moments.variance_map,
        one.moments.neighbour,
        fixed.pixels,
        temporal.covariance,
        still.covariance,
        power,
        row_power,
        column_power,
        one.rows + first.mean(1),
        one.columns + first.mean(0),
        one.means + first.mean(),
        codes,
        codes.share_at_most(low) if codes and low is not None else np.nan,
        codes.share_at_least(high) if codes and high is not None else np.nan,
    )


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


def _codes(sums: Accumulator, plane: Plane) -> Codes | None:
    if not sums.whole_codes:
        return None
    low, high = sums.code_range
    used = sums.histogram[:, :, low : high + 1]
    counts: NDArray[np.int64] = np.sum([used[phase] for phase in plane.phases], axis=0)
    return Codes.of(LOWEST_CODE + low, counts)
