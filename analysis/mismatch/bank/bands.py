"""Bands across a sensor: the temporal spectrum of its rows or columns, all colours in phase.

A line of a mosaic crosses two channels. Their means, each in proportion to what a band moves it by
and to the inverse of its noise, make one series over all lines (a matched filter), so that channels
add by amplitude, not by power.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.coherent import clearest_line, slow_lines
from analysis.mismatch.bank.linelags import line_lags
from analysis.mismatch.bank.linemeans import AXES, Axis
from analysis.mismatch.bank.peaks import Peak, frequency, largest_line, line_top
from analysis.mismatch.bank.scalars import Number
from dsis.compiled import kernel
from dsis.measures import Channel

Array = NDArray[np.float64]
_LABELS = {"": "", "signal": " of light"}
_WEIGHTINGS: dict[Axis, tuple[str, ...]] = {"row": ("", "signal"), "column": ("",)}


class Bands:
    """Power of series of lines over all exposures on half bins, white noise scaled to 1.

    Two weightings: bands of one amplitude in DN, and in proportion to the light, which a lamp and a
    rolling shutter make of rows.

    Parameters
    ----------
    lines
        Of the sensor.
    sites
        First row and column of each channel.
    axis
        Whose lines.
    """

    def __init__(
        self, lines: int, sites: Mapping[str, tuple[int, int]], axis: Axis = "row"
    ) -> None:
        self.lines, self.sites, self.axis = lines, sites, axis
        own = _WEIGHTINGS[axis]
        self.power = {key: np.zeros(lines + 1) for key in own}
        self.weight = {key: [0.0, 0.0] for key in own}

    def add(
        self,
        channels: Mapping[str, Channel],
        variance_dn2: Mapping[str, float],
        signal_dn: Mapping[str, float],
        frames: int,
    ) -> None:
        """Take one exposure; the variance and signal that are expected weigh it."""
        size = {name: {"": 1.0, "signal": max(signal_dn[name], 0.0)} for name in channels}
        shapes = {name: tuple(own[key] for key in self.power) for name, own in size.items()}
        found = matched(channels, variance_dn2, shapes, self.sites, self.lines, self.axis)
        if found is None:
            return
        series, noise, told = found
        powers = (np.abs(np.fft.rfft(series, 2 * self.lines, axis=2)) ** 2).sum(1)
        seen = frames - 1
        for k, (key, power) in enumerate(zip(self.power, powers, strict=True)):
            if noise[k] > 0:
                self.power[key] += told[k] * power / noise[k]
                self.weight[key][0] += told[k] * seen
                self.weight[key][1] += told[k] ** 2 * seen

    def numbers(self) -> dict[str, Number]:
        """Return the largest of each weighting, and what lines share of one amplitude in DN."""
        found = {
            f"{self.axis}_spectrum_peak{_LABELS[key]}": largest_line(
                self.power[key] / total, total**2 / squares
            )
            for key, (total, squares) in self.weight.items()
            if total
        }
        return found | self.slow()

    def slow(self) -> dict[str, Number]:
        """Return slow waves of lines, and how alike neighbours are."""
        total, squares = self.weight[""]
        if not total:
            return {}
        power, degrees = self.power[""] / total, total**2 / squares
        waves = {f"slow_{self.axis}_variance": slow_lines(power, degrees)}
        return waves | line_lags(power, degrees, self.axis)

    def peaks(self) -> dict[str, Peak]:
        """Return where each is largest: cycles per line of a plane, power as a plane shows it."""
        found, step = {}, 1 if len(self.sites) == 1 else 2
        for key, (total, squares) in self.weight.items():
            if not total:
                continue
            power, off = self.power[key] / total, 0.0
            if self.axis == "row":
                cycles, off, most = line_top(power)
                along = (0.0, step * cycles / self.lines)
            else:
                cycles, most = clearest_line(power[2:-1:2], total**2 / squares)
                along = (step * frequency(cycles, self.lines), 0.0)
            as_plane = 1 + (most - 1) / len(self.sites)
            found[f"{self.axis}s{_LABELS[key]}"] = Peak(*along, as_plane, off)
        return found


def matched(
    channels: Mapping[str, Channel],
    variance_dn2: Mapping[str, float],
    shapes: Mapping[str, tuple[float, ...]],
    sites: Mapping[str, tuple[int, int]],
    lines: int,
    axis: Axis = "row",
) -> tuple[Array, list[float], list[float]] | None:
    """Return series of all lines, a matched filter of all channels; None: one has no noise.

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
    lines, axis
        Of the sensor: how many, rows or columns.

    Returns
    -------
    series, noise, told
        By weighting: lines (weighting, frame, line), the power of noise in their spectrum, and what
        a band of unit size has in it.
    """
    pixels = {name: own.estimates["pixel_variance"].value for name, own in channels.items()}
    if not all(value > 0 for value in pixels.values()):
        return None
    count = len(next(iter(shapes.values())))
    frames, along = len(next(iter(channels.values())).moving_rows), AXES.index(axis)
    series = np.zeros((count, frames, lines))
    noise, told = [0.0] * count, [0.0] * count
    for name, channel in channels.items():
        own_lines, across = channel.mean_frame.shape[along], channel.mean_frame.shape[1 - along]
        moved = channel.moving_columns if along else channel.moving_rows
        weights = tuple(shape * across / variance_dn2[name] for shape in shapes[name])
        for k, (own, shape) in enumerate(zip(weights, shapes[name], strict=True)):
            noise[k] += own_lines * own**2 * pixels[name] / across
            told[k] += own_lines * own * shape
        _add(series, weights, sites[name][along], 1 if len(sites) == 1 else 2, moved)
    return series, noise, told


@kernel
def _add(series: Array, weights: tuple[float, ...], first: int, step: int, moved: Array) -> None:
    """Add a channel's lines (frame, line) to series of all (weighting, frame, sensor's line)."""
    for k in range(len(weights)):
        for t in range(moved.shape[0]):
            for y in range(moved.shape[1]):
                series[k, t, first + step * y] += weights[k] * moved[t, y]
