"""How the frames of a scene lie from their mean: as a whole, and in waves over their rows."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from scipy.stats import chi2

from analysis.figures import ALARM, COLOURS, GREY
from analysis.mismatch.evidence import Shift
from analysis.mismatch.report.figures.series import by_frame

SIZE_INCHES = (9.6, 2.9)  # of each scene
_SPREAD = 2.0  # standard errors: the bars
_CHANCE = (0.005, 0.995)  # quantiles of what chance makes of a wave


def size_inches(shown: Mapping[str, Shift]) -> tuple[float, float]:
    """Return the size of the figure: a row of panels per scene."""
    return SIZE_INCHES[0], SIZE_INCHES[1] * len(shown)


def draw(figure: Figure, shown: Mapping[str, Shift]) -> None:
    """Draw shifts to the right and down with two standard errors, and waves; a row per scene."""
    panels = figure.subplots(len(shown), 2, squeeze=False, width_ratios=(3, 2))
    for (frames, waves), (name, one) in zip(panels, shown.items(), strict=True):
        _frames(frames, one)
        by_frame(frames, name)
        frames.set_ylabel("shift from the mean, pixels")
        _waves(waves, one)
        waves.set_title("waves over the rows", loc="left")
    handles, labels = panels[-1][0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=2)


def _frames(axes: Axes, one: Shift) -> None:
    axes.axhline(0, color=GREY, lw=0.8, zorder=0)
    for aside, pixels, error, colour, label in (
        (-0.1, one.right_px, one.right_error_px, COLOURS[0], "to the right"),
        (0.1, one.down_px, one.down_error_px, ALARM, "down"),
    ):
        numbers = np.flatnonzero(np.isfinite(pixels))
        reach = _SPREAD * error if np.isfinite(error) else 0.0
        axes.errorbar(
            numbers + aside,
            pixels[numbers],
            reach,
            fmt="o-",
            color=colour,
            ms=3.8,
            lw=0.7,
            capsize=2,
            label=f"{label}, \u00b1 2 se",
        )


def _waves(axes: Axes, one: Shift) -> None:
    """Draw mean squares of waves by their cycles, and in grey what 99 % of them are by chance."""
    cycles = np.arange(one.degrees.size)
    if cycles.size:
        low, high = (chi2.ppf(q, one.degrees) / one.degrees for q in _CHANCE)
        axes.fill_between(cycles, low, high, color=GREY, alpha=0.25, lw=0, label="chance")
    for waves, colour in ((one.right_waves, COLOURS[0]), (one.down_waves, ALARM)):
        axes.plot(np.arange(waves.size), waves, "o-", color=colour, ms=3.8, lw=0.7)
    axes.set_ylim(bottom=0)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_xlabel("cycles a frame")
    axes.set_ylabel("mean square, 1 by chance")
