"""Line means of a map: fixed patterns of rows or columns, seams, even and odd lines."""

from collections.abc import Sequence
from typing import Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from analysis.figures import ALARM, COLOURS, GREY, INK
from analysis.mismatch.evidence import Array, Map

Groups = Literal["", "halves", "parity"]
WIDTH_INCHES = 9.6
_SPREAD = 2.0  # standard deviations: the bands
_NAMES = {"halves": ("first half", "second half"), "parity": ("even lines", "odd lines")}


def size_inches(maps: Sequence[Map]) -> tuple[float, float]:
    """Return width and height of the figure: a line for each channel."""
    return WIDTH_INCHES, 0.7 + 2.1 * len(maps)


def draw(figure: Figure, maps: Sequence[Map], axis: str, groups: Groups) -> None:
    """Draw the means of `rows` or `columns`; bands: how far those of each model scatter.

    `groups` draws halves of the lines, or even and odd ones, in a colour each, with their means.
    """
    panels = figure.subplots(len(maps), 1, squeeze=False, sharex=True)[:, 0]
    for axes, one in zip(panels, maps, strict=True):
        means = line_means(one.recorded, axis)
        place = one.pitch_px * np.arange(means.size, dtype=np.float64)
        _bands(axes, one, axis)
        if groups:
            _grouped(axes, place, means, groups)
        else:
            axes.plot(place, means, color=INK, lw=0.8, label="recorded")
        of = "" if one.channel in ("", "MONO") else f"{one.channel}, "
        axes.set_title(f"{of}means of {axis}", loc="left")
        axes.set_ylabel(one.unit)
        axes.grid(visible=True)
        axes.set_axisbelow(True)
    panels[-1].set_xlabel(axis.removesuffix("s"))
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=5)


def line_means(image: Array, axis: str) -> Array:
    """Return the means of rows or columns, less their mean."""
    means = image.mean(1 if axis == "rows" else 0)
    return np.asarray(means - means.mean())


def _bands(axes: Axes, one: Map, axis: str) -> None:
    axes.axhline(0, color=GREY, lw=0.8, zorder=0)
    if one.before is not None:
        reach = _SPREAD * float(line_means(one.before, axis).std())
        axes.axhspan(-reach, reach, color=ALARM, alpha=0.2, lw=0, label="base model, ± 2 sd")
    if one.after is not None:
        reach = _SPREAD * float(line_means(one.after, axis).std())
        label = "physics named, ± 2 sd"
        axes.axhline(reach, color=COLOURS[0], ls=(0, (5, 3)), lw=1.1, label=label)
        axes.axhline(-reach, color=COLOURS[0], ls=(0, (5, 3)), lw=1.1)


def _grouped(axes: Axes, place: Array, means: Array, groups: Groups) -> None:
    number = np.arange(means.size)
    second = number % 2 == 1 if groups == "parity" else number >= means.size / 2
    for own, colour, name in zip((~second, second), COLOURS[1:3], _NAMES[groups], strict=True):
        axes.plot(place[own], means[own], ".", color=colour, ms=3.5, label=name)
        ends = place[own][[0, -1]]
        axes.plot(ends, [means[own].mean()] * 2, color=colour, lw=1.8)
