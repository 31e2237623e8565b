"""Maps of the sensor: as recorded, and as both models give them."""

from collections.abc import Sequence
from math import ceil

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from analysis.figures import ALARM, INK
from analysis.mismatch.evidence import Array, Map
from analysis.mismatch.finding import Where

WIDTH_INCHES = 9.6
MOST_PIXELS = 320  # a picture is not finer than the page
PIXELS_MARKED = 12
PANELS = ("recorded", "base model", "with the physics named")


def size_inches(maps: Sequence[Map]) -> tuple[float, float]:
    """Return width and height of the figure."""
    lines, panels = _shape(maps)
    rows, columns = maps[0].recorded.shape
    width = {1: 5.6, 2: 8.0}.get(panels, WIDTH_INCHES)
    height = min(0.82 * width / panels * rows / columns, 5.0)
    return width, lines * (height + 0.55)


def draw(figure: Figure, maps: Sequence[Map], where: Where) -> None:
    """Draw maps: a line for each channel, one scale a line, what stands out marked in its first.

    Channels of which there is no simulation stand side by side, two a line.
    """
    grid = figure.subplots(*_shape(maps), squeeze=False)
    alone = len(_panels(maps[0])) == 1
    lines = [[axes] for axes in grid.flat] if alone else [list(line) for line in grid]
    for line, one in zip(lines, maps, strict=False):
        low, high = _limits(one.recorded)
        for axes, (title, image) in zip(line, _panels(one).items(), strict=True):
            shown, step = reduced(image)
            rows, columns = image.shape
            edge = (-0.5, one.pitch_px * columns - 0.5, one.pitch_px * rows - 0.5, -0.5)
            drawn = axes.imshow(
                shown, cmap="cividis", vmin=low, vmax=high, extent=edge, interpolation="none"
            )
            of = "" if one.channel in ("", "MONO") else f"{one.channel}, "
            axes.set_title(f"{of}{title}", loc="left")
            axes.tick_params(labelsize=7)
            if step > 1:
                axes.set_xlabel(f"means of {step} x {step} pixels", fontsize=7)
        _mark(line[0], where)
        figure.colorbar(drawn, ax=line, label=one.unit, shrink=0.85, pad=0.02)
    for line in lines[len(maps) :]:
        line[0].set_axis_off()


def _shape(maps: Sequence[Map]) -> tuple[int, int]:
    """Return lines and columns of panels."""
    panels = len(_panels(maps[0]))
    if panels > 1:
        return len(maps), panels
    return ceil(len(maps) / 2), min(len(maps), 2)


def reduced(image: Array) -> tuple[Array, int]:
    """Return an image of at most `MOST_PIXELS` each way, and how many pixels a block has."""
    step = ceil(max(image.shape) / MOST_PIXELS)
    rows, columns = (size // step for size in image.shape)
    blocks = image[: rows * step, : columns * step].reshape(rows, step, columns, step)
    return blocks.mean((1, 3)), step


def _panels(one: Map) -> dict[str, Array]:
    images = zip(PANELS, (one.recorded, one.before, one.after), strict=True)
    return {title: image for title, image in images if image is not None}


def _limits(image: Array) -> tuple[float, float]:
    """Return a scale that a few wild pixels do not stretch."""
    seen = reduced(image)[0]
    low, high = np.nanquantile(seen, (0.005, 0.995))
    return (float(low), float(high)) if high > low else (float(low) - 0.5, float(low) + 0.5)


def _mark(axes: Axes, where: Where) -> None:
    for row, column in (where.pixels or ())[:PIXELS_MARKED]:
        axes.plot(column, row, "o", mfc="none", mec=ALARM, ms=8, mew=1.1)
    for ends, span in ((where.rows, axes.axhspan), (where.columns, axes.axvspan)):
        if ends is not None:
            span(ends[0] - 0.5, ends[1] + 0.5, fill=False, ec=ALARM, lw=1.0, ls=(0, (4, 3)))
    for spine in axes.spines.values():
        spine.set(visible=True, color=INK)
