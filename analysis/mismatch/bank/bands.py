"""Bands across a mosaic: the temporal spectrum of its rows, all colours in phase.

A row of the sensor crosses two channels. Their means, each in proportion to what a band moves it by
and to the inverse of its noise, make one series over all rows (a matched filter), so that channels
add by amplitude, not by power.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.coherent import slow_lines
from analysis.mismatch.bank.peaks import Peak, largest_line, line_top
from analysis.mismatch.bank.rowlags import row_lags
from analysis.mismatch.bank.scalars import Number
from dsis.compiled import kernel
from dsis.measures import Channel

Array = NDArray[np.float64]
_LABELS = {"": "row_spectrum_peak", "signal": "row_spectrum_peak of light"}
_KINDS = {"": "rows", "signal": "rows of light"}


class Bands:
    """Power of row series over all exposures on half bins, white noise scaled to 1.

    Two weightings: bands of one amplitude in DN, and in proportion to the light.

    Parameters
    ----------
    rows
        Of the mosaic.
    sites
        First row and column of each channel.
    """

    def __init__(self, rows: int, sites: Mapping[str, tuple[int, int]]) -> None:
        self.rows, self.sites = rows, sites
        self.power = {key: np.zeros(rows + 1) for key in _LABELS}
        self.weight = {key: [0.0, 0.0] for key in _LABELS}

    def add(
        self,
        channels: Mapping[str, Channel],
        variance_dn2: Mapping[str, float],
        signal_dn: Mapping[str, float],
        frames: int,
    ) -> None:
        """Take one exposure; the variance and signal that are expected weigh it."""
        shapes = {name: (1.0, max(signal_dn[name], 0.0)) for name in channels}
        found = matched(channels, variance_dn2, shapes, self.sites, self.rows)
        if found is None:
            return
        series, noise, told = found
        powers = (np.abs(np.fft.rfft(series, 2 * self.rows, axis=2)) ** 2).sum(1)
        seen = frames - 1
        for k, (key, power) in enumerate(zip(_LABELS, powers, strict=True)):
            if noise[k] > 0:
                self.power[key] += told[k] * power / noise[k]
                self.weight[key][0] += told[k] * seen
                self.weight[key][1] += told[k] ** 2 * seen

    def numbers(self) -> dict[str, Number]:
        """Return the largest of each weighting, and what rows share of one amplitude in DN."""
        found = {
            _LABELS[key]: largest_line(self.power[key] / total, total**2 / squares)
            for key, (total, squares) in self.weight.items()
            if total
        }
        total, squares = self.weight[""]
        if total:
            power, degrees = self.power[""] / total, total**2 / squares
            found["slow_row_variance"] = slow_lines(power, degrees)
            found |= row_lags(power, degrees)
        return found

    def peaks(self) -> dict[str, Peak]:
        """Return where each is largest: cycles per row of a plane, power as a plane shows it."""
        found = {}
        for key, (total, _) in self.weight.items():
            if total:
                cycles, off, power = line_top(self.power[key] / total)
                as_plane = 1 + (power - 1) / len(self.sites)
                found[_KINDS[key]] = Peak(0.0, 2 * cycles / self.rows, as_plane, off)
        return found


def matched(
    channels: Mapping[str, Channel],
    variance_dn2: Mapping[str, float],
    shapes: Mapping[str, tuple[float, ...]],
    sites: Mapping[str, tuple[int, int]],
    rows: int,
) -> tuple[Array, list[float], list[float]] | None:
    """Return series of all rows, a matched filter of all channels; None: one has no noise.

    Parameters
    ----------
    channels
        Of one exposure.
    variance_dn2
        Of a pixel, as it is expected.
    shapes
        What a band moves each channel by, in each weighting.
    sites
        First row and column of each channel.
    rows
        Of the sensor.

    Returns
    -------
    series, noise, told
        By weighting: rows (weighting, frame, row), the power of noise in their spectrum, and what a
        band of unit size has in it.
    """
    pixels = {name: own.estimates["pixel_variance"].value for name, own in channels.items()}
    if not all(value > 0 for value in pixels.values()):
        return None
    count = len(next(iter(shapes.values())))
    frames = len(next(iter(channels.values())).moving_rows)
    series = np.zeros((count, frames, rows))
    noise, told = [0.0] * count, [0.0] * count
    for name, channel in channels.items():
        lines, across = channel.mean_frame.shape
        weights = tuple(shape * across / variance_dn2[name] for shape in shapes[name])
        for k, (own, shape) in enumerate(zip(weights, shapes[name], strict=True)):
            noise[k] += lines * own**2 * pixels[name] / across
            told[k] += lines * own * shape
        _add(series, weights, sites[name][0], 1 if len(sites) == 1 else 2, channel.moving_rows)
    return series, noise, told


@kernel
def _add(series: Array, weights: tuple[float, ...], first: int, step: int, moved: Array) -> None:
    """Add a channel's rows (frame, row) to series of all (weighting, frame, row of the sensor)."""
    for k in range(len(weights)):
        for t in range(moved.shape[0]):
            for y in range(moved.shape[1]):
                series[k, t, first + step * y] += weights[k] * moved[t, y]
