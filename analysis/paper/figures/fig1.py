"""Fig. 1: noise against the signal at the three stages."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullFormatter

from analysis.figures import GREY, INK
from analysis.paper.figures.style import draw
from dsis.noise import Segments

if TYPE_CHECKING:
    from analysis.paper.fig1 import Curve

LOOK = {"R": ("#D55E00", "o"), "G": ("#009E73", "^"), "B": ("#0072B2", "s")}
TITLES = ("1  raw data", "2  demosaicked (bilinear)", "3  display")
UNITS = ("DN above black", "DN after white balance", "8-bit codes")


def draw_stages(stages: "Sequence[Mapping[str, Curve]]", segments: Segments, path: Path) -> None:
    """Draw variance (above) and skewness (below) of R, G, B for each stage."""

    def fill(figure: Figure) -> None:
        grid = figure.subplots(2, 3, height_ratios=[3, 2], sharex="col")
        x = np.geomspace(5.0, 3e4, 400).astype(np.float32)
        grid[0, 0].plot(x, segments.variance_dn2(x), color=INK, lw=1.0, label="m x + t")
        for at, curves in enumerate(stages):
            above, below = grid[:, at]
            for colour, (paint, mark) in LOOK.items():
                c = curves[colour]
                above.plot(c.signal, c.variance, mark, color=paint, ms=3.6, label=colour)
                bars = 2 * c.skewness_error
                below.errorbar(
                    c.signal, c.skewness, bars, fmt=mark, color=paint, ms=3.2, elinewidth=0.7
                )
            below.axhline(0, color=GREY, lw=0.8, zorder=0)
            above.set_title(TITLES[at], loc="left")
            below.set_xlabel(UNITS[at])
            for axes in (above, below):
                axes.grid(visible=True)
            if at < 2:
                _decades(above, below)
        grid[0, 0].set_ylabel("variance, squared unit")
        grid[1, 0].set_ylabel("skewness, ±2 s.e.")
        grid[0, 0].legend(loc="upper left")

    draw(path, "Noise at the three stages of the pipeline", (10.4, 5.2), fill)


def _decades(above: Axes, below: Axes) -> None:
    plain = FuncFormatter(lambda value, _: f"{value:g}")
    above.set_xscale("log")
    above.set_yscale("log")
    for axis in (above.yaxis, below.xaxis):
        axis.set_major_formatter(plain)
        axis.set_minor_formatter(NullFormatter())
