"""A map of pixels beside the distribution of its values: what few pixels do, and all of them."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from analysis.figures import ALARM, COLOURS
from analysis.mismatch.evidence import Array, Map
from analysis.mismatch.finding import Where
from analysis.mismatch.report.figures.maps import MOST_PIXELS, draw_map, limits, reduced
from analysis.mismatch.report.figures.ticks import plain_numbers
from analysis.mismatch.report.numbers import plain

WIDTH_INCHES = 9.6
_BINS = 80


def size_inches(maps: Sequence[Map]) -> tuple[float, float]:
    """Return width and height of the figure: a line for each channel."""
    rows, columns = maps[0].recorded.shape
    height = min(max(0.42 * WIDTH_INCHES * rows / columns, 2.4), 4.2)
    return WIDTH_INCHES, 0.4 + (height + 0.3) * len(maps)


def draw(figure: Figure, maps: Sequence[Map], where: Where) -> None:
    """Draw each channel's map as recorded, and how many pixels have each value: all three."""
    grid = figure.subplots(len(maps), 2, squeeze=False)
    for line, one in zip(grid, maps, strict=True):
        seen = reduced(one.recorded, MOST_PIXELS)
        drawn = draw_map(line[0], seen, one, limits(seen[0]), where)
        of = "" if one.channel in ("", "MONO") else f"{one.channel}, "
        line[0].set_title(f"{of}recorded", loc="left")
        figure.colorbar(drawn, ax=line[0], shrink=0.85, pad=0.02)
        _distribution(line[1], one)


def _distribution(axes: Axes, one: Map) -> None:
    images = (one.recorded, one.before, one.after)
    ends = [(float(i.min()), float(i.max())) for i in images if i is not None]
    edges = np.linspace(min(low for low, _ in ends), max(high for _, high in ends), _BINS + 1)
    counts = np.histogram(one.recorded, edges)[0]
    axes.stairs(counts, edges, fill=True, color="#b9c2cb", label=f"recorded, {_sd(one.recorded)}")
    models = (
        (one.before, ALARM, "base model"),
        (one.after, COLOURS[0], "physics named"),
    )
    for image, colour, label in models:
        if image is not None:
            counts = np.histogram(image, edges)[0]
            axes.stairs(counts, edges, color=colour, lw=1.2, label=f"{label}, {_sd(image)}")
    axes.set_yscale("log")
    axes.set_ylim(0.7, 30 * float(counts.max()))  # room for the legend
    plain_numbers(axes.yaxis)
    axes.set_xlabel(one.unit)
    axes.set_ylabel("pixels")
    axes.set_title("How many pixels", loc="left")
    axes.legend(loc="upper right")


def _sd(image: Array) -> str:
    return f"sd {plain(float(image.std()))}"
