"""How the frames of a scene lie from their mean, in the order recorded."""

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from analysis.figures import ALARM, COLOURS, GREY
from analysis.mismatch.evidence import Shift
from analysis.mismatch.report.figures.series import by_frame

SIZE_INCHES = (9.6, 2.9)
_SPREAD = 2.0  # standard errors: the bars


def draw(figure: Figure, shown: Mapping[str, Shift]) -> None:
    """Draw shifts to the right and down with two standard errors, a panel per scene."""
    panels = np.ravel(figure.subplots(1, len(shown), squeeze=False, sharey=True))
    for axes, (name, one) in zip(panels, shown.items(), strict=True):
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
        by_frame(axes, name)
    panels[0].set_ylabel("shift from the mean, pixels")
    figure.legend(*panels[-1].get_legend_handles_labels(), loc="outside lower center", ncols=2)
