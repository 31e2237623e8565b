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
    """Return width and height of a figure with a line of panels for each channel."""
    panels = len(_panels(maps[0]))
    rows, columns = maps[0].recorded.shape
    width = {1: 5.6, 2: 8.0, 3: WIDTH_INCHES}[panels]
    height = min(0.82 * width / panels * rows / columns, 5.0)
    return width, len(maps) * (height + 0.55)


def draw(figure: Figure, maps: Sequence[Map], where: Where) -> None:
    """Draw the maps of some channels on one scale each; what stands out is marked in the first."""
    panels = len(_panels(maps[0]))
    grid = figure.subplots(len(maps), panels, squeeze=False)
    for line, one in zip(grid, maps, strict=True):
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
        figure.colorbar(drawn, ax=list(line), label=one.unit, shrink=0.85, pad=0.02)


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
