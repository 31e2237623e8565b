"""Maps of the sensor: as recorded, and as both models give them."""

from collections.abc import Sequence
from math import ceil

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.patches import Rectangle

from analysis.figures import ALARM, INK
from analysis.mismatch.evidence import Array, Map
from analysis.mismatch.finding import Where

WIDTH_INCHES = 9.6
MOST_PIXELS = 320  # a picture is not finer than the page
SMOOTH_CELLS = 24  # of a smooth surface, that the noise of pixels does not hide
PIXELS_MARKED = 12
PANELS = ("recorded", "simulated: base model", "simulated: physics named")


def size_inches(maps: Sequence[Map]) -> tuple[float, float]:
    """Return width and height of the figure."""
    lines, panels = _shape(maps)
    rows, columns = maps[0].recorded.shape
    width = {1: 5.6, 2: 8.0}.get(panels, WIDTH_INCHES)
    height = min(0.82 * width / panels * rows / columns, 5.0)
    return width, lines * (height + 0.55)


def draw(figure: Figure, maps: Sequence[Map], where: Where, most_pixels: int = MOST_PIXELS) -> None:
    """Draw maps: a line for each channel, one scale a line, what stands out marked in its first.

    Channels of which there is no simulation stand side by side, two a line. `most_pixels`: cells
    along the longer side; larger maps are shown by the means of blocks.
    """
    grid = figure.subplots(*_shape(maps), squeeze=False)
    alone = len(_panels(maps[0])) == 1
    lines = [[axes] for axes in grid.flat] if alone else [list(line) for line in grid]
    for line, one in zip(lines, maps, strict=False):
        scale = limits(reduced(one.recorded, most_pixels)[0])
        marks = where
        for axes, (title, image) in zip(line, _panels(one).items(), strict=True):
            drawn = draw_map(axes, reduced(image, most_pixels), one, scale, marks)
            marks = Where()
            of = "" if one.channel in ("", "MONO") else f"{one.channel}, "
            axes.set_title(f"{of}{title}", loc="left")
        figure.colorbar(drawn, ax=line, label=one.unit, shrink=0.85, pad=0.02)
    for line in lines[len(maps) :]:
        line[0].set_axis_off()


def draw_map(
    axes: Axes, shown: tuple[Array, int], one: Map, scale: tuple[float, float], where: Where
) -> AxesImage:
    """Draw a map that is `reduced`, in mosaic pixels; what `where` names is marked."""
    image, step = shown
    rows, columns = (step * one.pitch_px * size for size in image.shape)
    edge = (-0.5, columns - 0.5, rows - 0.5, -0.5)
    low, high = scale
    drawn = axes.imshow(
        image, cmap="cividis", vmin=low, vmax=high, extent=edge, interpolation="none"
    )
    axes.tick_params(labelsize=7)
    if step > 1:
        axes.set_xlabel(f"means of {step} x {step} pixels", fontsize=7)
    _mark(axes, where)
    return drawn


def _shape(maps: Sequence[Map]) -> tuple[int, int]:
    """Return lines and columns of panels."""
    panels = len(_panels(maps[0]))
    if panels > 1:
        return len(maps), panels
    return ceil(len(maps) / 2), min(len(maps), 2)


def reduced(image: Array, most_pixels: int) -> tuple[Array, int]:
    """Return an image of at most so many cells each way, and how many pixels a cell is wide."""
    step = ceil(max(image.shape) / most_pixels)
    rows, columns = (size // step for size in image.shape)
    blocks = image[: rows * step, : columns * step].reshape(rows, step, columns, step)
    return blocks.mean((1, 3)), step


def _panels(one: Map) -> dict[str, Array]:
    images = zip(PANELS, (one.recorded, one.before, one.after), strict=True)
    return {title: image for title, image in images if image is not None}


def limits(image: Array) -> tuple[float, float]:
    """Return a scale that a few wild pixels do not stretch."""
    low, high = np.nanquantile(image, (0.005, 0.995))
    return (float(low), float(high)) if high > low else (float(low) - 0.5, float(low) + 0.5)


def _mark(axes: Axes, where: Where) -> None:
    for row, column in (where.pixels or ())[:PIXELS_MARKED]:
        axes.plot(column, row, "o", mfc="none", mec=ALARM, ms=8, mew=1.1)
    if where.rows is not None and where.columns is not None:
        (top, bottom), (left, right) = where.rows, where.columns
        corner, size = (left - 0.5, top - 0.5), (right - left + 1, bottom - top + 1)
        axes.add_patch(Rectangle(corner, *size, fill=False, ec=ALARM, lw=1.2))
    else:
        for ends, span in ((where.rows, axes.axhspan), (where.columns, axes.axvspan)):
            if ends is not None:
                span(ends[0] - 0.5, ends[1] + 0.5, fill=False, ec=ALARM, lw=1.0, ls=(0, (4, 3)))
    for spine in axes.spines.values():
        spine.set(visible=True, color=INK)
